//! Error and cost of the engine's settings for the passive legs, against trajectories of another
//! program: the basis of the default settings.
//!
//! `cargo run --release -p twinrig-rapier --example settings`

#[allow(dead_code, reason = "the rest is used by the tests")]
#[path = "../tests/plant/fixture.rs"]
mod fixture;

use std::time::Instant;

use fixture::{Fixture, Golden, hanging};
use twinrig_rapier::{Joints, Options, Softness, Solver};

fn main() {
    for joints in Joints::ALL {
        println!(
            "
{joints:?}: root mean square error of the foot in mm, and µs per step of one leg"
        );
        println!("{:42} passive  between hard-hit undamped", "");
        let best = Solver::best(joints);
        row("best", joints, best);
        row("engine defaults", joints, Solver::engine_defaults());
        for pgs_iterations in [1, 5, 10, 20, 50, 100, 200, 500] {
            let solver = Solver {
                pgs_iterations,
                ..best
            };
            row(&format!("pgs_iterations {pgs_iterations}"), joints, solver);
        }
        for stabilization_iterations in [1, 4, 40] {
            let solver = Solver {
                stabilization_iterations,
                ..best
            };
            row(
                &format!("stabilization_iterations {stabilization_iterations}"),
                joints,
                solver,
            );
        }
        for solver_iterations in [2, 4] {
            let solver = Solver {
                solver_iterations,
                ..best
            };
            row(
                &format!("solver_iterations {solver_iterations}"),
                joints,
                solver,
            );
        }
        for substeps in [2, 4] {
            let solver = Solver { substeps, ..best };
            row(&format!("substeps {substeps}"), joints, solver);
        }
        for natural_frequency in [30.0, 100.0, 300.0, 1e3, 1e4] {
            for damping_ratio in [0.5, 1.0, 5.0] {
                let joint_softness = Softness {
                    natural_frequency,
                    damping_ratio,
                };
                let solver = Solver {
                    joint_softness,
                    ..best
                };
                row(
                    &format!("natural_frequency {natural_frequency} damping_ratio {damping_ratio}"),
                    joints,
                    solver,
                );
            }
        }
    }
}

fn row(what: &str, joints: Joints, solver: Solver) {
    print!("{what:42}");
    let mut cost = 0.0;
    for name in ["passive", "between", "hard-hit", "undamped"] {
        let (error, time) = run(name, joints, solver);
        print!(" {:8.3}", 1e3 * error);
        cost = time;
    }
    println!(" {:8.1}", 1e6 * cost);
}

/// Returns the error \[m\] and the time per step of 2 ms \[s\].
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times are small integers"
)]
#[expect(
    clippy::disallowed_methods,
    reason = "the example measures time per step"
)]
fn run(name: &str, joints: Joints, solver: Solver) -> (f64, f64) {
    let golden = Golden::read(name);
    let robot = golden.robot();
    let options = Options {
        solver,
        ..Options::new(hanging(&["LF"], golden.start(), 2000), joints)
    };
    let mut fixture = Fixture::new(&robot, &options);
    let (feet, hip) = (golden.rows("foot"), robot.legs[0].hip);
    let apart_s = golden.number("step_s");
    let (mut square, mut elapsed) = (0.0, 0.0);
    for (k, foot) in (0_u64..).zip(&feet) {
        let begun = Instant::now();
        let reached = fixture.reaches_us((1e6 * apart_s * k as f64).round() as u64);
        if !reached {
            return (f64::INFINITY, elapsed / k as f64);
        }
        elapsed += begun.elapsed().as_secs_f64();
        let (found, trunk) = (
            fixture.read("leg/LF/foot/position"),
            fixture.read("body/position"),
        );
        for (axis, expected) in [0, 2].into_iter().zip(foot) {
            let difference = found[axis] - trunk[axis] - hip[axis] - expected;
            square += difference * difference;
        }
    }
    let count = feet.len() as f64;
    ((square / count).sqrt(), elapsed / (count - 1.0))
}
