//! Trajectories of the reference of the full plant.

use std::fs;
use std::path::Path;

use serde_json::Value;
use twinrig_kernel::SimDuration;
use twinrig_legged::{Setup, StartPose};
use twinrig_robot::Robot;
use twinrig_runtime::{Plant, PlantFault};

use crate::plant_harness::PlantHarness;
use crate::robots::{robot, suspended};

/// A trajectory of `plants/lcp/tests/reference`: other coordinates, integrators and language, with
/// errors below 1e-9 m.
pub struct ReferenceTrajectory(pub Value);

impl ReferenceTrajectory {
    /// Reads a trajectory.
    pub fn read(name: &str) -> Self {
        let folder = "../../plants/lcp/tests/reference/golden";
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let text = fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        Self(serde_json::from_str(&text).unwrap())
    }

    /// Returns a number.
    pub fn number(&self, key: &str) -> f64 {
        self.0[key].as_f64().unwrap()
    }

    /// Returns rows of numbers, one per instant; nested arrays are flattened.
    pub fn rows(&self, key: &str) -> Vec<Vec<f64>> {
        let rows = self.0[key].as_array().unwrap();
        rows.iter().map(flatten).collect()
    }

    /// Returns joint angles and rates at the start.
    pub fn start(&self) -> StartPose {
        let three = |key: &str| <[f64; 3]>::try_from(flatten(&self.0["start"][key])).unwrap();
        StartPose {
            q: three("angles_deg").map(f64::to_radians),
            rates: three("rates"),
        }
    }

    /// Returns the robot with the leg of a passive trajectory.
    pub fn robot(&self) -> Robot {
        let mut robot = robot();
        let parameter = |key: &str| self.0["leg"][key].as_f64().unwrap();
        let leg = &mut robot.legs[0].leg;
        assert!(
            (parameter("l2") - leg.l2).abs() < 1e-15,
            "the robot file has changed"
        );
        (leg.diagonal.stiffness, leg.parallel.stiffness) = (parameter("k_d"), parameter("k_p"));
        (leg.diagonal.preload, leg.parallel.preload) =
            (parameter("preload_d"), parameter("preload_p"));
        leg.parallel_travel = parameter("travel");
        let friction = flatten(&self.0["leg"]["friction"]);
        let joints = &mut leg.joint_friction;
        (joints.hip, joints.knee) = (friction[0], friction[1]);
        (joints.ankle, joints.toe) = (friction[2], friction[3]);
        robot
    }

    /// Returns the setup of a passive trajectory.
    pub fn setup(&self, step_us: u64) -> Setup {
        suspended(&["LF"], self.start(), step_us)
    }

    /// Runs the leg of a passive trajectory and compares it at each instant. Returns the fault, if
    /// any.
    pub fn follow<P: Plant>(&self, leg: &mut PlantHarness<P>) -> Result<Deviation, PlantFault> {
        let hip = self.robot().legs[0].hip;
        let interval = SimDuration::try_from_secs_f64(self.number("step_s")).unwrap();
        let interval_us = interval.as_nanos() / 1000;
        let feet = self.rows("foot");
        let (mut square, mut violation) = (0.0, 0.0_f64);
        for (instant, foot) in (0..).zip(&feet) {
            leg.try_advance_to_us(instant * interval_us)?;
            let (found, trunk) = (leg.read("leg/LF/foot/position"), leg.read("body/position"));
            for (axis, expected) in [0, 2].into_iter().zip(foot) {
                let difference = found[axis] - trunk[axis] - hip[axis] - expected;
                square += difference * difference;
            }
            assert!(square.is_finite());
            violation = violation.max(leg.plant.constraint_violation().unwrap());
        }
        let lost = self.rows("impact").concat();
        let balance = leg.plant.energy();
        Ok(Deviation {
            rms: (square / feet.len() as f64).sqrt(),
            lost: [balance.impact, lost[lost.len() - 1]],
            violation,
            residual: balance.residual.abs() / balance.exchanged.max(1e-12),
        })
    }
}

/// Deviation of a leg from its reference.
#[derive(Clone, Copy, Debug)]
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

/// Returns the numbers of a nested array.
pub fn flatten(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(items) => items.iter().flat_map(flatten).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}
