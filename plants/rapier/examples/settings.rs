//! Error and cost of the engine's settings over the passive legs, against trajectories of another program: what the default
//! settings were chosen by.
//!
//! `cargo run --release -p twinrig-rapier --example settings`

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/plant/scene.rs"]
mod scene;

use std::time::Instant;

use scene::{Golden, Scene, hanging};
use twinrig_rapier::{Joints, Options, Softness, Solver};

fn main() {
    for joints in Joints::ALL {
        println!(
            "\n{joints:?}: root mean square error of the foot in mm, and µs a step of one leg"
        );
        println!("{:42} passive  between hard-hit undamped", "");
        let best = Solver::best(joints);
        row("best", joints, best);
        row("the engine's own", joints, Solver::of_the_engine());
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

/// Error \[m\] and seconds a step of 2 ms.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times are small and whole"
)]
#[expect(
    clippy::disallowed_methods,
    reason = "what a step costs is what is asked"
)]
fn run(name: &str, joints: Joints, solver: Solver) -> (f64, f64) {
    let golden = Golden::read(name);
    let robot = golden.robot();
    let options = Options {
        solver,
        ..Options::new(hanging(&["LF"], golden.start(), 2000), joints)
    };
    let mut scene = Scene::new(&robot, &options);
    let (feet, hip) = (golden.rows("foot"), robot.legs[0].hip);
    let apart_s = golden.number("step_s");
    let (mut square, mut saturated) = (0.0, 0.0);
    for (k, foot) in (0_u64..).zip(&feet) {
        let begun = Instant::now();
        let sound = scene.reaches_us((1e6 * apart_s * k as f64).round() as u64);
        if !sound {
            return (f64::INFINITY, saturated / k as f64);
        }
        saturated += begun.elapsed().as_secs_f64();
        let (found, trunk) = (
            scene.read("leg/LF/foot/position"),
            scene.read("body/position"),
        );
        for (axis, expected) in [0, 2].into_iter().zip(foot) {
            let apart = found[axis] - trunk[axis] - hip[axis] - expected;
            square += apart * apart;
        }
    }
    let count = feet.len() as f64;
    ((square / count).sqrt(), saturated / (count - 1.0))
}
