//! Monitor of every method: detects energy gain, which indicates an unstable step, and feet that
//! sink into the ground.
//!
//! The stored energy never exceeds the initial energy plus the work of motors and pushes:
//! d(stored − actuator − external) ≤ 0, since friction and impacts only dissipate. The error of a
//! step violates this occasionally by a little, with either sign; a step beyond its limit of
//! stability violates it repeatedly. Therefore gains are accumulated, losses are subtracted, and a
//! sum above the limit ends the run:
//!
//! ```text
//! gained ← max(0, gained + Δ(stored − actuator − external)) ≤ share · reference
//! reference = kinetic + spring energy − gained + weight · leg length
//! ```
//!
//! Friction masks a gain that is smaller than its dissipation. The energy balance does not: its
//! residual, relative to the exchanged energy, is the error of the motion as a whole.

use twinrig_legged::Ledger;

use crate::integrators::impulse_sums::ImpulseSums;
use crate::integrators::run_state::{Checkpoint, RunState};
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::options::Method;

/// Maximum gain as a share of the reference energy: three times the gain of any method at the steps
/// it is suited for.
const GAIN_MAX: f64 = 0.05;

/// The thesis' scheme gains energy at every stop, visible in the energy balance; only divergence
/// ends the run.
const GAIN_MAX_THESIS: f64 = 100.0;

/// Maximum positive residual of the energy balance as a share of the exchanged energy, and, as a
/// share of the reference energy, the residual below which there is no error.
const SURPLUS_MAX: f64 = 0.1;
const SURPLUS_FLOOR: f64 = 0.02;

/// The same for a negative residual: numerical losses are tolerated until they exceed the reference
/// energy many times.
const DEFICIT_MAX: f64 = 0.3;
const DEFICIT_FLOOR: f64 = 10.0;

/// Gain in one step above which the step is too long, as a share of the reference energy.
const STEP_GAIN_MAX: f64 = 0.01;

/// Depth of a foot in the ground above which the method is in error \[m\], and minimum rate of
/// sinking \[m/s\]. A method without event location lets a fast landing foot penetrate by half of
/// its travel in a step.
const DEPTH_MAX: f64 = 1e-3;
/// The same for the methods for comparison, which do not correct the drift of active contacts.
const DEPTH_MAX_DRIFTING: f64 = 2e-2;
const SINK_RATE: f64 = 1e-3;
const LANDING_SPEED: f64 = 10.0;

/// Accumulated energy gain.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EnergyMonitor {
    /// \[J\]
    pub(super) gained: f64,
}

impl EnergyMonitor {
    /// Checks the energy and the feet after a step that started from `before`, by a method with
    /// this maximum error of a step \[m\].
    pub(super) fn check<const N: usize>(
        &mut self,
        model: &Model<N>,
        run: &RunState<N>,
        (method, tolerance): (Method, f64),
        before: &Checkpoint<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        check_penetration(model, run, method, &before.impulse_sums, seconds)?;
        let before = &before.ledger;
        let gain = gain([before, &run.ledger]);
        if !gain.is_finite() {
            return Err(StepError::NotFinite);
        }
        let reference = self.reference_energy(model, before);
        self.gained = (self.gained + gain).max(0.0);
        let balance = run.ledger.balance();
        let thesis = method == Method::Thesis;
        let gain_max = if thesis { GAIN_MAX_THESIS } else { GAIN_MAX };
        let floor = SURPLUS_FLOOR * reference;
        let surplus = !thesis && balance.residual > floor.max(SURPLUS_MAX * balance.exchanged);
        if self.gained > gain_max * reference || surplus {
            let gained = self.gained.max(balance.residual);
            return Err(StepError::EnergyGain { seconds, gained });
        }
        if !thesis
            && -balance.residual > (DEFICIT_FLOOR * reference).max(DEFICIT_MAX * balance.exchanged)
        {
            let lost = -balance.residual;
            return Err(StepError::EnergyLoss { seconds, lost });
        }
        let checked = match method {
            // A sticking foot on curved ground moves within the tolerance, under its weight.
            Method::Rk4 | Method::Rodas4 if tolerance.is_finite() => {
                let weight = model.moving_energy / model.reach;
                run.ledger.check_within([tolerance * weight, 0.0])
            }
            Method::Rk4 | Method::Rodas4 | Method::Moreau => run.ledger.check(),
            // The constraint forces of fixed steps change velocities as impacts do, with an error
            // of the order of that of the balance.
            Method::SemiImplicit | Method::ExplicitEuler | Method::Thesis => {
                let allowed = floor.max(balance.residual.abs());
                run.ledger.check_within([0.0, allowed])
            }
        };
        checked.map_err(|why| StepError::Dissipation { seconds, why })
    }

    /// Returns whether the energy between two balances grew beyond [`STEP_GAIN_MAX`]: the step was
    /// too long.
    pub(super) fn gained_too_much<const N: usize>(
        self,
        model: &Model<N>,
        [before, after]: [&Ledger; 2],
    ) -> bool {
        let gain = gain([before, after]);
        gain.is_nan() || gain > STEP_GAIN_MAX * self.reference_energy(model, before)
    }

