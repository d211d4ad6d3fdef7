//! Lemke's method for 0 ≤ x ⊥ y = M x + q ≥ 0, with some x free (then y = 0).
//!
//! An artificial variable t, added with weight one to every y, makes x = 0 feasible. Pivots follow
//! the path of almost complementary solutions, on which every other pair (x, y) has x y = 0, until
//! t reaches zero, which is a solution, or the path ends on a ray. For a positive semidefinite M a
//! ray proves infeasibility. Ties of the minimum ratio are broken by the lexicographic rule, as if
//! each y were perturbed by a distinct power of an infinitesimal, which excludes cycling.

/// Entries of the tableau below this are zero to working precision; M must be scaled to a unit
/// diagonal.
const ZERO: f64 = 1e-11;

/// Relative difference below which two ratios are tied.
const TIE: f64 = 1e-12;

/// Outcome of the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Solution,
    Ray,
    /// The limit of pivots was reached, far above the number that occurs in practice.
    Limit,
}

/// The tableau: each basic variable as an affine function of the others. Variables are numbered y,
/// x, t.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lemke {
    size: usize,
    /// Rows of coefficients of the `size` + 1 nonbasic variables, followed by the constant.
    table: Vec<f64>,
    basic: Vec<usize>,
    nonbasic: Vec<usize>,
    /// Whether each x is free. Rows of free x impose no ratio, and their y stays zero.
    free: Vec<bool>,
    /// Direction of the ray, in x.
    ray: Vec<f64>,
    pivot_row: Vec<f64>,
    pub(crate) pivots: u32,
}

impl Lemke {
    /// Starts a problem: all zero.
    pub(crate) fn reset(&mut self, size: usize) {
        self.size = size;
        self.table.clear();
        self.table.resize(size * (size + 2), 0.0);
        self.basic.clear();
        self.basic.extend(0..size);
        self.nonbasic.clear();
        self.nonbasic.extend(size..=2 * size);
        self.free.clear();
        self.free.resize(size, false);
        self.ray.clear();
        self.ray.resize(size, 0.0);
        self.pivots = 0;
    }

    /// Sets an entry of M.
    pub(crate) fn set(&mut self, row: usize, column: usize, value: f64) {
        let at = self.at(row, column);
        self.table[at] = value;
    }

    /// Sets an entry of q.
    pub(crate) fn offset(&mut self, row: usize, value: f64) {
        let at = self.at(row, self.size + 1);
        self.table[at] = value;
    }

    /// Divides q by a number.
    pub(crate) fn divide_offsets(&mut self, by: f64) {
        for entries in self.table.chunks_exact_mut(self.size + 2) {
            entries[self.size + 1] /= by;
        }
    }

    /// Frees an x.
    pub(crate) fn free(&mut self, row: usize) {
        self.free[row] = true;
    }

    /// Writes the solution x, in order.
    pub(crate) fn solution(&self, x: &mut [f64]) {
        x.fill(0.0);
        for (row, &variable) in self.basic.iter().enumerate() {
            if let Some(number) = self.number_of_x(variable) {
                x[number] = self.constant(row);
            }
        }
    }

    /// Returns the direction x of the ray on which the path ended: any multiple of it may be added.
    pub(crate) fn ray(&self) -> &[f64] {
        &self.ray
    }

    /// Follows the path to its end.
    pub(crate) fn solve(&mut self) -> End {
        for row in 0..self.size {
            let at = self.at(row, self.size);
            self.table[at] = if self.free[row] { 0.0 } else { 1.0 };
        }
        if let Some(column) = self.pivot_free_variables() {
            return self.end_on_ray(column);
        }
        // Of tied rows the last one: the minimum under the lexicographic perturbation.
        let mut minimum = (0.0, None);
        for row in 0..self.size {
            let value = self.constant(row);
            if !self.free[row] && value < 0.0 && value <= minimum.0 {
                minimum = (value, Some(row));
            }
        }
        let Some(mut row) = minimum.1 else {
            return End::Solution;
        };
        let artificial = 2 * self.size;
        let mut column = self.size;
        for _ in 0..50 * (self.size + 1) {
            let leaving = self.basic[row];
            self.pivot(row, column);
            if leaving == artificial {
                return End::Solution;
            }
            let entering = if leaving < self.size {
                leaving + self.size
            } else {
                leaving - self.size
            };
            column = self.column_of(entering);
            match self.minimum_ratio_row(column) {
                Some(next) => row = next,
                None => return self.end_on_ray(column),
            }
        }
        End::Limit
    }

    /// Makes the free x basic, in order of decreasing diagonal entries, until the remainder of M
    /// among them is zero. Returns the column of a free x whose y is then fixed at a non-zero
    /// value, if there is one.
    fn pivot_free_variables(&mut self) -> Option<usize> {
        loop {
            let mut largest = (ZERO, None);
            for row in (0..self.size).filter(|&row| self.free[row] && self.basic[row] == row) {
                let entry = self.table[self.at(row, row)].abs();
                if entry > largest.0 {
                    largest = (entry, Some(row));
                }
            }
            match largest.1 {
                Some(row) => self.pivot(row, row),
                None => break,
            }
        }
        (0..self.size).find(|&row| {
            self.free[row] && self.basic[row] == row && self.constant(row).abs() > 1e3 * ZERO
        })
    }

