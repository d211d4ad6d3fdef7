//! Setup of the plants of a legged robot, from scenario options.

use std::sync::Arc;

use twinrig_contact::{Ground, HeightField, Levels, Patch, Terrain};
use twinrig_kernel::{Port, SimDuration, signal, stream};
use twinrig_legged::{
    Abduction, Base, Contacts, Drives, FirmwarePlace, Push, PushSchedule, PushShape, PushTarget,
    SetPoint, Setup, Signals, Start,
};
use twinrig_robot::leg::LegCommand;
use twinrig_robot::serial::SerialServo;
use twinrig_robot::{Motors, Robot, Servo};
use twinrig_scenario::{
    Abduction as SceneAbduction, ActuatorKind, Base as SceneBase, Contacts as SceneContacts,
    FirmwarePlace as SceneFirmware, Ground as SceneGround, GroundBelow, Heights, PlantSpec,
    Profile, PulseShape, PushLoad, PushSite, PushSpec, ServoOverride, SetPointKind,
};

use crate::error::BuildError;
use crate::parts::context::PlantContext;
use crate::parts::start;

/// Returns the setup of a legged plant, with the default step `step`.
///
/// # Errors
/// If the ground is invalid or the robot has no drives of the kind that the scenario requires.
pub fn setup(context: &PlantContext<'_>, step: SimDuration) -> Result<Setup, BuildError> {
    let plant = context.plant;
    let ground = plant.ground.as_ref();
    Ok(Setup {
        base: match plant.base {
            SceneBase::Free => Base::Free,
            SceneBase::Planar => Base::Planar,
            SceneBase::Fixed => Base::Fixed,
        },
        legs: context.legs.iter().map(|&leg| leg.to_owned()).collect(),
        ground: ground
            .map(|ground| terrain(ground, context.robot.friction, context.seed))
            .transpose()?,
        step: plant.step.unwrap_or(step),
        drives: drives(context)?,
        abduction: abduction(context),
        contacts: match plant.contacts {
            SceneContacts::Feet => Contacts::Feet,
            SceneContacts::Trunk => Contacts::Trunk,
            SceneContacts::All => Contacts::All,
        },
        set_point: set_point(context),
        start: start(context),
    })
}

/// Returns the ports of a plant of a legged robot, including all outputs.
///
/// # Errors
/// As [`setup`], and if a push is invalid.
pub fn legged_ports(context: &PlantContext<'_>) -> Result<Vec<Port>, BuildError> {
    let setup = setup(context, SimDuration::ZERO)?;
    let signals = Signals::new(context.legs, &setup, &|_| true);
    let pushes = pushes(context);
    let schedule = PushSchedule::new(&pushes, setup.base, context.legs, &|_| true)?;
    Ok(signals
        .ports()
        .iter()
        .chain(schedule.ports())
        .cloned()
        .collect())
}

/// Returns the pushes of the scenario.
pub fn pushes(context: &PlantContext<'_>) -> Vec<Push> {
    let push = |push: &PushSpec| Push {
        name: push.name.clone(),
        target: match (&push.on, push.load) {
            (PushSite::Foot(leg), _) => PushTarget::Foot(leg.value.clone()),
            (PushSite::Trunk, PushLoad::Force(point)) => PushTarget::Trunk(point),
            (PushSite::Trunk, PushLoad::Torque) => PushTarget::TrunkTorque,
        },
        at: push.at,
        duration: push.lasts,
        shape: match push.shape {
            PulseShape::Rectangle => PushShape::Rectangle,
            PulseShape::HalfSine => PushShape::HalfSine,
            PulseShape::Triangle => PushShape::Triangle,
        },
        peak: push.peak,
    };
    context.pushes.iter().map(push).collect()
}

/// Returns the start pose of the scenario, or else the pose of the first commands of the
/// controller.
fn start(context: &PlantContext<'_>) -> Start {
    if let Some(start) = &context.plant.start {
        return start::pose(start).into();
    }
    let legs = context.legs.iter();
    legs.filter_map(|leg| first_command(leg, context)).collect()
}

/// Returns the first command of the controller for a leg, if both drives have one.
fn first_command(leg: &str, context: &PlantContext<'_>) -> Option<(String, LegCommand)> {
    let first = |joint: &str| {
        let name = signal::command(leg, joint);
        let mut commands = context.first_commands.iter();
        commands
            .find(|(known, _)| *known == name)
            .map(|(_, value)| *value)
    };
    let command = LegCommand {
        hip: first("hip")?,
        knee: first("knee")?,
    };
    Some((leg.to_owned(), command))
}

fn drives(context: &PlantContext<'_>) -> Result<Drives, BuildError> {
    let servos = &context.robot.actuators;
    let actuator = context.actuator;
    Ok(match actuator.kind {
        ActuatorKind::None => Drives::None,
        ActuatorKind::Ideal => Drives::Ideal {
            period: context.command_period.as_secs_f64(),
        },
        ActuatorKind::Servo => Drives::Servos {
            hip: overridden(servos.hip, &actuator.hip),
            knee: overridden(servos.knee, &actuator.knee),
        },
        ActuatorKind::Motor => {
            let Motors { hip, knee } = motors(context.robot)?;
            Drives::Motors { hip, knee }
        }
        ActuatorKind::Serial => Drives::Serial {
            servo: Box::new(serial(context.robot)?),
            firmware: match actuator.firmware {
                SceneFirmware::Plant => FirmwarePlace::Plant,
                SceneFirmware::Bus => FirmwarePlace::Bus,
            },
        },
    })
}

