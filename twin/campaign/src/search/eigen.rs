//! Eigenvalues of symmetric matrices by Jacobi's method, cyclic by rows.
//!
//! It is made of `+ − × ÷ √` in a fixed order, so that the bits are the same everywhere. The sizes
//! are those of searches, some tens of parameters, where its speed does not matter.

/// Square matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrix {
    size: usize,
    values: Vec<f64>,
}

/// Eigenvalues of a symmetric matrix, with an orthonormal eigenvector for each.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Eigen {
    pub values: Vec<f64>,
    /// Vector `k` is column `k`.
    pub vectors: Matrix,
}

impl Matrix {
    pub fn identity(size: usize) -> Self {
        let mut values = vec![0.0; size * size];
        for diagonal in values.iter_mut().step_by(size + 1) {
            *diagonal = 1.0;
        }
        Self { size, values }
    }

    pub fn zeros(size: usize) -> Self {
        Self {
            size,
            values: vec![0.0; size * size],
        }
    }

    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        *self.at_mut(row, column) = value;
    }

    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.values[row * self.size + column]
    }

    pub fn diagonal(&self) -> impl Iterator<Item = f64> {
        self.values.iter().step_by(self.size + 1).copied()
    }

    fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.values[row * self.size + column]
    }

    pub fn scale(&mut self, factor: f64) {
        for value in &mut self.values {
            *value *= factor;
        }
    }

    /// Adds `weight` × `vector` `vector`ᵀ.
    pub fn add_outer(&mut self, vector: &[f64], weight: f64) {
        for (row, &one) in vector.iter().enumerate() {
            let start = row * self.size;
            let values = &mut self.values[start..start + self.size];
            for (value, &other) in values.iter_mut().zip(vector) {
                // The product of both first, so that the matrix stays symmetric to the last bit.
                *value += weight * (one * other);
            }
        }
    }

    /// Returns the product with a vector.
    pub fn times(&self, vector: &[f64]) -> Vec<f64> {
        let rows = self.values.chunks_exact(self.size);
        rows.map(|row| row.iter().zip(vector).map(|(one, other)| one * other).sum())
            .collect()
    }

    /// Returns the product of the transpose with a vector.
    pub fn transposed_times(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.size];
        for (row, &factor) in self.values.chunks_exact(self.size).zip(vector) {
            for (sum, value) in product.iter_mut().zip(row) {
                *sum += value * factor;
            }
        }
        product
    }

    /// Returns eigenvalues and eigenvectors, in no particular order. The matrix is symmetric.
    pub fn eigen(&self) -> Eigen {
        /// Far more sweeps than any matrix of finite numbers takes.
        const SWEEPS: usize = 60;
        let mut matrix = self.clone();
        let mut vectors = Self::identity(self.size);
        for _ in 0..SWEEPS {
            let mut rotated = false;
            for row in 0..self.size {
                for column in row + 1..self.size {
                    rotated |= matrix.annihilate(row, column, &mut vectors);
                }
            }
            if !rotated {
                break;
            }
        }
        Eigen {
            values: matrix.diagonal().collect(),
            vectors,
        }
    }

    /// Makes an element off the diagonal zero by a rotation, which is also applied to `vectors`;
    /// returns whether it was above round-off of the diagonal.
    fn annihilate(&mut self, p: usize, q: usize, vectors: &mut Self) -> bool {
        let (app, aqq, apq) = (self.at(p, p), self.at(q, q), self.at(p, q));
        if apq.abs() <= 0.5 * f64::EPSILON * (app.abs() * aqq.abs()).sqrt() || !apq.is_finite() {
            return false;
        }
        // Tangent of the smaller of both angles.
        let cotangent = (aqq - app) / (2.0 * apq);
        let root = (1.0 + cotangent * cotangent).sqrt();
        let tangent = 1.0 / (cotangent + if cotangent < 0.0 { -root } else { root });
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        let sine = tangent * cosine;
        let rotate =
            |one: f64, other: f64| (cosine * one - sine * other, sine * one + cosine * other);
        for k in 0..self.size {
            if k != p && k != q {
                let (one, other) = rotate(self.at(k, p), self.at(k, q));
                (*self.at_mut(k, p), *self.at_mut(p, k)) = (one, one);
                (*self.at_mut(k, q), *self.at_mut(q, k)) = (other, other);
            }
            let (one, other) = rotate(vectors.at(k, p), vectors.at(k, q));
            (*vectors.at_mut(k, p), *vectors.at_mut(k, q)) = (one, other);
        }
        *self.at_mut(p, p) = app - tangent * apq;
        *self.at_mut(q, q) = aqq + tangent * apq;
        (*self.at_mut(p, q), *self.at_mut(q, p)) = (0.0, 0.0);
        true
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The definition: A v = λ v, and orthonormal vectors; of matrices with eigenvalues over
        /// twelve decades.
        #[test]
        fn eigenvectors_are_orthonormal_and_scaled_by_the_matrix(
            size in 1..9_usize,
            numbers in prop::collection::vec(-1.0..1.0_f64, 81),
            decades in 0.0..12.0_f64,
        ) {
            let mut matrix = Matrix::identity(size);
            matrix.scale(libm::pow(10.0, -decades));
            for row in numbers.chunks(9) {
                matrix.add_outer(&row[..size], row[0]);
            }
            let norm = matrix.values.iter().map(|value| value.abs()).fold(0.0, f64::max);
            let Eigen { values, vectors } = matrix.eigen();
            for (k, value) in values.iter().enumerate() {
                let vector: Vec<f64> = (0..size).map(|row| vectors.at(row, k)).collect();
                let product = matrix.times(&vector);
                for (one, other) in product.iter().zip(&vector) {
                    prop_assert!((one - value * other).abs() < 1e-14 * norm * size as f64);
                }
                for (j, dot) in vectors.transposed_times(&vector).into_iter().enumerate() {
                    let expected = f64::from(u8::from(j == k));
                    prop_assert!((dot - expected).abs() < 1e-13);
                }
            }
        }
    }
}
