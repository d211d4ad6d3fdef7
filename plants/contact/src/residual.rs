//! Natural residual of the present unknowns, computed from the problem data alone.

use crate::bound::Bound;
use crate::problem::{Problem, norm};

impl Problem {
    /// Returns the greatest violation of the conditions by [`Self::unknowns`], in units of `w`: the
    /// natural residual |z − Π(z − ρw)|/ρ, with the projection Π onto the admissible set and ρ the
    /// inverse of the row's diagonal entry of G (the larger of the two of a disc; the largest of
    /// all where the row's is zero). It is zero at solutions only, depends on G, b, bounds and
    /// unknowns alone, whatever the method of solution, and is infinite for NaN.
    pub fn residual(&self) -> f64 {
        let mut largest = 0.0_f64;
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
            largest = largest.max(violation);
        }
        largest
    }

    /// Returns the natural residual of one row or disc, whose mobility may be zero.
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
        // `max` and `min` above discard NaN.
        if target.is_nan() {
            f64::NAN
        } else {
            off.abs() * mobility
        }
    }

    /// Returns the violation of a row of zero mobility.
    #[cold]
    #[inline(never)]
    pub(crate) fn immobile_violation(&self, row: usize) -> f64 {
        self.violation(row, 0.0)
    }

    /// Returns the largest diagonal entry of G, or one if none is positive.
    pub(crate) fn greatest_mobility(&self) -> f64 {
        let largest = (0..self.len()).fold(0.0_f64, |largest, i| largest.max(self.entry(i, i)));
        if largest > 0.0 { largest } else { 1.0 }
    }
}
