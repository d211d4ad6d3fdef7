//! Constant part of the plant: masses, geometry, drives, and the simulated subset of the robot.

use nalgebra::{Matrix3, Vector3};
use twinrig_compliant::lanes::Features;
use twinrig_contact::Ground;
use twinrig_legged::{Base, Constraints, DriveModels, LEGS, LeggedError, Setup, positive};
pub(crate) use twinrig_robot::GRAVITY;
use twinrig_robot::leg::{EnergyTable, Pantograph};
use twinrig_robot::{JointFriction, Robot};

/// Method for the force of a leg's springs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Force {
    /// Closed form.
    Solve,
    /// Bicubic energy table with this many cells along each axis.
    Lookup {
        /// Cells along each axis.
        cells: usize,
    },
    /// Table of forces with linear interpolation, as in the thesis (section 2.7.2): its forces are
    /// not the gradient of an energy.
    LinearLookup {
        /// Cells along each axis.
        cells: usize,
    },
}

/// Integration method with rigid constraints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// Implicit midpoint rule, which conserves the energy of the springs.
    #[default]
    Midpoint,
    /// Explicit Euler at a fixed step, as in the thesis (section 2.4): forces and velocities of the
    /// start of a step hold throughout.
    ExplicitEuler,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 2] = [Self::Midpoint, Self::ExplicitEuler];

    /// Returns the name used in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Midpoint => "midpoint",
            Self::ExplicitEuler => "explicit-euler",
        }
    }
}

/// Options of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Setup common to all plants.
    pub setup: Setup,
    /// Method for the force of a leg's springs, with rigid constraints.
    pub force: Force,
    /// Integration method, with rigid constraints.
    pub method: Method,
    /// Formulation of the constraints.
    pub constraints: Constraints,
    /// Maximum estimated error with compliant constraints, per millisecond, in the position of
    /// trunk or foot \[m\].
    pub tolerance: f64,
    /// Registers for compliant constraints; results do not depend on them.
    pub features: Features,
}

impl Options {
    /// Default tolerance of compliant constraints \[m\].
    pub const TOLERANCE: f64 = twinrig_compliant::StepControl::TOLERANCE;

    /// Creates options with rigid constraints.
    pub fn new(setup: Setup, force: Force) -> Self {
        Self {
            setup,
            force,
            method: Method::Midpoint,
            constraints: Constraints::Rigid,
            tolerance: Self::TOLERANCE,
            features: Features::Detected,
        }
    }

    /// Creates options with compliant constraints and a tolerance \[m\].
    pub fn compliant(setup: Setup, tolerance: f64) -> Self {
        Self {
            constraints: Constraints::Compliant,
            tolerance,
            ..Self::new(setup, Force::Solve)
        }
    }
}

/// Reason why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MasslessError {
    /// Robot and setup are inconsistent.
    #[error(transparent)]
    Setup(#[from] LeggedError),
    /// The start has no pose.
    #[error("invalid start state: {0}")]
    Start(String),
    /// Without drives, compliant constraints are not supported.
    #[error(
        "a massless leg without drives has no inertia about its hip; choose drives, \
         `constraints = \"rigid\"`, or the plant lcp"
    )]
    WithoutDrives,
    /// The tolerance is not positive.
    #[error("the tolerance is {0} m; it has to be positive")]
    Tolerance(f64),
}

/// Constant data of one leg.
#[derive(Debug, Clone)]
pub(crate) struct LegModel {
    pub(crate) name: String,
    /// Hip joint in the trunk frame, relative to the centre of mass \[m\].
    pub(crate) hip: Vector3<f64>,
    /// Inertia at a hip without a drive, which a leg without mass would lack: the first segment as
    /// a uniform rod \[kg·m²\].
    pub(crate) free_hip_inertia: f64,
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
    /// Centre of mass in the frame of the robot file's trunk \[m\].
    pub(crate) centre: Vector3<f64>,
    /// Mass of the trunk and of the parts of the legs that move with it \[kg\].
    pub(crate) mass: f64,
    /// Moments of inertia of these about the axes of the trunk \[kg·m²\].
    pub(crate) inertia: Vector3<f64>,
    /// Their inertia with its products, where the trunk has payloads; without, the products are
    /// neglected.
    pub(crate) tensor: Option<Matrix3<f64>>,
    pub(crate) legs: Vec<LegModel>,
    /// Without drives the hips turn freely and there is no cable.
    pub(crate) drives: Option<DriveModels>,
    /// Number of inputs of a leg.
    pub(crate) inputs: usize,
    pub(crate) ground: Option<Ground>,
    /// Coefficient of friction at each leg; zero without ground.
    pub(crate) friction: [f64; LEGS],
    pub(crate) method: Method,
    /// Step of the plant \[s\].
    pub(crate) step: f64,
    /// Mobility added to redundant constraints \[1/kg\].
    pub(crate) compliance: f64,
    /// Greatest length of a leg: the unit of distances \[m\].
    pub(crate) reach: f64,
    /// Weight times leg length: the unit of energies \[J\].
    pub(crate) energy_scale: f64,
}

