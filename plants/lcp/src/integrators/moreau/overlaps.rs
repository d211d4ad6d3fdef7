//! Correction of overlaps by a shift of the positions, without velocities.
//!
//! ```text
//! δ = ½h M⁻¹ Jᵀ p        0 ≤ pₙ ⊥ Jₙ δ + γ g ≥ 0        |pₜ| ≤ µ pₙ
//! ```
//!
//! The loaded constraints press, and γ of each overlap is corrected in a step. As a velocity, the
//! correction would be kinetic energy, which no impulse may give. Hip motors keep still.

use super::drift::Rates;
use super::impulses::{ImpulseSolver, OVERLAP_MAX, RECOVERY};
use crate::constraints::events::Entry;
use crate::integrators::run_state::RunState;
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::articulated::Articulated;
use crate::model::leg_constraints::{DriveAction, HIP};
use crate::model::real::{Lanes, Real};
use crate::model::state::State;
use crate::model::trunk::Schur;

/// Overlap that is left \[m\]: a correction moves joints without a velocity, which measured rates
/// do not show.
const LEFT: f64 = 1e-8;

/// Maximum speed of a correction \[m/s\]: a foot that slides at 3 m/s over rough ground sinks as
/// fast.
const SPEED_MAX: f64 = 0.5;

/// Velocities in the second half of a step by which positions advance.
pub(super) struct Shifting<const N: usize> {
    pub(super) rates: Rates<N>,
    /// Additional rate of the pulleys \[rad/s\].
    pub(super) pulley: Lanes,
    /// Sum of the impulses on the robot, trunk axes \[N·s\].
    pub(super) push: [f64; 3],
}

impl<const N: usize> ImpulseSolver<N> {
    /// Returns the velocities that correct the overlaps of loaded constraints, added to those
    /// `after` the impulses; none without overlaps, or where no correction is found. `following` is
    /// the mask of the hips that follow their commands.
    pub(super) fn correct_overlaps(
        &mut self,
        model: &Model<N>,
        middle: &Articulated<Lanes, N>,
        (following, drive): (Lanes, &DriveAction<Lanes>),
        after: &State<Lanes, N>,
        seconds: f64,
    ) -> Option<Shifting<N>> {
        let half = 0.5 * seconds;
        self.corrected = 0.0;
        let Self { instant, shift, .. } = self;
        // Loaded and closed beyond contact.
        let gaps = instant.entries.iter().zip(instant.problem.unknowns());
        let gap = |(entry, impulse): (&Entry<N>, &f64)| {
            let start = entry.gap - half * entry.rate;
            let overlaps = !entry.role.is_tangent() && *impulse > 0.0 && start < -LEFT;
            if overlaps { start } else { 0.0 }
        };
        if !gaps.clone().any(|row| gap(row) < 0.0) {
            return None;
        }
        let mut held = *middle;
        held.hold_hips(model, following);
        shift.entries.clone_from(&instant.entries);
        shift.prepare(&held, &model.friction);
        for (row, (entry, impulse)) in gaps.enumerate() {
            let offset = if entry.role.is_tangent() {
                0.0
            } else if *impulse > 0.0 {
                (RECOVERY * gap((entry, impulse)) / half).max(-SPEED_MAX)
            } else {
                // A constraint without load presses only where it would close faster.
                SPEED_MAX
            };
            shift.problem.offset(row, offset);
        }
        shift.problem.solve().ok()?;
        let (trunk, torques) = shift.responses();
        let mut moved = *after;
        moved.velocity = [0.0; 3];
        held.change_velocities(&mut moved, trunk, torques);
        self.corrected = -half * power(middle, [after, &moved]);
        let tension = shift.tension(1.0);
        let pulley = -drive.pulley_mobility * model.side_by_side.pulley_radius * tension;
        let [x, y, z, ..] = shift.wrench();
        Some(Shifting {
            rates: Rates {
                links: moved.rates,
                turning: moved.turning,
            },
            pulley,
            push: [x, y, z],
        })
    }
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Makes the hip motors rigid joints: their torque is that of the rate which they have without
    /// the correction.
    fn hold_hips(&mut self, model: &Model<N>, following: Lanes) {
        if model.drives.is_none() {
            return;
        }
        let (zero, one) = (Lanes::zero(), Lanes::splat(1.0));
        let mut gradient = [zero; N];
        gradient[0] = one;
        let others = one - following;
        self.mobility.eliminate(HIP, &gradient, zero, zero, others);
        if let Some(base) = &mut self.base {
            let (trunk, coupling) = (&base.trunk, &base.coupling);
            base.schur = Schur::with(&model.trunk, trunk, coupling, &self.mobility, trunk.force);
        }
    }
}

/// Returns the power of all forces but those of constraints along a correction: at
/// constant momenta, the energy decreases by their work.
fn power<const N: usize>(
    middle: &Articulated<Lanes, N>,
    [after, moved]: [&State<Lanes, N>; 2],
) -> f64 {
    let mut power = 0.0;
    for i in 0..N {
        power += (middle.torques[i] * (moved.rates[i] - after.rates[i])).sum();
    }
    if let Some(base) = &middle.base {
        let force = &base.trunk.force;
        for i in 0..3 {
            power += force[i] * moved.velocity[i];
            power += force[3 + i] * (moved.turning[i] - after.turning[i]);
        }
    }
    power
}

/// Returns an error for a step in which a foot sinks by more than [`OVERLAP_MAX`]: where it slides
/// over an edge of the ground, only the end of the step shows it.
pub(super) fn check_feet<const N: usize>(
    model: &Model<N>,
    [before, after]: [&State<Lanes, N>; 2],
    seconds: f64,
) -> Result<(), StepError> {
    let gap = |state, leg, links| {
        let footing = RunState::footing_of(state, model, leg, links);
        footing.map_or(0.0, |footing| footing.gap)
    };
    let legs = 0..model.legs.len();
    for (leg, links) in legs.flat_map(|leg| (3..=N).map(move |links| (leg, links))) {
        let depth = -gap(after, leg, links);
        if depth > OVERLAP_MAX && gap(before, leg, links).min(0.0) + depth > OVERLAP_MAX {
            return Err(StepError::Overlap {
                leg,
                depth,
                seconds,
            });
        }
    }
    Ok(())
}
