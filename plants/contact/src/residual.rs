//! How far the present unknowns are from a solution, by no more than the problem itself.

use crate::problem::{Bound, Problem, norm};

impl Problem {
    /// Greatest violation of the conditions by [`Self::unknowns`], in units of `w`: the natural residual
    /// |z − Π(z − ρw)|/ρ, with the projection Π onto what the bound allows and ρ the inverse of the row's own entry of G
    /// (the larger of the two of a disc; the largest of all where a row's own is zero). Zero at solutions only. It is
    /// found from G, b, bounds and unknowns alone, whatever solved them; infinite where anything is not a number.
    pub fn residual(&self) -> f64 {
        let mut most = 0.0_f64;
        for (row, &bound) in self.bounds.iter().enumerate() {
            let mobility = match bound {
                Bound::Disc { .. } => self.entry(row, row).max(self.entry(row + 1, row + 1)),
                Bound::DiscSecond => continue,
                _ => self.entry(row, row),
            };
            let violation = self.violation(row, mobility);
            if violation.is_nan() {
                return f64::INFINITY;
            }
            most = most.max(violation);
        }
        most
    }

    /// The natural residual of one row or disc, whose own mobility may be zero.
    fn violation(&self, row: usize, mobility: f64) -> f64 {
        let mobility = if mobility > 0.0 {
            mobility
        } else {
            self.greatest_mobility()
        };
        let z = self.unknowns[row];
        let target = z - self.w(row) / mobility;
        let off = match self.bounds[row] {
            Bound::Free => z - target,
            Bound::NonNegative => z - target.max(0.0),
            Bound::Between { low, high } => z - target.max(low).min(high),
            Bound::Disc { normal, friction } => {
                let other = self.unknowns[row + 1];
                let t = [target, other - self.w(row + 1) / mobility];
                let (radius, length) = (friction * self.unknowns[normal].max(0.0), norm(t));
                let shrink = if length > radius {
                    radius / length
                } else {
                    1.0
                };
                norm([z - shrink * t[0], other - shrink * t[1]])
            }
            Bound::DiscSecond => 0.0,
        };
        // `max` and `min` above let go of what is not a number.
        if target.is_nan() {
            f64::NAN
        } else {
            off.abs() * mobility
        }
    }

    /// The violation of a row that nothing moves.
    #[cold]
    #[inline(never)]
    pub(crate) fn violation_unmoved(&self, row: usize) -> f64 {
        self.violation(row, 0.0)
    }

    /// Largest entry of G's diagonal, or one where there is none.
    pub(crate) fn greatest_mobility(&self) -> f64 {
        let largest = (0..self.len()).fold(0.0_f64, |most, i| most.max(self.entry(i, i)));
        if largest > 0.0 { largest } else { 1.0 }
    }
}
