//! Legs that hang from a held trunk, against trajectories of another program, which are right to 1e-9 m.

use twinrig_rapier::{Joints, Options, Solver};

use crate::scene::{Golden, Scene, hanging};

/// Root mean square error of the foot over the golden's time \[m\].
fn error(name: &str, joints: Joints, step_us: u64, change: impl Fn(&mut Options)) -> f64 {
    let golden = Golden::read(name);
    let robot = golden.robot();
    let mut options = Options::new(hanging(&["LF"], golden.start(), step_us), joints);
    change(&mut options);
    let mut scene = Scene::new(&robot, &options);
    let (feet, step_s) = (golden.rows("foot"), golden.number("step_s"));
    let hip = robot.legs[0].hip;
    let mut square = 0.0;
    for (k, foot) in feet.iter().enumerate() {
        scene.run_to_us(micros(k as f64 * step_s));
        let found = scene.read("leg/LF/foot/position");
        let trunk = scene.read("body/position");
        for (axis, expected) in [0, 2].into_iter().zip(foot) {
            let apart = found[axis] - trunk[axis] - hip[axis] - expected;
            square += apart * apart;
        }
    }
    (square / feet.len() as f64).sqrt()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times are small and whole"
)]
fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

#[test]
fn legs_move_as_the_reference_does() {
    // Measured at 2 ms: 0.028, 0.159, 0.583 and 1.333 mm; 0.776, 4.60, 4.41 and 8.07 mm in the coordinates of the joints,
    // where what the engine makes of the joints' own accelerations costs as much again.
    for (name, impulse, multibody) in [
        ("passive", 5e-5, 1.5e-3),
        ("between", 2.5e-4, 6e-3),
        ("hard-hit", 1e-3, 6e-3),
        ("undamped", 2e-3, 1.2e-2),
    ] {
        for (joints, most) in [(Joints::Impulse, impulse), (Joints::Multibody, multibody)] {
            let error = error(name, joints, 2000, |_| ());
            assert!(error < most, "{name}, {joints:?}: {error:e}");
        }
    }
}

#[test]
fn between_events_errors_fall_with_the_square_of_the_step() {
    for joints in Joints::ALL {
        let errors = [2000, 1000, 500].map(|step| error("between", joints, step, |_| ()));
        for pair in errors.windows(2) {
            // 4 for the square, less what higher orders make of it.
            assert!(pair[0] > 3.5 * pair[1], "{joints:?}: {errors:?}");
        }
    }
}

#[test]
fn where_stops_are_hit_errors_fall_with_the_step() {
    for joints in Joints::ALL {
        for name in ["passive", "hard-hit"] {
            // An impact comes anywhere in its step: from one step to another errors scatter, over a decade they fall
            // by three and more.
            let [coarse, fine] = [2000, 200].map(|step| error(name, joints, step, |_| ()));
            assert!(
                coarse > 2.5 * fine,
                "{name}, {joints:?}: {coarse:e}, then {fine:e}"
            );
        }
    }
}

#[test]
fn what_a_segment_weighs_about_itself_does_not_matter() {
    let run = |share: f64| {
        let golden = Golden::read("hard-hit");
        let mut options = Options::new(hanging(&["LF"], golden.start(), 2000), Joints::Impulse);
        options.axial_share = share;
        let mut scene = Scene::new(&golden.robot(), &options);
        scene.run_to_us(100_000);
        scene.read("leg/LF/foot/position")
    };
    let [small, large] = [0.01, 1.0].map(run);
    for (a, b) in small.iter().zip(&large) {
        // In the leg's plane nothing turns about a link: only rounding is left.
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn forces_that_are_held_over_the_engines_own_substeps_cost_accuracy() {
    let own = error("between", Joints::Impulse, 2000, |options| {
        options.solver.solver_iterations = 4;
    });
    let ours = error("between", Joints::Impulse, 2000, |options| {
        options.solver.substeps = 4;
    });
    assert!(own > 50.0 * ours, "{own:e} {ours:e}");
}

#[test]
fn the_engines_own_settings_are_worse() {
    for name in ["passive", "between", "hard-hit"] {
        let [best, own] = [Solver::best(Joints::Impulse), Solver::of_the_engine()].map(|solver| {
            error(name, Joints::Impulse, 2000, |options| {
                options.solver = solver;
            })
        });
        assert!(own > 5.0 * best, "{name}: {own:e} {best:e}");
    }
}
