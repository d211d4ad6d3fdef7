//! Events: impacts, and the active constraints after them.
//!
//! Both are complementarity problems over the constraints closed at that instant
//! ([`twinrig_contact::Problem`]):
//!
//! ```text
//! impulses   q̇⁺ = q̇⁻ + H⁻¹ Jᵀ P    0 ≤ Pₙ ⊥ ġ⁺ + e ġ⁻ ≥ 0    |Pₜ| ≤ µ Pₙ
//! forces     q̈  = a + H⁻¹ Jᵀ λ     0 ≤ λₙ ⊥ g̈ ≥ 0             |λₜ| ≤ µ λₙ
//! ```

mod closed;
pub(crate) mod constrained;
mod entry;
mod impact;
mod impact_record;
mod losses;
mod reactivate;
mod resolve_modes;

pub(crate) use closed::STOPPED;
pub(crate) use entry::{Entry, Feet, Role, SLOTS, Stop};
pub(crate) use impact::ImpactTotals;
use impact_record::ImpactRecord;
pub(crate) use losses::{ImpactError, ImpactGivesEnergy};
pub(crate) use resolve_modes::ModeResolution;

use core::mem;

use twinrig_contact::{Bound, Method, Problem, Solution, SolveError};
use twinrig_legged::LEGS;
use twinrig_runtime::WorkCounts;

use crate::constraints::mode::Mode;
use crate::constraints::motion::Dynamics;
use crate::model::articulated::{Articulated, Response, cross_mobility_links};
use crate::model::elimination::ConstraintSet;
use crate::model::leg_constraints::DriveAction;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Compliance of every constraint as a share of its mobility, by which redundant constraints share
/// their force. It is far below that of contacts, as the stops are rigid during motion.
const REGULARISATION: f64 = 1e-12;

/// Directions computed side by side.
const BLOCK: usize = 4;

/// Workspace of impacts and mode changes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Instant<const N: usize> {
    pub(crate) entries: Vec<Entry<N>>,
    row_responses: Vec<Response<f64, N>>,
    pub(crate) force_responses: Vec<Response<f64, N>>,
    pub(crate) problem: Problem,
    /// Responses of the trunk to unit forces, in blocks, by component.
    trunks: Vec<[[f64; BLOCK]; 6]>,
    before: Vec<f64>,
    /// The impact before the next resolution of contact modes, if any.
    last_impact: Option<ImpactRecord>,
    coefficients: Vec<f64>,
    /// Sliding feet that jam, by leg and point of the leg; `marks` is the same by row.
    jammed: [[bool; 2]; 4],
    marks: Vec<bool>,
    /// Work since the last [`Instant::drain_counts`].
    iterations: u64,
    factorisations: u64,
}

impl<const N: usize> Instant<N> {
    /// Fills matrix and bounds of the problem, with the coefficient of friction at each leg.
    pub(crate) fn prepare(&mut self, articulated: &Articulated<Lanes, N>, friction: &[f64; LEGS]) {
        let n = self.entries.len();
        self.problem.reset(n);
        self.row_responses.clear();
        self.force_responses.clear();
        for entry in &self.entries {
            let row = articulated.response(&entry.row);
            self.row_responses.push(row);
            self.force_responses.push(match entry.role {
                Role::Normal {
                    slides: Some(_), ..
                } => articulated.response(&entry.force_row),
                _ => row,
            });
        }
        self.trunks.clear();
        for chunk in self.force_responses.chunks(BLOCK) {
            self.trunks.push(std::array::from_fn(|k| {
                std::array::from_fn(|j| chunk.get(j).map_or(0.0, |response| response.trunk[k]))
            }));
        }
        for (i, (entry, row)) in self.entries.iter().zip(&self.row_responses).enumerate() {
            let mut sums = [0.0; BLOCK];
            for (j, (other, response)) in self.entries.iter().zip(&self.force_responses).enumerate()
            {
                if j % BLOCK == 0 {
                    sums = by_trunk(&row.pull, &self.trunks[j / BLOCK]);
                }
                let by_trunk = sums[j % BLOCK];
                let mut mobility =
                    cross_mobility_links(by_trunk, &entry.row, &other.force_row, response);
                if i == j && mobility > 0.0 {
                    mobility = mobility * (1.0 + REGULARISATION) + entry.compliance;
                }
                self.problem.set(i, j, mobility);
            }
            match entry.role {
                Role::Stop(_) | Role::Normal { .. } => self.problem.bound(i, Bound::NonNegative),
                Role::Tangent { which: 1, .. } => {
                    let (normal, friction) = (i - 1, friction[entry.row.leg]);
                    self.problem.bound(i, Bound::Disc { normal, friction });
                }
                Role::Tangent { .. } => {}
            }
        }
    }

    /// Solves the prepared problem. An approximate result of both the method and pivoting is
    /// accepted if it violates no condition by more than `accepted`, in units of w: two sticking
    /// feet that can only move together have no exact solution if they differ by round-off.
    pub(crate) fn solve(
        &mut self,
        accepted: f64,
        method: Method,
        solve_by: impl Fn(&mut Problem, Method) -> Result<Solution, SolveError>,
    ) -> Result<(), SolveError> {
        let swept = matches!(method, Method::GaussSeidel { .. });
        let mut solved = solve_by(&mut self.problem, method);
        for last in [false, true] {
            match solved {
                Ok(solution) => {
                    self.count(&solution);
                    return Ok(());
                }
                Err(SolveError::Violated {
                    sweeps, residual, ..
                }) => {
                    self.iterations += u64::from(sweeps);
                    // Truncated sweeps are accepted as they are.
                    if residual <= accepted || swept && residual.is_finite() {
                        return Ok(());
                    }
                }
                Err(_) => {}
            }
            if !last {
                solved = solve_by(&mut self.problem, Method::Direct);
            }
        }
        solved.map(|_| ())
    }

    /// Starts an event: that an earlier one failed after its impact has no effect on this one.
    pub(crate) fn begin_event(&mut self) {
        self.last_impact = None;
    }

    /// Adds the iterations and factorisations since the last call to the counts of a run.
    pub(crate) fn drain_counts(&mut self, counts: &mut WorkCounts) {
        counts.solver_iterations += mem::take(&mut self.iterations);
        counts.factorisations += mem::take(&mut self.factorisations);
    }

    fn count(&mut self, solution: &Solution) {
        self.iterations += u64::from(solution.sweeps + solution.pivots);
        self.factorisations += u64::from(solution.factorisations);
    }
}

/// Returns the acceleration along a row by forces in a block of directions, through the trunk: Σₖ
/// pull\[k\] · trunks\[k\].
#[inline(always)]
fn by_trunk(pull: &[f64; 6], trunks: &[[f64; BLOCK]; 6]) -> [f64; BLOCK] {
    let mut sums = [0.0; BLOCK];
    for (pull, trunk) in pull.iter().zip(trunks) {
        for (sum, trunk) in sums.iter_mut().zip(trunk) {
            *sum += pull * trunk;
        }
    }
    sums
}

impl<const N: usize> Dynamics<'_, Lanes, N> {
    fn articulated(
        &self,
        state: &State<Lanes, N>,
        mode: &Mode,
        drive: &DriveAction<Lanes>,
    ) -> Articulated<Lanes, N> {
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive,
            recovery: Lanes::zero(),
            implicit_seconds: 0.0,
            any: mode.any,
        };
        let load = self.load.as_ref();
        Articulated::new(self.model, self.legs, state, &constraint_set, load)
    }
}
