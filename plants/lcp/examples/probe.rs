//! Prints the equations of motion at random states, one JSON object per line, for comparison with
//! Pinocchio by `tests/reference/pinocchio_check.py`.
//!
//! ```text
//! cargo run --release -p twinrig-lcp --example probe -- 1000 \
//!     | python3 plants/lcp/tests/reference/pinocchio_check.py
//! ```

use std::path::Path;

use serde_json::json;
use twinrig_kernel::{SimDuration, stream};
use twinrig_lcp::{Equations, Posture};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start};
use twinrig_robot::RobotFile;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count: usize = std::env::args().nth(1).map_or(Ok(1000), |n| n.parse())?;
    let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    for name in ["cheetah-cub", "oncilla"] {
        let robot = RobotFile::find(name, workspace)?.robot()?;
        let legs = robot.legs.len();
        let setup = Setup {
            base: Base::Free,
            legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
            ground: None,
            step: SimDuration::from_millis(2),
            drives: Drives::None,
            abduction: Abduction::Locked,
            contacts: Contacts::Feet,
            set_point: SetPoint::Held,
            start: Start::default(),
        };
        for toe in [false, true] {
            println!("{}", json!({ "robot": name, "toe": toe }));
            let links = if toe { 4 } else { 3 };
            let mut stream = stream(1, &format!("probe/{name}/{toe}"));
            let mut uniform = |bound: f64| bound * (2.0 * stream.unit() - 1.0);
            for _ in 0..count {
                let quaternion: [f64; 4] = std::array::from_fn(|_| uniform(1.0));
                let length = libm::sqrt(quaternion.iter().map(|c| c * c).sum());
                let posture = Posture {
                    position: std::array::from_fn(|_| uniform(2.0)),
                    orientation: quaternion.map(|c| c / length),
                    angles: (0..legs)
                        .map(|_| (0..links).map(|_| uniform(3.0)).collect())
                        .collect(),
                    velocity: (0..6 + legs * links).map(|_| uniform(10.0)).collect(),
                };
                let equations = Equations::new(&robot, &setup, toe, &posture)?;
                let [kinetic, spring, gravity] = equations.energy;
                println!(
                    "{}",
                    json!({
                        "position": posture.position,
                        "orientation": posture.orientation,
                        "angles": posture.angles,
                        "velocity": posture.velocity,
                        "inertia": equations.inertia,
                        "bias": equations.bias,
                        "kinetic": kinetic,
                        "spring": spring,
                        "gravity": gravity,
                        "feet": equations.feet,
                        "jacobians": equations.jacobians,
                        "acceleration": equations.acceleration,
                    })
                );
            }
        }
    }
    Ok(())
}
