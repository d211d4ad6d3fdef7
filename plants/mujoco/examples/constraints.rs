//! Error and cost of the robot in MuJoCo over integrators and over the stiffness of constraints:
//! the basis of the crate's defaults.
//!
//! ```text
//! cargo run --release -p twinrig-mujoco --example constraints
//! ```
//!
//! Errors are root mean squares of the foot over each reference trajectory of the full plant \[m\]:
//! a leg between its stops, one that comes to rest on them, one that hits them hard, a light one
//! that hits them harder.

use std::time::Instant;

use twinrig_mujoco::{Coordinates, Integrator, Mujoco, Numerics, Options, TimeConstant};
use twinrig_robot::Robot;
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::reference_trajectory::ReferenceTrajectory;
use twinrig_testing::robots::{LEGS, pose, robot, suspended};

const REFERENCES: [&str; 4] = ["between", "passive", "hard-hit", "hard-light"];

fn plant(robot: &Robot, options: &Options) -> PlantHarness<Mujoco> {
    PlantHarness::new(Mujoco::new(robot, options, &|_| true).unwrap())
}

/// Prints a line of the table.
fn measure(about: &str, coordinates: Coordinates, numerics: Numerics, step_us: u64) {
    let with = |setup| Options {
        numerics,
        ..Options::new(setup, coordinates)
    };
    let mut line = format!("{:8} {about:34} {step_us:5} us", coordinates.name());
    for name in REFERENCES {
        let reference = ReferenceTrajectory::read(name);
        let mut leg = plant(&reference.robot(), &with(reference.setup(step_us)));
        line += &reference.follow(&mut leg).map_or_else(
            |_| "  diverges".to_owned(),
            |deviation| format!("  {:9.1e}", deviation.rms),
        );
    }
    let setup = suspended(&LEGS, pose([10.0, -9.5, 9.5], [0.0; 3]), step_us);
    let mut fixture = plant(&robot(), &with(setup));
    #[expect(
        clippy::disallowed_methods,
        reason = "the example measures time per step, which enters no run"
    )]
    let start = Instant::now();
    let steps = 2000;
    for _ in 0..steps {
        fixture.advance_us(step_us);
    }
    let cost = start.elapsed().as_secs_f64() * 1e6 / f64::from(steps);
    println!("{line}  {cost:7.1} us per step of four legs");
}

fn main() {
    println!("references: {REFERENCES:?}, RMS of the foot in m");
    for coordinates in Coordinates::ALL {
        let defaults = Numerics::of(coordinates);
        for step_us in [2000, 1000, 500] {
            for integrator in Integrator::ALL {
                let numerics = Numerics {
                    integrator,
                    ..defaults
                };
                measure(integrator.name(), coordinates, numerics, step_us);
            }
        }
        for (steps, damping) in [(2.0, 1.0), (3.0, 1.0), (5.0, 1.0), (2.0, 2.0)] {
            for share in [0.9999, 0.999, 0.998, 0.995, 0.99, 0.95] {
                let numerics = Numerics {
                    closing: TimeConstant::Steps(steps),
                    damping,
                    pin_damping: damping,
                    impedance: [share; 2],
                    ..defaults
                };
                let about = format!("solref {steps} h, {damping}, solimp {share}");
                measure(&about, coordinates, numerics, 2000);
            }
        }
        for pin_damping in [1.0, 0.7, 0.5] {
            for step_us in [2000, 1000] {
                let numerics = Numerics {
                    pin_damping,
                    ..defaults
                };
                measure(
                    &format!("pins {pin_damping}"),
                    coordinates,
                    numerics,
                    step_us,
                );
            }
        }
        for share in [0.9999, 0.999, 0.99] {
            let numerics = Numerics {
                impedance: [share; 2],
                ..defaults
            };
            measure(&format!("solimp {share}"), coordinates, numerics, 1000);
        }
        for step_us in [2000, 100] {
            let soft = defaults.with_soft_constraints();
            measure("solref 0.02 s, solimp 0.9 0.95", coordinates, soft, step_us);
        }
    }
}
