//! Legs that hang from a fixed trunk, against trajectories of another program with errors below
//! 1e-9 m.

use twinrig_rapier::{Joints, Options, Solver};

use crate::fixture::{Fixture, Golden, hanging};

/// Returns the root mean square error of the foot over the duration of the reference \[m\].
fn error(name: &str, joints: Joints, step_us: u64, change: impl Fn(&mut Options)) -> f64 {
    let golden = Golden::read(name);
    let robot = golden.robot();
    let mut options = Options::new(hanging(&["LF"], golden.start(), step_us), joints);
    change(&mut options);
    let mut fixture = Fixture::new(&robot, &options);
    let (feet, step_s) = (golden.rows("foot"), golden.number("step_s"));
    let hip = robot.legs[0].hip;
    let mut square = 0.0;
    for (k, foot) in feet.iter().enumerate() {
        fixture.run_to_us(micros(k as f64 * step_s));
        let found = fixture.read("leg/LF/foot/position");
        let trunk = fixture.read("body/position");
        for (axis, expected) in [0, 2].into_iter().zip(foot) {
            let difference = found[axis] - trunk[axis] - hip[axis] - expected;
            square += difference * difference;
        }
    }
    (square / feet.len() as f64).sqrt()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times are small integers"
)]
fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
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
        let golden = Golden::read("hard-hit");
        let mut options = Options::new(hanging(&["LF"], golden.start(), 2000), Joints::Impulse);
        options.axial_share = share;
        let mut fixture = Fixture::new(&golden.robot(), &options);
        fixture.run_to_us(100_000);
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
