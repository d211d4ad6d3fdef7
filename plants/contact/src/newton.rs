//! Semismooth Newton method for a complementarity problem: bound states of the unknowns determine a
//! linear system, whose solution determines the next bound states (a primal-dual active-set
//! iteration).

use crate::bound::{Bound, BoundState};
use crate::dense::{affine, padded};
use crate::problem::{Problem, norm};

impl Problem {
    /// Iterates from the present bound states until the residual is within the tolerance or the
    /// steps run out. Returns the residual.
    pub(crate) fn newton(&mut self, factorisations: &mut u32, tolerance: f64) -> f64 {
        const STEPS: usize = 12;
        let mut residual = f64::INFINITY;
        for _ in 0..STEPS {
            *factorisations += 1;
            self.assemble();
            self.factored = self.factors.factor().is_ok();
            if !self.factored {
                return f64::INFINITY;
            }
            self.solve_active_set();
            residual = self.update_bound_states();
            if residual <= tolerance {
                return residual;
            }
        }
        self.factored = false;
        residual
    }

    /// Projects every unknown: the greatest distance from its projection is the residual, in units
    /// of `w`, which is returned; the position of the projection is the next bound state.
    pub(crate) fn update_bound_states(&mut self) -> f64 {
        let mut largest = 0.0_f64;
        self.w.resize(self.offset.len(), 0.0);
        affine(&self.matrix, &self.unknowns, &self.offset, &mut self.w);
        let mut next = std::mem::take(&mut self.next_bound_states);
        next.clear();
        for (row, (&z, &step)) in self.unknowns.iter().zip(&self.steps).enumerate() {
            let target = z - step * self.w[row];
            let (state, error) = match self.bounds[row] {
                Bound::NonNegative if target > 0.0 => (BoundState::Inside, target - z),
                Bound::NonNegative => (BoundState::Low, z),
                Bound::Between { low, .. } if target <= low => (BoundState::Low, low - z),
                Bound::Between { high, .. } if target >= high => (BoundState::High, high - z),
                Bound::Free | Bound::Between { .. } => (BoundState::Inside, target - z),
                Bound::Disc { normal, friction } => {
                    let other = self.unknowns[row + 1];
                    let t = [target, other - step * self.w[row + 1]];
                    let (radius, length) = (friction * self.unknowns[normal].max(0.0), norm(t));
                    if length > radius {
                        let (direction, share) = ([t[0] / length, t[1] / length], radius / length);
                        let error =
                            norm([radius * direction[0] - z, radius * direction[1] - other]);
                        (BoundState::Slipping { direction, share }, error)
                    } else {
                        (BoundState::Inside, norm([t[0] - z, t[1] - other]))
                    }
                }
                Bound::DiscSecond => (next[row - 1], 0.0),
            };
            let error = if step > 0.0 {
                error.abs() / step
            } else {
                self.immobile_violation(row)
            };
            largest = if error.is_nan() {
                f64::INFINITY
            } else {
                largest.max(error)
            };
            next.push(state);
        }
        self.next_bound_states = next;
        largest
    }

    /// Assembles the linear system of the unknowns that are not at a bound, for the bound states
    /// found last.
    fn assemble(&mut self) {
        std::mem::swap(&mut self.bound_states, &mut self.next_bound_states);
        let n = self.len();
        self.free.clear();
        self.free.extend(
            (0..n).filter(|&row| {
                !matches!(self.bound_states[row], BoundState::Low | BoundState::High)
            }),
        );
        let (m, stride) = (self.free.len(), padded(self.free.len()));
        let reduced = self.factors.matrix(m);
        if m == n {
            reduced.copy_from_slice(&self.matrix);
        } else {
            for (entries, &row) in reduced.chunks_exact_mut(stride.max(1)).zip(&self.free) {
                let full = &self.matrix[row * padded(n)..(row + 1) * padded(n)];
                for (entry, &column) in entries.iter_mut().zip(&self.free) {
                    *entry = full[column];
                }
            }
        }
        for i in 0..m {
            let row = self.free[i];
            if let (Bound::Disc { normal, friction }, BoundState::Slipping { direction, share }) =
                (self.bounds[row], self.bound_states[row])
            {
                let column = self.free.iter().position(|&other| other == normal);
                transform_to_slipping(
                    reduced,
                    stride,
                    i,
                    self.steps[row] * share,
                    share,
                    direction,
                );
                if let Some(column) = column {
                    reduced[i * stride + column] -= friction * direction[0];
                    reduced[(i + 1) * stride + column] -= friction * direction[1];
                }
            }
        }
    }

    /// Solves the factored system for the present offsets.
    pub(crate) fn solve_active_set(&mut self) {
        let n = self.len();
        let mut nonzero_bounds = false;
        for row in 0..n {
            self.unknowns[row] = match (self.bounds[row], self.bound_states[row]) {
                (Bound::Between { low, .. }, BoundState::Low) => low,
                (Bound::Between { high, .. }, BoundState::High) => high,
                (_, BoundState::Low | BoundState::High) => 0.0,
                _ => continue,
            };
            nonzero_bounds |= self.unknowns[row] != 0.0;
        }
        self.right.clear();
        for &row in &self.free {
            let mut known = self.offset[row];
            if nonzero_bounds {
                for column in 0..n {
                    if matches!(
                        self.bound_states[column],
                        BoundState::Low | BoundState::High
                    ) {
                        known += self.matrix[row * padded(n) + column] * self.unknowns[column];
                    }
                }
            }
            self.right.push(-known);
        }
        for (i, &row) in self.free.iter().enumerate() {
            if let (
                Bound::Disc { normal, friction },
                BoundState::Slipping {
                    direction: s,
                    share,
                },
            ) = (self.bounds[row], self.bound_states[row])
            {
                let weight = self.steps[row] * share;
                let across = -s[1] * self.right[i] + s[0] * self.right[i + 1];
                self.right[i] = -weight * s[1] * across;
                self.right[i + 1] = weight * s[0] * across;
                // A normal force at its bound is not among the columns.
                if nonzero_bounds
                    && matches!(
                        self.bound_states[normal],
                        BoundState::Low | BoundState::High
                    )
                {
                    let radius = friction * self.unknowns[normal].max(0.0);
                    self.right[i] += radius * s[0];
                    self.right[i + 1] += radius * s[1];
                }
            }
        }
        self.right.resize(self.factors.stride(), 0.0);
        self.factors.solve(&mut self.right);
        for (&row, &value) in self.free.iter().zip(&self.right) {
            self.unknowns[row] = value;
        }
    }
}

/// Transforms two rows of a friction force inside its disc to those of one on the border: with t =
/// z − ρw, s = t/|t| and P = I − s sᵀ, the derivative of z = µ zₙ t/|t| gives (I − βP) z + βρ P (G
/// z + b) − µ s zₙ = 0, β = µ zₙ/|t|. The caller adds the last term.
fn transform_to_slipping(
    matrix: &mut [f64],
    stride: usize,
    i: usize,
    weight: f64,
    share: f64,
    s: [f64; 2],
) {
    let (first, second) = matrix[i * stride..(i + 2) * stride].split_at_mut(stride);
    for (a, b) in first.iter_mut().zip(second.iter_mut()) {
        let across = weight * (-s[1] * *a + s[0] * *b);
        (*a, *b) = (-s[1] * across, s[0] * across);
    }
    first[i] += 1.0 - share * s[1] * s[1];
    first[i + 1] += share * s[0] * s[1];
    second[i] += share * s[0] * s[1];
    second[i + 1] += 1.0 - share * s[0] * s[0];
}
