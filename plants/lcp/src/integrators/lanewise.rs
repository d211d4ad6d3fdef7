//! Small dense linear systems, one per lane.

use crate::model::real::{Lanes, Real};

/// Maximum number of rows: four links and a pulley.
pub(crate) const ROWS: usize = 5;

/// Vector of [`ROWS`] values, of which the first `n` belong to the system.
pub(crate) type Column = [Lanes; ROWS];

/// LU decomposition with partial pivoting; each lane selects its own pivots.
#[derive(Debug, Clone)]
pub(crate) struct LaneFactors {
    n: usize,
    /// L below the diagonal, U above it, and the inverse of U's diagonal on it.
    matrix: [Column; ROWS],
    /// Masks of the exchanges of rows k and i in step k.
    swapped: [Column; ROWS],
}

/// Exchanges two values in the lanes of `swap`.
fn ordered(swap: Lanes, a: Lanes, b: Lanes) -> (Lanes, Lanes) {
    (swap.bitselect(b, a), swap.bitselect(a, b))
}

impl LaneFactors {
    /// Decomposes the leading `n` rows and columns. The factors of a lane with a singular matrix
    /// are not finite.
    pub(crate) fn new(mut a: [Column; ROWS], n: usize) -> Self {
        let mut swapped = [[Lanes::zero(); ROWS]; ROWS];
        for k in 0..n {
            for i in k + 1..n {
                let swap = a[i][k].abs().simd_gt(a[k][k].abs());
                swapped[k][i] = swap;
                let (above, below) = a.split_at_mut(i);
                for (p, q) in above[k].iter_mut().zip(&mut below[0]).take(n) {
                    (*p, *q) = ordered(swap, *p, *q);
                }
            }
            let inverse = Lanes::splat(1.0) / a[k][k];
            a[k][k] = inverse;
            for i in k + 1..n {
                let factor = a[i][k] * inverse;
                a[i][k] = factor;
                let upper = a[k];
                for (entry, upper) in a[i].iter_mut().zip(&upper).take(n).skip(k + 1) {
                    *entry -= factor * *upper;
                }
            }
        }
        Self {
            n,
            matrix: a,
            swapped,
        }
    }

    /// Solves for a right-hand side.
    pub(crate) fn solve(&self, mut b: Column) -> Column {
        let n = self.n;
        for k in 0..n {
            for i in k + 1..n {
                (b[k], b[i]) = ordered(self.swapped[k][i], b[k], b[i]);
            }
        }
        for i in 1..n {
            for j in 0..i {
                let known = b[j];
                b[i] -= self.matrix[i][j] * known;
            }
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                let known = b[j];
                b[i] -= self.matrix[i][j] * known;
            }
            b[i] *= self.matrix[i][i];
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_lane_solves_its_system(
            entries in proptest::collection::vec(-1.0..1.0_f64, 4 * ROWS * ROWS),
            right in proptest::collection::vec(-1.0..1.0_f64, 4 * ROWS),
            n in 1..=ROWS,
        ) {
            let gather = |of: &dyn Fn(usize) -> f64| Lanes::new(std::array::from_fn(of));
            let a: [Column; ROWS] = std::array::from_fn(|i| std::array::from_fn(|j| {
                gather(&|lane| entries[(lane * ROWS + i) * ROWS + j])
            }));
            let b: Column = std::array::from_fn(|i| gather(&|lane| right[lane * ROWS + i]));
            let x = LaneFactors::new(a, n).solve(b);
            for lane in 0..4 {
                let size = (0..n).map(|i| x[i].lane(lane).abs()).fold(1.0, f64::max);
                for i in 0..n {
                    let sum: f64 = (0..n).map(|j| a[i][j].lane(lane) * x[j].lane(lane)).sum();
                    prop_assert!((sum - b[i].lane(lane)).abs() < 1e-12 * size);
                }
            }
        }
    }

    #[test]
    fn zero_diagonal_in_one_lane_is_pivoted() {
        let [zero, one] = [0.0, 1.0].map(Lanes::splat);
        let mut a = [[zero; ROWS]; ROWS];
        (a[0][0], a[0][1]) = (Lanes::new([0.0, 1.0, 1.0, 1.0]), one);
        (a[1][0], a[1][1]) = (one, Lanes::new([0.0, 2.0, 0.0, 2.0]));
        let mut b = [zero; ROWS];
        (b[0], b[1]) = (Lanes::splat(2.0), Lanes::splat(3.0));
        let x = LaneFactors::new(a, 2).solve(b);
        assert_eq!(x[0].to_array(), [3.0, 1.0, 3.0, 1.0]);
        assert_eq!(x[1].to_array(), [2.0, 1.0, -1.0, 1.0]);
    }
}
