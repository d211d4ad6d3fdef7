//! Constant data of the plant: the robot's parameters and the ground.

use twinrig_actuator::{LegMotor, PositionServo};
use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::{
    Abduction, Base, Contacts, DriveModels, LeggedError, Posture, Segment, positive,
};
use twinrig_robot::leg::Pantograph;
use twinrig_robot::{AbductionAxis, LegMount, Payload, Robot};

use crate::inputs::DRIVES;
use crate::options::{Coordinates, MujocoError, Numerics, Options};

/// Radius of the ball that represents the contact point of a foot \[m\].
pub(crate) const FOOT_RADIUS: f64 = 1e-4;

/// Inertia of the flywheels of servos \[kg·m²\].
pub(crate) const FLYWHEEL: f64 = 1e4;

/// Torque of a clutch without a limit \[N·m\].
pub(crate) const UNLIMITED: f64 = 1e9;

/// Position of the pulleys beside the robot; legs are stacked in z \[m\].
const PULLEYS: [f64; 3] = [0.0, 1.0, 0.1];

/// Maximum number of samples of a height field.
const SAMPLES_MAX: usize = 400_000;

/// One leg.
#[derive(Debug, Clone)]
pub(crate) struct LegModel {
    pub(crate) name: String,
    /// Its name, escaped for MJCF.
    pub(crate) tag: String,
    pub(crate) pantograph: Pantograph,
    /// Position of the hip from the trunk's centre of mass, or, in a leg that abducts, from the
    /// axis of abduction in leg axes \[m\].
    pub(crate) hip: [f64; 3],
    /// Axis of abduction of a leg that abducts.
    pub(crate) abduction: Option<AbductionAxis>,
    pub(crate) segments: [Segment; 3],
    /// Viscous friction of hip, knee and ankle \[N·m·s/rad\].
    pub(crate) friction: [f64; 3],
    pub(crate) friction_on_ground: Option<f64>,
    /// Whether knee and ankle have contact with the ground.
    pub(crate) has_segment_contact: bool,
    pub(crate) l_delta: f64,
    /// Stiffness \[N/m\] and unloaded length \[m\].
    pub(crate) diagonal: [f64; 2],
    pub(crate) parallel: [f64; 2],
    pub(crate) diagonal_min: f64,
    pub(crate) diagonal_max: f64,
    pub(crate) parallel_min: f64,
    pub(crate) parallel_max: f64,
    /// q2 at the lower stop of the diagonal \[rad\].
    pub(crate) knee_min: f64,
    pub(crate) q2_ref: f64,
    pub(crate) cable_max: f64,
    pub(crate) pulley_radius: f64,
    pub(crate) pulley_position: [f64; 3],
}

/// Ground, and its representation in MuJoCo.
#[derive(Debug, Clone)]
pub(crate) struct GroundModel {
    pub(crate) ground: Ground,
    pub(crate) area: Area,
}

/// Representation of a terrain.
#[derive(Debug, Clone)]
pub(crate) enum Area {
    Flat {
        height: f64,
    },
    /// Begin, end and height of each level along x; the outer ones are unbounded \[m\].
    Levels(Vec<(f64, f64, f64)>),
    /// Samples between two corners \[m\].
    Heights {
        from: [f64; 2],
        to: [f64; 2],
        points: [usize; 2],
    },
}

/// Constant data of the plant.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) base: Base,
    pub(crate) coordinates: Coordinates,
    pub(crate) numerics: Numerics,
    /// Maximum step \[s\].
    pub(crate) step_s: f64,
    /// Mass \[kg\] and moments of inertia \[kg·m²\] of the trunk without payloads.
    pub(crate) trunk_mass: f64,
    pub(crate) trunk_inertia: [f64; 3],
    /// Payloads of the trunk.
    pub(crate) payload: Option<Payload>,
    /// Corners of the trunk, if they have contact \[m\].
    pub(crate) corners: Vec<[f64; 3]>,
    pub(crate) legs: Vec<LegModel>,
    pub(crate) drives: Option<DriveModels>,
    /// Servos of hip, knee and abduction, where these are the drives.
    pub(crate) servos: [Option<PositionServo>; DRIVES],
    /// Number of inputs of a leg's hip and knee.
    pub(crate) inputs: usize,
    pub(crate) ground: Option<GroundModel>,
    pub(crate) start: Posture,
    /// Whether a step is MuJoCo's step alone.
    pub(crate) step_only: bool,
    /// Whether servos are MuJoCo's position actuators.
    pub(crate) position_actuators: bool,
    /// Whether stops are omitted, for comparison with a reference without stops.
    pub(crate) without_stops: bool,
}

