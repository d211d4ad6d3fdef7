//! Error and cost of the engine's settings for the passive legs, against trajectories of another
//! program: the basis of the default settings.
//!
//! `cargo run --release -p twinrig-rapier --example settings`

use std::time::Instant;

use twinrig_rapier::{Joints, Options, Rapier, Softness, Solver};
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::reference_trajectory::ReferenceTrajectory;

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

/// Returns the error \[m\] and the time per step of 2 ms, observation included \[s\].
#[expect(
    clippy::disallowed_methods,
    reason = "the example measures time per step"
)]
fn run(name: &str, joints: Joints, solver: Solver) -> (f64, f64) {
    let reference = ReferenceTrajectory::read(name);
    let options = Options {
        solver,
        ..Options::new(reference.setup(2000), joints)
    };
    let plant = Rapier::new(&reference.robot(), &options, &|_| true).unwrap();
    let mut leg = PlantHarness::new(plant);
    let begun = Instant::now();
    let error = reference
        .follow(&mut leg)
        .map_or(f64::INFINITY, |found| found.rms);
    let steps = leg.now_us as f64 / 2000.0;
    (error, begun.elapsed().as_secs_f64() / steps)
}