/// Returns the joints of hip abduction, with the servos of the robot file, or serial ones.
fn abduction(context: &PlantContext<'_>) -> Abduction {
    if context.plant.abduction == SceneAbduction::Locked {
        return Abduction::Locked;
    }
    let servo = context.robot.actuators.abduction;
    match (context.actuator.kind, servo) {
        (ActuatorKind::None, _) => Abduction::Passive,
        (ActuatorKind::Ideal, _) => Abduction::Ideal {
            period: context.command_period.as_secs_f64(),
        },
        (ActuatorKind::Serial, _) => Abduction::Serial,
        (_, servo) => servo.map_or(Abduction::Passive, Abduction::Servos),
    }
}

/// Returns the course of the set-points of servos between commands.
pub(crate) fn set_point(context: &PlantContext<'_>) -> SetPoint {
    match context.actuator.set_point {
        None | Some(SetPointKind::Held) => SetPoint::Held,
        Some(SetPointKind::Linear) => SetPoint::Linear {
            period: context.command_period,
        },
    }
}

/// Returns the motors of a robot, or the error that it has none.
pub(crate) fn motors(robot: &Robot) -> Result<Motors, BuildError> {
    let why = "the robot file has no [motor.hip] and [motor.knee]: it describes its drives as servos only";
    robot.motors.ok_or_else(|| why.into())
}

/// Returns the serial servos of a robot, or the error that it has none.
fn serial(robot: &Robot) -> Result<SerialServo, BuildError> {
    robot.serial.ok_or_else(|| {
        let name = &robot.name;
        let why = format!(
            "the file of the robot {name} has no [serial]: add that with bench = \"xl330\", or \
             another bench of a servo"
        );
        why.into()
    })
}

/// Returns a servo with the parameters that the scenario overrides.
pub(crate) fn overridden(servo: Servo, by: &ServoOverride) -> Servo {
    Servo {
        lag: by.lag.unwrap_or(servo.lag),
        speed: by.speed.unwrap_or(servo.speed),
        torque: by.torque.unwrap_or(servo.torque),
        dead_band: by.dead_band.unwrap_or(servo.dead_band),
        inertia: servo.inertia,
    }
}

/// Returns the ground of a scenario for the detection of falls.
///
/// # Errors
/// If the ground is invalid.
pub(crate) fn ground_below(plant: &PlantSpec, seed: u64) -> Result<GroundBelow, BuildError> {
    // The ground of a standalone model is taken to be the plane through the origin.
    if plant.is_standalone {
        return Ok(GroundBelow::Level);
    }
    let Some(ground) = &plant.ground else {
        return Ok(GroundBelow::Nothing);
    };
    if ground.profile == Profile::Flat {
        return Ok(GroundBelow::Level);
    }
    let ground = terrain(ground, 0.0, seed)?;
    Ok(GroundBelow::Heights(Arc::new(move |x, y| {
        ground.height(x, y)
    })))
}

/// Returns the ground with the default friction coefficient `friction`.
fn terrain(ground: &SceneGround, friction: f64, seed: u64) -> Result<Ground, BuildError> {
    let terrain = match &ground.profile {
        Profile::Flat => Terrain::Flat,
        Profile::StepDown { at, height } => Terrain::step_down(*at, *height),
        Profile::Hole { at, length, height } => {
            Terrain::Levels(Levels::strip(*at, *length, -height))
        }
        Profile::Bar { at, length, height } => {
            Terrain::Levels(Levels::strip(*at, *length, *height))
        }
        Profile::Heights { spacing, heights } => Terrain::Heights(field(*spacing, heights, seed)?),
    };
    let friction = ground.friction.unwrap_or(friction);
    let patches = ground.surfaces.iter().map(|surface| Patch {
        friction: surface.friction,
        extent: surface.extent.clone(),
        begin: surface.begin,
        end: surface.end,
    });
    let plain = Ground::new(terrain, friction, ground.restitution)?;
    Ok(plain.with_patches(patches.collect())?)
}

/// Returns a height field centred at the start position.
fn field(spacing: f64, heights: &Heights, seed: u64) -> Result<HeightField, BuildError> {
    /// Cells of random ground in each direction; beyond, the border heights continue.
    const REACH: usize = 100;
    /// Half side of the level square around the start, on which the robot stands \[m\].
    const LEVEL: f64 = 0.3;
    let (columns, rows, values) = match heights {
        Heights::Given(rows) => {
            let columns = rows.first().map_or(0, Vec::len);
            (columns, rows.len(), rows.concat())
        }
        Heights::Random {
            amplitude,
            seed: ground_seed,
        } => {
            let side = 2 * REACH + 1;
            let mut stream = stream(ground_seed.unwrap_or(seed), "plant/ground/heights");
            let distance = |n: usize| spacing * n.abs_diff(REACH) as f64;
            let draw = |n: usize| {
                let height = amplitude * (2.0 * stream.unit() - 1.0);
                let far = distance(n % side).max(distance(n / side)) > LEVEL;
                if far { height } else { 0.0 }
            };
            (side, side, (0..side * side).map(draw).collect())
        }
    };
    let middle = |count: usize| -0.5 * spacing * count.saturating_sub(1) as f64;
    Ok(HeightField::new(
        [middle(columns), middle(rows)],
        spacing,
        columns,
        values,
    )?)
}
