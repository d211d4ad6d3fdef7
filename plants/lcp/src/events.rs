//! What happens at an instant: impacts, and what holds afterwards.
//!
//! Both are complementarity problems over the constraints that are closed at that instant ([`twinrig_contact::Problem`]):
//!
//! ```text
//! impulses   q̇⁺ = q̇⁻ + H⁻¹ Jᵀ P    0 ≤ Pₙ ⊥ ġ⁺ + e ġ⁻ ≥ 0    |Pₜ| ≤ µ Pₙ
//! forces     q̈  = a + H⁻¹ Jᵀ λ     0 ≤ λₙ ⊥ g̈ ≥ 0             |λₜ| ≤ µ λₙ
//! ```

mod closed;
pub(crate) mod constrained;
mod impact;
mod losses;
mod reactivate;
mod resolve_modes;

pub(crate) use closed::{Entry, Feet, PLACES, Role, STOPPED, Stop};
use impact::Struck;
pub(crate) use impact::Toll;
pub(crate) use reactivate::Passed;
pub(crate) use resolve_modes::Settled;

use twinrig_contact::{Bound, Method, Problem, Solution, Unsolved};

use crate::articulated::{Articulated, Response, between_links};
use crate::constraints::{ConstraintSet, Driven};
use crate::mode::Mode;
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::state::State;

/// Compliance of every constraint, as a share of its mobility, by which those that say the same thing share their force: far
/// below that of contacts, for a motion's stops have none.
const ALIKE: f64 = 1e-12;

/// Directions that are worked on side by side.
const ABREAST: usize = 4;

/// The memory of impacts and changes of mode.
#[derive(Debug, Clone, Default)]
pub(crate) struct Instant<const N: usize> {
    pub(crate) entries: Vec<Entry<N>>,
    rows: Vec<Response<f64, N>>,
    pub(crate) pushes: Vec<Response<f64, N>>,
    pub(crate) problem: Problem,
    /// The pushes' responses of the trunk, some side by side, component by component.
    trunks: Vec<[[f64; ABREAST]; 6]>,
    before: Vec<f64>,
    /// The impact after which contact modes are resolved next, if there was one.
    struck: Option<Struck>,
    coefficients: Vec<f64>,
    /// Feet that slide and jam, by leg and point of the leg; the same by row.
    jammed: [[bool; 2]; 4],
    marks: Vec<bool>,
    pub(crate) iterations: u64,
    pub(crate) factorisations: u64,
}

impl<const N: usize> Instant<N> {
    /// Fills the problem's matrix and bounds.
    pub(crate) fn prepare(&mut self, articulated: &Articulated<Lanes, N>, friction: f64) {
        let n = self.entries.len();
        self.problem.reset(n);
        self.rows.clear();
        self.pushes.clear();
        for entry in &self.entries {
            let row = articulated.response(&entry.row);
            self.rows.push(row);
            self.pushes.push(match entry.role {
                Role::Normal {
                    slides: Some(_), ..
                } => articulated.response(&entry.push),
                _ => row,
            });
        }
        self.trunks.clear();
        for pushes in self.pushes.chunks(ABREAST) {
            self.trunks.push(std::array::from_fn(|k| {
                std::array::from_fn(|j| pushes.get(j).map_or(0.0, |push| push.trunk[k]))
            }));
        }
        for (i, (entry, row)) in self.entries.iter().zip(&self.rows).enumerate() {
            let mut sums = [0.0; ABREAST];
            for (j, (other, push)) in self.entries.iter().zip(&self.pushes).enumerate() {
                if j % ABREAST == 0 {
                    sums = by_trunk(&row.pull, &self.trunks[j / ABREAST]);
                }
                let by_trunk = sums[j % ABREAST];
                let mut mobility = between_links(by_trunk, &entry.row, &other.push, push);
                if i == j && mobility > 0.0 {
                    mobility = mobility * (1.0 + ALIKE) + entry.compliance;
                }
                self.problem.set(i, j, mobility);
            }
            match entry.role {
                Role::Stop(_) | Role::Normal { .. } => self.problem.bound(i, Bound::NonNegative),
                Role::Tangent { which: 1, .. } => {
                    let normal = i - 1;
                    self.problem.bound(i, Bound::Disc { normal, friction });
                }
                Role::Tangent { .. } => {}
            }
        }
    }

    /// Solves the problem that was prepared. What neither the method nor pivoting solves is taken as it is where it violates
    /// no condition by more than `enough`, in units of w: two feet that hold and can only move as one have no solution where
    /// they are at odds about the last digits.
    pub(crate) fn solve(
        &mut self,
        enough: f64,
        method: Method,
        solve_by: impl Fn(&mut Problem, Method) -> Result<Solution, Unsolved>,
    ) -> Result<(), Unsolved> {
        let swept = matches!(method, Method::GaussSeidel { .. });
        let mut solved = solve_by(&mut self.problem, method);
        for last in [false, true] {
            match solved {
                Ok(solution) => {
                    self.count(&solution);
                    return Ok(());
                }
                Err(Unsolved::Violated {
                    sweeps, residual, ..
                }) => {
                    self.iterations += u64::from(sweeps);
                    // Sweeps that were cut short are taken for what they are.
                    if residual <= enough || swept && residual.is_finite() {
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

    pub(crate) fn count(&mut self, solution: &Solution) {
        self.iterations += u64::from(solution.sweeps + solution.pivots);
        self.factorisations += u64::from(solution.factorisations);
    }
}

/// What forces along some directions move along a row by way of the trunk: Σₖ pull[k] · trunks[k], for the directions side by
/// side.
#[inline(always)]
fn by_trunk(pull: &[f64; 6], trunks: &[[f64; ABREAST]; 6]) -> [f64; ABREAST] {
    let mut sums = [0.0; ABREAST];
    for (pull, trunk) in pull.iter().zip(trunks) {
        for (sum, trunk) in sums.iter_mut().zip(trunk) {
            *sum += pull * trunk;
        }
    }
    sums
}

impl<const N: usize> Scene<'_, Lanes, N> {
    fn articulated(
        &self,
        state: &State<Lanes, N>,
        mode: &Mode,
        drive: &Driven<Lanes>,
    ) -> Articulated<Lanes, N> {
        let constraint_set = ConstraintSet {
            active: &mode.active,
            drive,
            recovery: Lanes::zero(),
            ahead: 0.0,
            any: mode.any,
        };
        Articulated::new(self.model, self.legs, state, &constraint_set)
    }
}