impl Model {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, MujocoError> {
        options.numerics.check()?;
        let setup = &options.setup;
        let ground = setup.ground.as_ref().map(ground_model).transpose()?;
        let mounts = setup.mounts(robot)?;
        let friction = setup.ground.as_ref().map(|ground| ground.friction);
        let legs = mounts.iter().enumerate();
        let contacts = setup.reaching_contacts(robot)?;
        let legs = legs.map(|(index, mount)| {
            let leg = LegModel::new(mount, index, friction)?;
            let leg = if setup.abduction == Abduction::Locked {
                leg
            } else {
                leg.abducting(mount)
            };
            Ok::<_, LeggedError>(LegModel {
                has_segment_contact: contacts == Contacts::All,
                ..leg
            })
        });
        if contacts != Contacts::Feet {
            setup.contact(robot)?;
        }
        let has_corners = contacts != Contacts::Feet && setup.base != Base::Fixed;
        let drives = setup.drive_models(robot)?;
        let [hip, knee] = match &drives {
            Some(DriveModels::Servos(servos)) => servos.both().map(|servo| Some(*servo)),
            _ => [None; 2],
        };
        let model = Self {
            base: setup.base,
            coordinates: options.coordinates,
            numerics: options.numerics,
            step_s: setup.step.as_secs_f64(),
            trunk_mass: robot.trunk.mass,
            trunk_inertia: robot.trunk.inertia,
            payload: robot.trunk.payload(),
            corners: if has_corners {
                robot.trunk.corners().to_vec()
            } else {
                Vec::new()
            },
            legs: legs.collect::<Result<_, _>>()?,
            drives,
            servos: [hip, knee, setup.abduction_servo(robot)?],
            inputs: setup.drives.inputs(),
            ground,
            start: setup.posture(robot)?,
            step_only: options.step_only,
            position_actuators: options.position_actuators,
            without_stops: false,
        };
        if model.position_actuators && !model.step_only {
            return Err(MujocoError::Incompatible(
                "position actuators have no account of their torque: take `step_only = true`",
            ));
        }
        if model.step_only && matches!(model.drives, Some(DriveModels::Motors(_))) {
            return Err(MujocoError::Incompatible(
                "steps of MuJoCo alone do not include motors, whose inertia changes with the step: take servos, or `step_only = \
                 false`",
            ));
        }
        check(robot, &model)?;
        Ok(model)
    }

    /// Returns the inertias of the drives of hip, knee and abduction \[kg·m²\].
    pub(crate) fn drive_inertias(&self) -> [f64; DRIVES] {
        let drives = self.drives.as_ref();
        let [hip, knee] = drives.map_or([0.0; 2], DriveModels::inertias);
        let [.., abduction] = &self.servos;
        let servo = abduction.as_ref().map(PositionServo::inertia);
        let motor = drives.and_then(DriveModels::abduction);
        let abduction = servo.or(motor.map(LegMotor::inertia));
        [hip, knee, abduction.unwrap_or(0.0)]
    }

    /// Returns the motors of hip, knee and abduction.
    pub(crate) fn motors(&self) -> [Option<LegMotor>; DRIVES] {
        match &self.drives {
            Some(DriveModels::Motors(motors)) => motors.each().map(Option::<&LegMotor>::copied),
            _ => [None; DRIVES],
        }
    }

    /// Returns the number of inputs of a drive of abduction.
    pub(crate) fn abduction_inputs(&self) -> usize {
        let [.., motor] = self.motors();
        if motor.is_some() { 2 } else { 1 }
    }

    /// Returns whether the trunk can move.
    pub(crate) fn is_free(&self) -> bool {
        self.base != Base::Fixed
    }
}

impl LegModel {
    /// Returns the moment of inertia of the stretched leg about the hip \[kg·m²\].
    pub(crate) fn hip_inertia(&self) -> f64 {
        let (mut above, mut sum) = (0.0, 0.0);
        for segment in &self.segments {
            let arm = above + segment.centre;
            sum += segment.moment + segment.mass * arm * arm;
            above += segment.length;
        }
        sum
    }

    /// Returns the moment of inertia of the stretched leg about the axis of abduction \[kg·m²\].
    pub(crate) fn abduction_inertia(&self) -> f64 {
        let [_, beside, up] = self.hip;
        let (mut above, mut sum) = (-up, 0.0);
        for segment in &self.segments {
            let arm = above + segment.centre;
            sum += segment.moment + segment.mass * (arm * arm + beside * beside);
            above += segment.length;
        }
        sum
    }

