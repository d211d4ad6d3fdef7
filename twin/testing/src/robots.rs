//! Robots of this repository, and setups of them.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start, StartPose};
use twinrig_robot::{Leg, PointMass, Robot, RobotFile, Servo};

/// Names of all legs.
pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// A servo sufficient for a trot.
pub const SERVO: Servo = Servo {
    torque: 4.0,
    speed: 25.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-3,
};

/// Drives of this servo.
pub const SERVOS: Drives = Drives::Servos {
    hip: SERVO,
    knee: SERVO,
};

/// Returns the robot of `robots/cheetah-cub.toml`.
pub fn robot() -> Robot {
    robot_named("cheetah-cub")
}

/// Returns a robot of `robots/`.
pub fn robot_named(name: &str) -> Robot {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    RobotFile::find(name, root).unwrap().robot().unwrap()
}

/// Returns the robot with modified legs.
pub fn with_legs(change: impl Fn(&mut Leg)) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        change(&mut mount.leg);
    }
    robot
}

/// Returns a start at joint angles in degrees and rates in rad/s.
pub fn pose(q: [f64; 3], rates: [f64; 3]) -> Start {
    let q = q.map(f64::to_radians);
    StartPose { q, rates }.into()
}

/// Returns flat ground.
pub fn flat_ground(friction: f64) -> Ground {
    Ground::new(Terrain::Flat, friction, 0.0).unwrap()
}

/// Returns a setup of legs suspended from a fixed trunk, without drives.
pub fn suspended(legs: &[&str], start: impl Into<Start>, step_us: u64) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: legs.iter().map(|leg| (*leg).to_owned()).collect(),
        ground: None,
        step: SimDuration::from_micros(step_us),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: start.into(),
    }
}

/// Returns a setup of the free robot on flat ground of friction 0.6.
pub fn standing(drives: Drives, step_us: u64) -> Setup {
    Setup {
        base: Base::Free,
        ground: Some(flat_ground(0.6)),
        drives,
        ..suspended(&LEGS, Start::default(), step_us)
    }
}

/// Robot with a point mass on its trunk, and the rigid body that both are by the parallel axes
/// theorem.
pub struct LoadedTrunk {
    /// The robot.
    pub robot: Robot,
    /// Centre of mass of both, from that of the trunk \[m\].
    pub centre: Vector3<f64>,
    /// Inertia about it \[kg·m²\].
    pub inertia: Matrix3<f64>,
}

impl LoadedTrunk {
    /// Puts a payload onto the trunk of [`robot`].
    pub fn new(payload: f64, at: Vector3<f64>) -> Self {
        let mut robot = robot();
        let trunk = &mut robot.trunk;
        trunk.payloads = vec![PointMass {
            mass: payload,
            at: at.into(),
        }];
        let mass = trunk.mass + payload;
        let centre = at * (payload / mass);
        let point = |m: f64, r: Vector3<f64>| {
            Matrix3::from_diagonal_element(m * r.norm_squared()) - r * r.transpose() * m
        };
        let own = Matrix3::from_diagonal(&Vector3::from(trunk.inertia));
        let inertia = own + point(trunk.mass, -centre) + point(payload, at - centre);
        Self {
            robot,
            centre,
            inertia,
        }
    }
}
