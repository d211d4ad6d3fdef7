//! The constant part of the plant: masses, geometry, drives, and what of it is simulated.

use nalgebra::Vector3;
use twinrig_contact::Ground;
use twinrig_leg::{EnergyTable, Pantograph};
use twinrig_legged::{Base, Fitted, LeggedError, Setup, positive};
pub(crate) use twinrig_robot::GRAVITY;
use twinrig_robot::{JointFriction, Robot};

/// Where the force of a leg comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Force {
    /// The closed form.
    Solve,
    /// A bicubic energy table with this many cells along each axis.
    Lookup {
        /// Cells along each axis.
        cells: usize,
    },
}

/// What to simulate of a robot, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What is the same for every plant.
    pub setup: Setup,
    /// Where the force of a leg comes from.
    pub force: Force,
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MasslessError {
    /// Robot and setup do not fit together.
    #[error(transparent)]
    Setup(#[from] LeggedError),
    /// The start has no pose.
    #[error("the start cannot be taken: {0}")]
    Start(String),
}

/// One leg.
#[derive(Debug, Clone)]
pub(crate) struct LegModel {
    pub(crate) name: String,
    /// Hip joint in the trunk frame, seen from the centre of mass \[m\].
    pub(crate) hip: Vector3<f64>,
    /// What turns at the hip where no drive does, which a leg without any mass would lack: the first segment, a uniform
    /// rod \[kg·m²\].
    pub(crate) free_hip: f64,
    pub(crate) pantograph: Pantograph,
    pub(crate) table: Option<EnergyTable>,
    /// Mass at the foot \[kg\].
    pub(crate) mass: f64,
    pub(crate) friction: JointFriction,
}

/// The constant part of the plant.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) base: Base,
    /// Centre of mass, seen from the trunk's own \[m\].
    pub(crate) centre: Vector3<f64>,
    /// Mass of the trunk with the parts of the legs that move with it \[kg\].
    pub(crate) mass: f64,
    /// Principal moments of inertia of the same \[kg·m²\].
    pub(crate) inertia: Vector3<f64>,
    pub(crate) legs: Vec<LegModel>,
    /// Without any, the hips turn freely and there is no cable.
    pub(crate) drives: Option<Fitted>,
    /// Inputs of a leg.
    pub(crate) inputs: usize,
    pub(crate) ground: Option<Ground>,
    /// The plant's step \[s\].
    pub(crate) step: f64,
    /// Mobility given to redundant constraints \[1/kg\].
    pub(crate) compliance: f64,
    /// The greatest length of a leg: by which distances are measured \[m\].
    pub(crate) reach: f64,
    /// Weight times leg length: the energy by which others are measured \[J\].
    pub(crate) energy_scale: f64,
}

impl Model {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, MasslessError> {
        let Options { setup, force } = options;
        let chosen = setup.chosen(robot)?;
        // What a leg weighs beyond its lumped foot hangs at its hip and moves with the trunk.
        let hung: Vec<(f64, Vector3<f64>)> = chosen
            .iter()
            .map(|mount| {
                (
                    mount.leg.mass.total() - mount.leg.mass.lumped_foot,
                    Vector3::from(mount.hip),
                )
            })
            .collect();
        let mass = robot.trunk.mass + hung.iter().map(|(m, _)| m).sum::<f64>();
        positive("trunk", mass)?;
        // A trunk that does not move has no use for its centre of mass; its hips are where the file has them, whichever legs
        // are there.
        let centre = if setup.base == Base::Fixed {
            Vector3::zeros()
        } else {
            hung.iter().map(|(m, r)| r * *m).sum::<Vector3<f64>>() / mass
        };
        let around = |m: f64, r: Vector3<f64>| {
            Vector3::new(
                r.y * r.y + r.z * r.z,
                r.x * r.x + r.z * r.z,
                r.x * r.x + r.y * r.y,
            ) * m
        };
        let mut inertia = Vector3::from(robot.trunk.inertia) + around(robot.trunk.mass, -centre);
        for (m, r) in &hung {
            inertia += around(*m, r - centre);
        }
        for (moment, axis) in inertia.iter().zip(["roll", "pitch", "yaw"]) {
            positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
        }
        let drives = setup.fitted(robot)?;
        if drives.is_none() {
            for mount in &chosen {
                let what = format!("first segment of leg {}, which no drive turns,", mount.name);
                positive(&what, mount.leg.mass.l1)?;
            }
        }
        let legs = chosen
            .iter()
            .map(|mount| LegModel::new(mount, Vector3::from(mount.hip) - centre, *force))
            .collect::<Result<Vec<_>, _>>()?;
        let lightest = legs
            .iter()
            .map(|leg| leg.mass)
            .fold(f64::INFINITY, f64::min);
        let total = mass + legs.iter().map(|leg| leg.mass).sum::<f64>();
        let reach = legs
            .iter()
            .map(|leg| leg.pantograph.length_max())
            .fold(0.0, f64::max);
        Ok(Self {
            base: setup.base,
            centre,
            reach,
            energy_scale: total * GRAVITY * reach,
            mass,
            inertia,
            legs,
            drives,
            inputs: setup.drives.inputs(),
            ground: setup.ground.clone(),
            step: setup.step.as_secs_f64(),
            // Nine digits below the mobility of a foot: invisible where constraints are independent, and enough to make
            // redundant ones share their load.
            compliance: 1e-9 / lightest.min(mass),
        })
    }
}

impl Model {
    /// What turns at hip and pulley of a leg \[kg·m²\].
    pub(crate) fn turning(&self, leg: usize) -> [f64; 2] {
        match &self.drives {
            Some(drives) => drives.inertias(),
            None => [self.legs[leg].free_hip, 0.0],
        }
    }
}

impl LegModel {
    fn new(
        mount: &twinrig_robot::LegMount,
        hip: Vector3<f64>,
        force: Force,
    ) -> Result<Self, MasslessError> {
        let wrong = LeggedError::of_leg(&mount.name);
        let mass = mount.leg.mass.lumped_foot;
        positive(&format!("lumped foot of leg {}", mount.name), mass)?;
        let pantograph = Pantograph::new(&mount.leg).map_err(&wrong)?;
        let table = match force {
            Force::Solve => None,
            Force::Lookup { cells } => Some(EnergyTable::new(&pantograph, cells).map_err(&wrong)?),
        };
        Ok(Self {
            name: mount.name.clone(),
            hip,
            free_hip: mount.leg.mass.l1 * mount.leg.l1 * mount.leg.l1 / 3.0,
            pantograph,
            table,
            mass,
            friction: mount.leg.joint_friction,
        })
    }
}