    /// Returns the same leg with its joint of abduction.
    fn abducting(mut self, mount: &LegMount) -> Self {
        self.abduction = mount.abduction_axis();
        if let Some(axis) = &self.abduction {
            let [x, y, z] = self.hip;
            let [left, up] = axis.place;
            self.hip = [x, y - left, z - up];
        }
        self
    }

    fn new(mount: &LegMount, index: usize, ground: Option<f64>) -> Result<Self, LeggedError> {
        let leg = &mount.leg;
        let pantograph = Pantograph::new(leg).map_err(LeggedError::of_leg(&mount.name))?;
        let (l2, l_delta) = (leg.l2, leg.l_delta);
        let cosine = (leg.diagonal_min * leg.diagonal_min - l2 * l2 - l_delta * l_delta)
            / (2.0 * l2 * l_delta);
        let joints = leg.joint_friction;
        let [x, y, z] = PULLEYS;
        Ok(Self {
            name: mount.name.clone(),
            tag: escaped(&mount.name),
            hip: mount.hip,
            abduction: None,
            segments: Segment::of(leg),
            friction: [joints.hip, joints.knee, joints.ankle],
            friction_on_ground: ground,
            has_segment_contact: false,
            l_delta,
            diagonal: [
                leg.diagonal.stiffness,
                pantograph.diagonal_max() + leg.diagonal.preload,
            ],
            parallel: [leg.parallel.stiffness, l2 - leg.parallel.preload],
            diagonal_min: leg.diagonal_min,
            diagonal_max: pantograph.diagonal_max(),
            parallel_min: l2,
            parallel_max: l2 + leg.parallel_travel,
            knee_min: leg.q2_ref - libm::acos(cosine),
            q2_ref: leg.q2_ref,
            cable_max: pantograph.cable_length(0.0),
            pulley_radius: leg.pulley_radius,
            pulley_position: [x, y, z * (index + 1) as f64],
            pantograph,
        })
    }
}

fn ground_model(ground: &Ground) -> Result<GroundModel, MujocoError> {
    if ground.restitution > 0.0 {
        return Err(MujocoError::Incompatible(
            "MuJoCo's contacts have no coefficient of restitution: how far a foot bounces there depends on stiffness, damping and \
             mass; take `restitution = 0`, or the plant `lcp`",
        ));
    }
    let area = match &ground.terrain {
        Terrain::Flat => Area::Flat { height: 0.0 },
        Terrain::Levels(levels) => Area::Levels(levels.levels().collect()),
        Terrain::Heights(field) => sampled(field),
    };
    Ok(GroundModel {
        ground: ground.clone(),
        area,
    })
}

/// Samples each square of the grid as finely as the maximum permits. One square beyond its border
/// the ground is level across it, and the area ends.
fn sampled(field: &HeightField) -> Area {
    let (origin, spacing, points) = field.grid();
    let squares = points.map(|count| count + 1);
    let fits = |fine: usize| (squares[0] * fine + 1) * (squares[1] * fine + 1) <= SAMPLES_MAX;
    let fine = [32, 16, 8, 4, 2].into_iter().find(|fine| fits(*fine));
    let fine = fine.unwrap_or(1);
    Area::Heights {
        from: origin.map(|x| x - spacing),
        to: [0, 1].map(|axis| origin[axis] + spacing * points[axis] as f64),
        points: squares.map(|count| count * fine + 1),
    }
}

/// Refuses parameters that MuJoCo would refuse with a less specific message.
fn check(robot: &Robot, model: &Model) -> Result<(), MujocoError> {
    if model.base != Base::Fixed {
        positive("mass of the trunk", robot.trunk.mass)?;
        for (moment, axis) in robot.trunk.inertia.iter().zip(["roll", "pitch", "yaw"]) {
            positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
        }
        let [a, b, c] = robot.trunk.inertia;
        if a + b < c || b + c < a || c + a < b {
            return Err(MujocoError::Incompatible(
                "a moment of inertia of the trunk exceeds the sum of the other two, which no body does and MuJoCo refuses; \
                 correct `inertia` in [trunk]",
            ));
        }
    }
    for leg in &model.legs {
        for (segment, which) in leg.segments.iter().zip(["first", "middle", "last"]) {
            let of = |what| format!("{what} of the {which} segment of leg {}", leg.name);
            positive(&of("mass"), segment.mass)?;
            // MuJoCo treats a smaller value as zero.
            positive(&of("moment of inertia"), segment.moment - 1e-14)?;
        }
    }
    Ok(())
}

/// Returns a name, escaped as the value of an attribute.
pub(crate) fn escaped(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        match letter {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            other => text.push(other),
        }
    }
    text
}
