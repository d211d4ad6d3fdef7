//! Lemke's method for 0 ≤ x ⊥ y = M x + q ≥ 0, with some x free (then y = 0).
//!
//! An artificial variable t, of which every y gets as much, makes x = 0 feasible. Along the path on which every other pair
//! (x, y) keeps x y = 0, pivots bring t to zero, which is a solution, or the path ends on a ray. For a positive semidefinite
//! M a ray means that there is no solution. The least ratio is chosen as if each y had been moved by its own power of a
//! tiny number (the lexicographic rule); so no tie is left, and no path goes round in circles.

/// Entries of the tableau below this are zero to working precision; M is to be scaled to a diagonal of ones.
const ZERO: f64 = 1e-11;

/// Ratios nearer to each other than this, relatively, count as tied.
const TIE: f64 = 1e-12;

/// How the path ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Solution,
    Ray,
    /// After more pivots than a path has in practice.
    Limit,
}

/// The tableau: each basic variable as an affine function of the others. Variables are numbered y, x, t.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lemke {
    size: usize,
    /// Rows of coefficients: those of `size` variables and of one more, then the constant.
    table: Vec<f64>,
    basic: Vec<usize>,
    others: Vec<usize>,
    /// Which x are free. Their rows set no ratio, and what they leave to the others stays zero.
    free: Vec<bool>,
    /// Direction of a ray: the x that grow, and how.
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
        self.others.clear();
        self.others.extend(size..=2 * size);
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

    /// The x that were found, in order.
    pub(crate) fn solution(&self, x: &mut [f64]) {
        x.fill(0.0);
        for (row, &variable) in self.basic.iter().enumerate() {
            if let Some(number) = self.number_of_x(variable) {
                x[number] = self.constant(row);
            }
        }
    }

    /// The x of the ray on which the path ended: multiples of it may be added for ever.
    pub(crate) fn ray(&self) -> &[f64] {
        &self.ray
    }

    /// Goes along the path.
    pub(crate) fn solve(&mut self) -> End {
        for row in 0..self.size {
            let at = self.at(row, self.size);
            self.table[at] = if self.free[row] { 0.0 } else { 1.0 };
        }
        if let Some(column) = self.release() {
            return self.end_on_ray(column);
        }
        // Of rows that are equally short, the last: with the tiny moves it is the shortest.
        let mut shortest = (0.0, None);
        for row in 0..self.size {
            let value = self.constant(row);
            if !self.free[row] && value < 0.0 && value <= shortest.0 {
                shortest = (value, Some(row));
            }
        }
        let Some(mut row) = shortest.1 else {
            return End::Solution;
        };
        let artificial = 2 * self.size;
        let mut column = self.size;
        for _ in 0..50 * (self.size + 1) {
            let leaves = self.basic[row];
            self.pivot(row, column);
            if leaves == artificial {
                return End::Solution;
            }
            let enters = if leaves < self.size {
                leaves + self.size
            } else {
                leaves - self.size
            };
            column = self.column_of(enters);
            match self.shortest(column) {
                Some(next) => row = next,
                None => return self.end_on_ray(column),
            }
        }
        End::Limit
    }

    /// Makes the free x basic, the stiffest first, until what is left of M between them is zero. Gives the column of one
    /// whose y is then fixed at something else than zero, if there is one.
    fn release(&mut self) -> Option<usize> {
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

    /// The row whose variable reaches zero first as that of the column grows.
    fn shortest(&self, column: usize) -> Option<usize> {
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
                    let apart = TIE * (1.0 + least);
                    let first = if (ratio - least).abs() > apart {
                        ratio < least
                    } else if self.basic[other] == artificial {
                        false
                    } else {
                        variable == artificial || self.moved_less(row, other, column)
                    };
                    Some(if first { (ratio, row) } else { (least, other) })
                }
                None => Some((ratio, row)),
            };
        }
        best.map(|(_, row)| row)
    }

    /// Which of two tied rows the tiny moves of the y make the shorter.
    fn moved_less(&self, row: usize, other: usize, column: usize) -> bool {
        let rates = [row, other].map(|r| -self.table[self.at(r, column)]);
        for y in 0..self.size {
            let by_y = |r: usize| match self.others.iter().position(|&v| v == y) {
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

    /// Exchanges a basic variable with another.
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
        std::mem::swap(&mut self.basic[row], &mut self.others[column]);
    }

    fn end_on_ray(&mut self, column: usize) -> End {
        self.ray.fill(0.0);
        if let Some(x) = self.number_of_x(self.others[column]) {
            self.ray[x] = 1.0;
        }
        for row in 0..self.size {
            if let Some(x) = self.number_of_x(self.basic[row]) {
                self.ray[x] = self.table[self.at(row, column)];
            }
        }
        End::Ray
    }

    /// Which x a variable is, if it is one.
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
        self.others
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

    /// All rows tie at the start. Taking just any of tied rows goes round in circles here, in either sense.
    #[test]
    fn ties_do_not_send_the_path_in_circles() {
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