    /// Returns the row of minimum ratio: its variable reaches zero first as that of the column
    /// grows.
    fn minimum_ratio_row(&self, column: usize) -> Option<usize> {
        let artificial = 2 * self.size;
        let mut best: Option<(f64, usize)> = None;
        for row in 0..self.size {
            let (variable, rate) = (self.basic[row], -self.table[self.at(row, column)]);
            if rate <= ZERO || (variable < artificial && self.free[variable % self.size]) {
                continue;
            }
            let ratio = self.constant(row).max(0.0) / rate;
            best = match best {
                Some((least, other)) => {
                    let tied = TIE * (1.0 + least);
                    let first = if (ratio - least).abs() > tied {
                        ratio < least
                    } else if self.basic[other] == artificial {
                        false
                    } else {
                        variable == artificial
                            || self.precedes_lexicographically(row, other, column)
                    };
                    Some(if first { (ratio, row) } else { (least, other) })
                }
                None => Some((ratio, row)),
            };
        }
        best.map(|(_, row)| row)
    }

    /// Returns whether `row` precedes `other`, tied with it, under the lexicographic perturbation
    /// of the y.
    fn precedes_lexicographically(&self, row: usize, other: usize, column: usize) -> bool {
        let rates = [row, other].map(|r| -self.table[self.at(r, column)]);
        for y in 0..self.size {
            let by_y = |r: usize| match self.nonbasic.iter().position(|&v| v == y) {
                Some(at) => -self.table[self.at(r, at)],
                None => f64::from(u8::from(self.basic[r] == y)),
            };
            let [a, b] = [by_y(row) / rates[0], by_y(other) / rates[1]];
            if (a - b).abs() > TIE * (1.0 + a.abs()) {
                return a < b;
            }
        }
        false
    }

    /// Exchanges a basic variable with a nonbasic one.
    fn pivot(&mut self, row: usize, column: usize) {
        self.pivots += 1;
        let width = self.size + 2;
        let inverse = 1.0 / self.table[self.at(row, column)];
        self.pivot_row.clear();
        self.pivot_row
            .extend_from_slice(&self.table[row * width..(row + 1) * width]);
        for value in &mut self.pivot_row {
            *value *= -inverse;
        }
        self.pivot_row[column] = 0.0;
        for entries in self.table.chunks_exact_mut(width) {
            let factor = entries[column];
            if factor != 0.0 {
                for (entry, pivot) in entries.iter_mut().zip(&self.pivot_row) {
                    *entry += factor * pivot;
                }
                entries[column] = factor * inverse;
            }
        }
        self.pivot_row[column] = inverse;
        self.table[row * width..(row + 1) * width].copy_from_slice(&self.pivot_row);
        std::mem::swap(&mut self.basic[row], &mut self.nonbasic[column]);
    }

    fn end_on_ray(&mut self, column: usize) -> End {
        self.ray.fill(0.0);
        if let Some(x) = self.number_of_x(self.nonbasic[column]) {
            self.ray[x] = 1.0;
        }
        for row in 0..self.size {
            if let Some(x) = self.number_of_x(self.basic[row]) {
                self.ray[x] = self.table[self.at(row, column)];
            }
        }
        End::Ray
    }

    /// Returns the index of the x that a variable is, if it is an x.
    fn number_of_x(&self, variable: usize) -> Option<usize> {
        variable.checked_sub(self.size).filter(|&x| x < self.size)
    }

    fn at(&self, row: usize, column: usize) -> usize {
        row * (self.size + 2) + column
    }

    fn constant(&self, row: usize) -> f64 {
        self.table[self.at(row, self.size + 1)]
    }

    fn column_of(&self, variable: usize) -> usize {
        self.nonbasic
            .iter()
            .position(|&v| v == variable)
            .unwrap_or(self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(m: &[[f64; 3]; 3], q: [f64; 3]) -> (End, [f64; 3], u32) {
        let mut lemke = Lemke::default();
        lemke.reset(3);
        for (i, row) in m.iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                lemke.set(i, j, entry);
            }
            lemke.offset(i, q[i]);
        }
        let end = lemke.solve();
        let mut x = [0.0; 3];
        lemke.solution(&mut x);
        (end, x, lemke.pivots)
    }

    /// All rows tie at the start. An arbitrary choice among tied rows cycles here, in either sense.
    #[test]
    fn tied_ratios_do_not_cycle() {
        for m in [
            [[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]],
            [[1.0, 0.0, 2.0], [2.0, 1.0, 0.0], [0.0, 2.0, 1.0]],
        ] {
            let (end, x, pivots) = solve(&m, [-1.0; 3]);
            assert_eq!(end, End::Solution);
            assert!(pivots <= 8, "{pivots} pivots");
            for x in x {
                assert!((x - 1.0 / 3.0).abs() < 1e-12);
            }
        }
    }
}