impl Model {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, MasslessError> {
        let Options { setup, force, .. } = options;
        let selected_mounts = setup.selected_mounts(robot)?;
        // The mass of a leg beyond its lumped foot is at its hip and moves with the trunk.
        let hip_masses = selected_mounts.iter().map(|mount| {
            let mass = mount.leg.mass.total() - mount.leg.mass.lumped_foot;
            (mass, Vector3::from(mount.hip))
        });
        let payload = robot.trunk.payload();
        let loads = robot.trunk.payloads.iter().filter(|_| payload.is_some());
        let loads = loads.map(|load| (load.mass, Vector3::from(load.at)));
        let carried: Vec<(f64, Vector3<f64>)> = hip_masses.chain(loads).collect();
        let mass = robot.trunk.mass + carried.iter().map(|(m, _)| m).sum::<f64>();
        positive("trunk", mass)?;
        // A fixed trunk needs no centre of mass; its hips are where the file has them, whichever
        // legs are present.
        let centre = if setup.base == Base::Fixed {
            Vector3::zeros()
        } else {
            carried.iter().map(|(m, r)| r * *m).sum::<Vector3<f64>>() / mass
        };
        let parallel_axis = |m: f64, r: Vector3<f64>| {
            Vector3::new(
                r.y * r.y + r.z * r.z,
                r.x * r.x + r.z * r.z,
                r.x * r.x + r.y * r.y,
            ) * m
        };
        let mut inertia =
            Vector3::from(robot.trunk.inertia) + parallel_axis(robot.trunk.mass, -centre);
        for (m, r) in &carried {
            inertia += parallel_axis(*m, r - centre);
        }
        let tensor = payload.map(|_| {
            let trunk = std::iter::once((robot.trunk.mass, Vector3::zeros()));
            let bodies = trunk.chain(carried.iter().copied());
            let moments = bodies.map(|(m, r)| (r - centre) * (r - centre).transpose() * m);
            let mut tensor = -moments.sum::<Matrix3<f64>>();
            tensor.set_diagonal(&inertia);
            tensor
        });
        for (moment, axis) in inertia.iter().zip(["roll", "pitch", "yaw"]) {
            positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
        }
        let drives = setup.drive_models(robot)?;
        if drives.is_none() {
            for mount in &selected_mounts {
                let what = format!("first segment of leg {}, which no drive turns,", mount.name);
                positive(&what, mount.leg.mass.l1)?;
            }
        }
        let legs = selected_mounts
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
            tensor,
            legs,
            drives,
            inputs: setup.drives.inputs(),
            friction: [setup.ground.as_ref().map_or(0.0, |ground| ground.friction); LEGS],
            ground: setup.ground.clone(),
            method: options.method,
            step: setup.step.as_secs_f64(),
            // Nine orders of magnitude below the mobility of a foot: negligible where constraints
            // are independent, sufficient for redundant ones to share their load.
            compliance: 1e-9 / lightest.min(mass),
        })
    }
}

impl Model {
    /// Angular momentum of the trunk at this angular velocity, trunk axes \[N·m·s\].
    pub(crate) fn spin(&self, rate: &Vector3<f64>) -> Vector3<f64> {
        match &self.tensor {
            None => rate.component_mul(&self.inertia),
            Some(tensor) => tensor * rate,
        }
    }

    /// Place of the trunk's own centre of mass, trunk axes from that of the model \[m\]; none where
    /// they are the same, as with equal legs at all corners and no payload.
    pub(crate) fn centre_of_trunk(&self) -> Option<Vector3<f64>> {
        (self.centre != Vector3::zeros()).then(|| -self.centre)
    }

    /// Inertias at hip and pulley of a leg \[kg·m²\].
    pub(crate) fn drive_inertias(&self, leg: usize) -> [f64; 2] {
        match &self.drives {
            Some(drives) => drives.inertias(),
            None => [self.legs[leg].free_hip_inertia, 0.0],
        }
    }
}

impl LegModel {
    fn new(
        mount: &twinrig_robot::LegMount,
        hip: Vector3<f64>,
        force: Force,
    ) -> Result<Self, MasslessError> {
        let leg_error = LeggedError::of_leg(&mount.name);
        let mass = mount.leg.mass.lumped_foot;
        positive(&format!("lumped foot of leg {}", mount.name), mass)?;
        let pantograph = Pantograph::new(&mount.leg).map_err(&leg_error)?;
        let table = |cells| EnergyTable::new(&pantograph, cells);
        let table = match force {
            Force::Solve => None,
            Force::Lookup { cells } => Some(table(cells).map_err(&leg_error)?),
            Force::LinearLookup { cells } => {
                let linear = table(cells).and_then(EnergyTable::with_linear_forces);
                Some(linear.map_err(&leg_error)?)
            }
        };
        Ok(Self {
            name: mount.name.clone(),
            hip,
            free_hip_inertia: mount.leg.mass.l1 * mount.leg.l1 * mount.leg.l1 / 3.0,
            pantograph,
            table,
            mass,
            friction: mount.leg.joint_friction,
        })
    }
}
