//! Passive legs against trajectories of the reference.
//!
//! Bounds are what was measured, and half as much again: they are there to be noticed when something gets worse.

use twinrig_mujoco::{Coordinates, Integrator, Numerics, Options};

use crate::golden::{Deviation, far};

fn run(name: &str, coordinates: Coordinates, integrator: Integrator, step_us: u64) -> Deviation {
    let with = |setup| {
        let mut options = Options::new(setup, coordinates);
        options.numerics.integrator = integrator;
        options
    };
    far(name, with, step_us)
}

const EVERY: [Integrator; 3] = [Integrator::Rk4, Integrator::Euler, Integrator::ImplicitFast];

#[test]
fn between_its_stops_a_leg_of_hinges_moves_as_the_reference_does() {
    let rk4 = |us| run("between", Coordinates::Minimal, Integrator::Rk4, us);
    let (coarse, fine, finest) = (rk4(1000), rk4(500), rk4(100));
    assert!(coarse.rms < 1e-6, "{coarse:?}");
    // Of fourth order: sixteen times less at half the step.
    assert!(coarse.rms > 12.0 * fine.rms, "{coarse:?} {fine:?}");
    assert!(finest.rms < 1e-9, "{finest:?}");
    // Nothing was touched, so nothing was lost, and the books show the integrator's error alone.
    assert!(
        finest.lost[0] == 0.0 && finest.residual < 1e-9,
        "{finest:?}"
    );
}

#[test]
fn between_its_stops_a_leg_that_pins_hold_together_moves_as_the_reference_does() {
    for (us, rms, drift) in [(2000, 3e-4, 6e-5), (1000, 1e-4, 2e-5), (100, 7e-6, 2e-7)] {
        let far = run("between", Coordinates::Maximal, Integrator::Euler, us);
        assert!(far.rms < rms && far.drift < drift, "{us}: {far:?}");
    }
    let far = run("between", Coordinates::Maximal, Integrator::Rk4, 100);
    // What is left is that pins give way by a thousandth.
    assert!(far.rms < 2.5e-7, "{far:?}");
}

#[test]
fn legs_that_rest_on_their_stops_are_half_a_millimetre_off_at_most() {
    for coordinates in Coordinates::ALL {
        for integrator in [Integrator::Rk4, Integrator::Euler] {
            let coarse = run("passive", coordinates, integrator, 2000);
            let fine = run("passive", coordinates, integrator, 100);
            assert!(
                coarse.rms < 5e-4,
                "{coordinates:?} {integrator:?} {coarse:?}"
            );
            assert!(fine.rms < 1.2e-5, "{coordinates:?} {integrator:?} {fine:?}");
            assert!(fine.drift < 3e-5, "{coordinates:?} {integrator:?} {fine:?}");
        }
    }
}

#[test]
fn hard_hits_are_off_by_what_a_step_of_first_order_makes_of_them() {
    for name in ["hard-hit", "loose"] {
        for coordinates in Coordinates::ALL {
            for integrator in EVERY {
                let far = run(name, coordinates, integrator, 100);
                assert!(
                    far.rms < 5e-4,
                    "{name} {coordinates:?} {integrator:?} {far:?}"
                );
            }
        }
    }
}

#[test]
fn impacts_lose_what_those_of_the_reference_do() {
    for name in ["passive", "hard-hit", "loose", "hard-light"] {
        for coordinates in Coordinates::ALL {
            // Stages of the method of fourth order see a stop at other instants than its step does.
            let far = run(name, coordinates, Integrator::Euler, 100);
            let [found, expected] = far.lost;
            assert!(
                (found - expected).abs() < 0.03 * expected,
                "{name} {coordinates:?} {far:?}"
            );
            assert!(far.residual < 1e-2, "{name} {coordinates:?} {far:?}");
        }
    }
}

#[test]
fn constraints_as_soft_as_mujoco_has_them_leave_an_error_that_no_step_mends() {
    let soft = |step_us| {
        let with = |setup| {
            let mut options = Options::new(setup, Coordinates::Maximal);
            options.numerics = Numerics::of(Coordinates::Maximal).with_soft_constraints();
            options
        };
        far("passive", with, step_us)
    };
    for us in [2000, 100] {
        let far = soft(us);
        assert!(far.rms > 2e-3 && far.rms < 2e-2, "{us}: {far:?}");
    }
}

#[test]
fn light_legs_that_hit_hard_do_not_run_away_at_the_step_of_scenarios() {
    for (coordinates, integrator) in [
        (Coordinates::Maximal, Integrator::Euler),
        (Coordinates::Maximal, Integrator::ImplicitFast),
        (Coordinates::Minimal, Integrator::Rk4),
    ] {
        let far = run("hard-light", coordinates, integrator, 1000);
        assert!(far.rms < 7e-3, "{coordinates:?} {integrator:?} {far:?}");
    }
}