    /// Returns whether a step gained or lost more energy than motors, friction and impacts account
    /// for: forces that create energy are no solution, even if they satisfy their constraints.
    pub(super) fn is_unbalanced<const N: usize>(
        self,
        model: &Model<N>,
        [before, after]: [&Ledger; 2],
    ) -> bool {
        let [was, is] = [before, after].map(|ledger| ledger.balance().residual);
        let missing = (is - was).abs();
        missing.is_nan() || missing > STEP_GAIN_MAX * self.reference_energy(model, before)
    }

    /// Returns the reference energy: energy without numerical gain, plus the energy that lifts all
    /// moving masses by the leg length \[J\].
    fn reference_energy<const N: usize>(self, model: &Model<N>, before: &Ledger) -> f64 {
        let balance = before.balance();
        (balance.kinetic + balance.spring - self.gained).max(0.0) + model.moving_energy
    }
}

/// Returns the growth of stored energy minus the work of motors and pushes between two balances
/// \[J\].
fn gain(ledgers: [&Ledger; 2]) -> f64 {
    let [before, after] = ledgers.map(Ledger::balance);
    let change = (after.stored() - after.actuator) - (before.stored() - before.actuator);
    change - (after.external - before.external)
}

/// Checks that no foot sinks that received no ground impulse since `before`.
fn check_penetration<const N: usize>(
    model: &Model<N>,
    run: &RunState<N>,
    method: Method,
    before: &ImpulseSums,
    seconds: f64,
) -> Result<(), StepError> {
    let least = match method {
        Method::Rk4 | Method::Rodas4 | Method::Moreau => DEPTH_MAX,
        Method::SemiImplicit | Method::ExplicitEuler | Method::Thesis => DEPTH_MAX_DRIFTING,
    };
    let legs = 0..model.legs.len();
    let points = legs.flat_map(|leg| (3..=N).map(move |links| (leg, links)));
    for (leg, links) in points {
        let Some(footing) = run.footing(model, leg, links) else {
            return Ok(());
        };
        let depth = -footing.gap;
        let pushed = run.impulse_sums.ground[leg] != before.ground[leg];
        if !pushed && depth > least + LANDING_SPEED * seconds && footing.velocity[0] < -SINK_RATE {
            return Err(StepError::FootSinks { leg, depth });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use twinrig_contact::{Ground, Terrain};
    use twinrig_legged::{Base, Drives};

    use super::*;
    use crate::fixtures::{self, flow};

    #[test]
    fn sinking_foot_without_ground_impulse_is_detected() {
        let ground = Ground::new(Terrain::Flat, 0.6, 0.0).unwrap();
        let start = ([0.0, -45.0, 45.0], [0.0; 3]);
        let robot = fixtures::robot();
        let mut flow = flow::<3>(&robot, Base::Free, start, Drives::None, Some(ground));
        let gap = flow.run.footing(&flow.model, 0, 3).unwrap().gap;
        flow.run.state.position[2] -= gap + DEPTH_MAX + 2e-3 * LANDING_SPEED + 1e-4;
        let before = flow.run.impulse_sums;
        let mut at = |rate: f64, higher: f64, load: f64| {
            flow.run.state.velocity[2] = rate;
            flow.run.state.position[2] += higher;
            flow.run.impulse_sums = before;
            (0..4).for_each(|leg| flow.run.impulse_sums.ground[leg][2] += load);
            check_penetration(&flow.model, &flow.run, flow.method, &before, 2e-3)
        };
        assert_eq!(at(0.0, 0.0, 0.0), Ok(()));
        assert_eq!(at(0.1, 0.0, 0.0), Ok(()));
        let found = at(-0.1, 0.0, 0.0).unwrap_err();
        assert!(
            matches!(found, StepError::FootSinks { leg: 0, .. }),
            "{found:?}"
        );
        assert_eq!(at(-0.1, 0.0, 1e-3), Ok(()));
        assert_eq!(at(-0.1, 2e-4, 0.0), Ok(()));
    }

    #[test]
    fn impacts_that_generate_energy_in_total_are_a_fault() {
        let robot = fixtures::robot();
        let start = ([0.0, -45.0, 45.0], [0.0; 3]);
        let mut flow = flow::<3>(&robot, Base::Free, start, Drives::None, None);
        for method in [Method::Rk4, Method::Moreau, Method::SemiImplicit] {
            flow.method = method;
            assert_eq!(flow.step(1e-3), Ok(()), "{method:?}");
            // The balance closes: friction takes the energy that impacts give.
            let ledger = flow.run.ledger;
            flow.run.ledger.dissipated += 1.0 + ledger.impact;
            flow.run.ledger.impact = -1.0;
            let fault = flow.step(1e-3).unwrap_err();
            assert!(
                fault.to_string().contains("impacts have generated"),
                "{method:?}: {fault}"
            );
            flow.run.ledger = ledger;
        }
    }
}
