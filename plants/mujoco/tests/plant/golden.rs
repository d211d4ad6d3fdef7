//! Trajectories of the full plant's reference: other coordinates, integrators and language.

use std::fs;
use std::path::Path;

use serde_json::Value;
use twinrig_kernel::SimDuration;
use twinrig_legged::{Setup, StartPose};
use twinrig_mujoco::Options;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::fixture::{Fixture, hanging, robot};

/// A reference trajectory.
pub struct Golden(Value);

fn flat(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(items) => items.iter().flat_map(flat).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}

impl Golden {
    pub fn read(name: &str) -> Self {
        let folder = "../lcp/tests/reference/golden";
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let text = fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        Self(serde_json::from_str(&text).unwrap())
    }

    fn rows(&self, key: &str) -> Vec<Vec<f64>> {
        self.0[key].as_array().unwrap().iter().map(flat).collect()
    }

    /// Returns the robot with the leg of the trajectory.
    pub fn robot(&self) -> Robot {
        let mut robot = robot();
        let parameter = |key: &str| self.0["leg"][key].as_f64().unwrap();
        let leg = &mut robot.legs[0].leg;
        assert!((parameter("l2") - leg.l2).abs() < 1e-15, "another robot");
        (leg.diagonal.stiffness, leg.parallel.stiffness) = (parameter("k_d"), parameter("k_p"));
        (leg.diagonal.preload, leg.parallel.preload) =
            (parameter("preload_d"), parameter("preload_p"));
        leg.parallel_travel = parameter("travel");
        let friction = flat(&self.0["leg"]["friction"]);
        let joints = &mut leg.joint_friction;
        (joints.hip, joints.knee, joints.ankle) = (friction[0], friction[1], friction[2]);
        robot
    }

    pub fn setup(&self, step_us: u64) -> Setup {
        let three = |value: &Value| <[f64; 3]>::try_from(flat(value)).unwrap();
        let start = StartPose {
            q: three(&self.0["start"]["angles_deg"]).map(f64::to_radians),
            rates: three(&self.0["start"]["rates"]),
        };
        Setup {
            legs: vec!["LF".to_owned()],
            step: SimDuration::from_micros(step_us),
            ..hanging(start.into())
        }
    }
}

/// Deviation of a leg from its reference.
#[derive(Debug)]
pub struct Deviation {
    /// Root mean square of the foot \[m\].
    pub rms: f64,
    /// Energy lost in impacts, and in those of the reference \[J\].
    pub lost: [f64; 2],
    /// Maximum constraint violation \[m\].
    pub violation: f64,
    /// Final residual of the energy balance over the energy exchanged \[1\].
    pub residual: f64,
}

pub fn deviation(name: &str, with: impl Fn(Setup) -> Options, step_us: u64) -> Deviation {
    try_deviation(name, with, step_us).unwrap()
}

/// Returns the deviation; none if the plant diverges.
pub fn try_deviation(
    name: &str,
    with: impl Fn(Setup) -> Options,
    step_us: u64,
) -> Option<Deviation> {
    let golden = Golden::read(name);
    let robot = golden.robot();
    let mut fixture = Fixture::new(&robot, &with(golden.setup(step_us)));
    let interval = golden.0["step_s"].as_f64().unwrap();
    let us = SimDuration::try_from_secs_f64(interval).unwrap().as_nanos() / 1000;
    let hip = robot.legs[0].hip;
    let (mut sum, mut count, mut violation) = (0.0, 0, 0.0_f64);
    let feet = golden.rows("foot");
    for (k, foot) in feet.iter().enumerate() {
        if k > 0 {
            fixture.try_advance_us(us).ok()?;
        }
        let found = fixture.read("leg/LF/foot/position");
        let trunk = fixture.read("body/position");
        let relative = [0, 2].map(|axis| found[axis] - trunk[axis] - hip[axis]);
        let [x, z] = [relative[0] - foot[0], relative[1] - foot[1]];
        let square = x * x + z * z;
        assert!(square.is_finite());
        sum += square;
        violation = violation.max(fixture.plant.constraint_violation().unwrap());
        count += 1;
    }
    let lost = golden.rows("impact").concat();
    let balance = fixture.plant.energy();
    Some(Deviation {
        rms: (sum / f64::from(count)).sqrt(),
        lost: [balance.impact, lost[lost.len() - 1]],
        violation,
        residual: balance.residual.abs() / balance.exchanged.max(1e-12),
    })
}
