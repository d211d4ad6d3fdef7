//! Legs that hang from a fixed trunk, against trajectories of another program with errors below
//! 1e-9 m.

use twinrig_rapier::{Joints, Options, Solver};
use twinrig_testing::reference_trajectory::ReferenceTrajectory;

use crate::fixture::with_options;

/// Returns the root mean square error of the foot over the duration of the reference \[m\].
fn error(name: &str, joints: Joints, step_us: u64, change: impl Fn(&mut Options)) -> f64 {
    let reference = ReferenceTrajectory::read(name);
    let mut options = Options::new(reference.setup(step_us), joints);
    change(&mut options);
    let mut fixture = with_options(&reference.robot(), &options);
    reference.follow(&mut fixture).unwrap().rms
}

#[test]
fn hanging_legs_agree_with_the_reference() {
    // Measured at 2 ms: 0.028, 0.159, 0.583 and 1.333 mm; in joint coordinates, with the additional
    // error of the engine's joint accelerations, 0.776, 4.60, 4.41 and 8.07 mm.
    for (name, impulse, multibody) in [
        ("passive", 5e-5, 1.5e-3),
        ("between", 2.5e-4, 6e-3),
        ("hard-hit", 1e-3, 6e-3),
        ("undamped", 2e-3, 1.2e-2),
    ] {
        for (joints, largest) in [(Joints::Impulse, impulse), (Joints::Multibody, multibody)] {
            let error = error(name, joints, 2000, |_| ());
            assert!(error < largest, "{name}, {joints:?}: {error:e}");
        }
    }
}

#[test]
fn convergence_between_events_is_of_second_order() {
    for joints in Joints::ALL {
        let errors = [2000, 1000, 500].map(|step| error("between", joints, step, |_| ()));
        for pair in errors.windows(2) {
            // 4 for second order, reduced by higher orders.
            assert!(pair[0] > 3.5 * pair[1], "{joints:?}: {errors:?}");
        }
    }
}

#[test]
fn errors_with_impacts_fall_with_the_step() {
    for joints in Joints::ALL {
        for name in ["passive", "hard-hit"] {
            // Impacts occur at arbitrary times within a step: errors scatter between steps, but
            // fall by three and more over a decade.
            let [coarse, fine] = [2000, 200].map(|step| error(name, joints, step, |_| ()));
            assert!(
                coarse > 2.5 * fine,
                "{name}, {joints:?}: {coarse:e}, then {fine:e}"
            );
        }
    }
}

#[test]
fn axial_inertia_does_not_affect_the_motion() {
    let run = |share: f64| {
        let reference = ReferenceTrajectory::read("hard-hit");
        let mut options = Options::new(reference.setup(2000), Joints::Impulse);
        options.axial_share = share;
        let mut fixture = with_options(&reference.robot(), &options);
        fixture.advance_to_us(100_000);
        fixture.read("leg/LF/foot/position")
    };
    let [small, large] = [0.01, 1.0].map(run);
    for (a, b) in small.iter().zip(&large) {
        // In the leg's plane no segment rotates about its own axis: only rounding remains.
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn forces_held_over_engine_substeps_cost_accuracy() {
    let engine = error("between", Joints::Impulse, 2000, |options| {
        options.solver.solver_iterations = 4;
    });
    let plant = error("between", Joints::Impulse, 2000, |options| {
        options.solver.substeps = 4;
    });
    assert!(engine > 50.0 * plant, "{engine:e} {plant:e}");
}

#[test]
fn engine_defaults_are_less_accurate() {
    for name in ["passive", "between", "hard-hit"] {
        let [best, engine] =
            [Solver::best(Joints::Impulse), Solver::engine_defaults()].map(|solver| {
                error(name, Joints::Impulse, 2000, |options| {
                    options.solver = solver;
                })
            });
        assert!(engine > 5.0 * best, "{name}: {engine:e} {best:e}");
    }
}
