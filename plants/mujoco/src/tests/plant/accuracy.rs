//! Passive legs against trajectories of the reference.
//!
//! Bounds are measured values times 1.5, to detect a loss of accuracy.

use twinrig_legged::Setup;
use twinrig_mujoco::{Coordinates, Integrator, Numerics, Options};

use twinrig_testing::reference_trajectory::{Deviation, ReferenceTrajectory};

use super::fixture::with_options;

fn deviation(name: &str, with: impl Fn(Setup) -> Options, step_us: u64) -> Deviation {
    let reference = ReferenceTrajectory::read(name);
    let mut fixture = with_options(&reference.robot(), &with(reference.setup(step_us)));
    reference.follow(&mut fixture).unwrap()
}

fn run(name: &str, coordinates: Coordinates, integrator: Integrator, step_us: u64) -> Deviation {
    let with = |setup| {
        let mut options = Options::new(setup, coordinates);
        options.numerics.integrator = integrator;
        options
    };
    deviation(name, with, step_us)
}

const INTEGRATORS: [Integrator; 3] = [Integrator::Rk4, Integrator::Euler, Integrator::ImplicitFast];

#[test]
fn minimal_coordinates_agree_with_the_reference_between_stops() {
    let rk4 = |us| run("between", Coordinates::Minimal, Integrator::Rk4, us);
    let (coarse, fine, finest) = (rk4(1000), rk4(500), rk4(100));
    assert!(coarse.rms < 1e-6, "{coarse:?}");
    // Fourth order: one sixteenth of the error at half the step.
    assert!(coarse.rms > 12.0 * fine.rms, "{coarse:?} {fine:?}");
    assert!(finest.rms < 1e-9, "{finest:?}");
    // Without contact no energy is lost, and the residual is the integrator's error alone.
    assert!(
        finest.lost[0] == 0.0 && finest.residual < 1e-9,
        "{finest:?}"
    );
}

#[test]
fn maximal_coordinates_agree_with_the_reference_between_stops() {
    for (us, rms, violation) in [(2000, 3e-4, 6e-5), (1000, 1e-4, 2e-5), (100, 7e-6, 2e-7)] {
        let deviation = run("between", Coordinates::Maximal, Integrator::Euler, us);
        assert!(
            deviation.rms < rms && deviation.violation < violation,
            "{us}: {deviation:?}"
        );
    }
    let deviation = run("between", Coordinates::Maximal, Integrator::Rk4, 100);
    // The remaining error is the softness of the pins, a thousandth.
    assert!(deviation.rms < 2.5e-7, "{deviation:?}");
}

#[test]
fn legs_at_rest_on_stops_have_half_a_millimetre_of_error_at_most() {
    for coordinates in Coordinates::ALL {
        for integrator in [Integrator::Rk4, Integrator::Euler] {
            let coarse = run("passive", coordinates, integrator, 2000);
            let fine = run("passive", coordinates, integrator, 100);
            assert!(
                coarse.rms < 5e-4,
                "{coordinates:?} {integrator:?} {coarse:?}"
            );
            assert!(fine.rms < 1.2e-5, "{coordinates:?} {integrator:?} {fine:?}");
            assert!(
                fine.violation < 3e-5,
                "{coordinates:?} {integrator:?} {fine:?}"
            );
        }
    }
}

#[test]
fn hard_impacts_have_small_errors_at_a_small_step() {
    for name in ["hard-hit", "loose"] {
        for coordinates in Coordinates::ALL {
            for integrator in INTEGRATORS {
                let deviation = run(name, coordinates, integrator, 100);
                assert!(
                    deviation.rms < 5e-4,
                    "{name} {coordinates:?} {integrator:?} {deviation:?}"
                );
            }
        }
    }
}

#[test]
fn energy_lost_in_impacts_agrees_with_the_reference() {
    for name in ["passive", "hard-hit", "loose", "hard-light"] {
        for coordinates in Coordinates::ALL {
            // Stages of the fourth-order method detect a stop at other instants than the step does.
            let deviation = run(name, coordinates, Integrator::Euler, 100);
            let [found, expected] = deviation.lost;
            assert!(
                (found - expected).abs() < 0.03 * expected,
                "{name} {coordinates:?} {deviation:?}"
            );
            assert!(
                deviation.residual < 1e-2,
                "{name} {coordinates:?} {deviation:?}"
            );
        }
    }
}

#[test]
fn error_of_default_softness_does_not_converge_with_the_step() {
    let soft = |step_us| {
        let with = |setup| {
            let mut options = Options::new(setup, Coordinates::Maximal);
            options.numerics = Numerics::of(Coordinates::Maximal).with_soft_constraints();
            options
        };
        deviation("passive", with, step_us)
    };
    for us in [2000, 100] {
        let deviation = soft(us);
        assert!(
            deviation.rms > 2e-3 && deviation.rms < 2e-2,
            "{us}: {deviation:?}"
        );
    }
}

#[test]
fn light_legs_that_hit_hard_are_stable_at_the_default_step() {
    for (coordinates, integrator) in [
        (Coordinates::Maximal, Integrator::Euler),
        (Coordinates::Maximal, Integrator::ImplicitFast),
        (Coordinates::Minimal, Integrator::Rk4),
    ] {
        let deviation = run("hard-light", coordinates, integrator, 1000);
        assert!(
            deviation.rms < 7e-3,
            "{coordinates:?} {integrator:?} {deviation:?}"
        );
    }
}
