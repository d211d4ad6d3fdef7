//! Servos and motors in a step.

use twinrig_actuator::PositionServo;
use twinrig_legged::LEGS;

use crate::addresses::{Clutch, LegAddresses};
use crate::engine::Engine;
use crate::inputs::{DRIVES, Inputs, LegInputs};
use crate::model::{FLYWHEEL, Model, UNLIMITED};
use crate::options::Integrator;

/// Motor in a step: its torque at the initial rate of the step, and its damping.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct MotorTerms {
    torque: f64,
    damping: f64,
}

/// Tolerance of a clutch's torque over its limit, above which the servo is saturated \[N·m\].
const TORQUE_TOLERANCE: f64 = 1e-9;

/// Parameters of the model that motors change.
#[derive(Debug, Clone, Default)]
pub(crate) struct MotorParameters {
    /// Additional inertia, and damping, of the drives of each leg.
    applied: [[[f64; 2]; DRIVES]; LEGS],
    /// Their armature and constant inertia, as compiled.
    compiled: [[[f64; 2]; DRIVES]; LEGS],
}

impl MotorParameters {
    pub(crate) fn new(engine: &Engine, legs: &[LegAddresses]) -> Self {
        let mut motor_parameters = Self::default();
        let model = engine.model();
        for (values, at) in motor_parameters.compiled.iter_mut().zip(legs) {
            let of = |dof: usize| [model.dof_armature()[dof], model.dof_m0()[dof]];
            *values = drive_dofs(at).map(|dof| dof.map_or([0.0; 2], of));
        }
        motor_parameters
    }
}

/// Torque limits of the clutches of each leg.
pub(crate) type Limits = [[f64; DRIVES]; LEGS];

/// Returns the limits of clutches of unsaturated servos.
pub(crate) fn unsaturated_limits(model: &Model) -> Limits {
    let torque = |servo: &PositionServo| servo.torque().min(UNLIMITED);
    let servos = model.servos.each_ref();
    [servos.map(|servo| servo.as_ref().map_or(UNLIMITED, torque)); LEGS]
}

/// Returns the largest torque of a servo in the direction of `torque` at a rate (thesis, eq. 2.20
/// with its clamp, solved for the torque) \[N·m\].
fn torque_limit(servo: &PositionServo, torque: f64, rate: f64) -> f64 {
    if servo.torque().is_infinite() {
        return UNLIMITED;
    }
    let share = 1.0 - torque.signum() * rate / servo.speed();
    servo.torque() * share.clamp(0.0, 1.0)
}

/// Angle and rate of a leg's drives: hip from its reference, pulley, abduction \[rad, rad/s\].
pub(crate) type DriveStates = [[f64; 2]; DRIVES];

/// Sets the flywheels to turn from the present rate of their joints to the rate that the servos
/// request for the end of the step.
pub(crate) fn set_flywheels(
    engine: &mut Engine,
    model: &Model,
    at: &LegAddresses,
    inputs: &LegInputs,
    drive_states: &DriveStates,
    seconds: f64,
) {
    let commands = inputs.commands();
    for (i, (servo, clutch)) in model.servos.iter().zip(&at.clutches).enumerate() {
        let (Some(servo), Some(clutch)) = (servo, clutch) else {
            continue;
        };
        let [position, rate] = drive_states[i];
        let next_rate = servo.rate_after(seconds, commands[i], position, rate);
        let [place, dof] = clutch.flywheel;
        let data = engine.data_mut();
        // Its angle is irrelevant and would grow without bound.
        data.qpos_mut()[place] = 0.0;
        data.qvel_mut()[dof] = rate;
        data.qfrc_applied_mut()[dof] = FLYWHEEL * (next_rate - rate) / seconds;
    }
}

/// Returns the torque of a clutch, which is that of its servo \[N·m\].
pub(crate) fn clutch_torque(engine: &Engine, clutch: &Clutch) -> f64 {
    let [_, dof] = clutch.flywheel;
    -engine.data().qfrc_constraint()[dof]
}

/// Lowers the limits of a leg's clutches whose torque exceeds that of their servos at that rate.
/// Returns whether a limit changed.
pub(crate) fn saturate(
    engine: &Engine,
    model: &Model,
    at: &LegAddresses,
    drive_states: &DriveStates,
    limits: &mut [f64; DRIVES],
) -> bool {
    let mut changed = false;
    for (i, (servo, clutch)) in model.servos.iter().zip(&at.clutches).enumerate() {
        let (Some(servo), Some(clutch)) = (servo, clutch) else {
            continue;
        };
        let torque = clutch_torque(engine, clutch);
        let available = torque_limit(servo, torque, drive_states[i][1]);
        if torque.abs() > available + TORQUE_TOLERANCE && available < limits[i] {
            limits[i] = available;
            changed = true;
        }
    }
    changed
}

/// Sets the limits of the clutches.
pub(crate) fn set_limits(engine: &mut Engine, legs: &[LegAddresses], limits: &Limits) {
    engine.set_parameters(|model| {
        let losses = model.tendon_frictionloss_mut();
        for (leg, limits) in legs.iter().zip(limits) {
            for (clutch, limit) in leg.clutches.iter().zip(limits) {
                if let Some(clutch) = clutch {
                    losses[clutch.tendon] = *limit;
                }
            }
        }
    });
}

/// Sets the motors of all legs. Damping of a motor is evaluated at the middle of the step, which
/// the forces of constraints have to take into account: it is an inertia of h c/2, with the torque
/// at the initial rate of the step. With the fourth-order method it is explicit damping.
pub(crate) fn set_motors(
    engine: &mut Engine,
    model: &Model,
    legs: &[LegAddresses],
    (inputs, drive_states): (&Inputs, &[DriveStates; LEGS]),
    seconds: f64,
    motor_parameters: &mut MotorParameters,
) {
    let mut required = motor_parameters.applied;
    for (leg, at) in legs.iter().enumerate() {
        let radius = model.legs[leg].pulley_radius;
        // The pulley is a slide with the coordinate radius times angle.
        let scale = [1.0, 1.0 / (radius * radius), 1.0];
        for (i, motor) in model.motors().into_iter().enumerate() {
            let Some(motor) = motor else { continue };
            let [first, second] = inputs[leg].of_motor(i);
            let line = motor.line(first, second);
            let explicit = model.numerics.integrator == Integrator::Rk4;
            let terms = if explicit {
                MotorTerms {
                    torque: line.torque,
                    damping: line.damping,
                }
            } else {
                MotorTerms {
                    torque: line.torque_at(drive_states[leg][i][1]),
                    damping: 0.0,
                }
            };
            let inertia = if explicit {
                0.0
            } else {
                0.5 * seconds * line.damping
            };
            required[leg][i] = [inertia * scale[i], terms.damping * scale[i]];
            if let Some(actuator) = at.actuators[i] {
                engine.data_mut().ctrl_mut()[actuator] = terms.torque;
            }
        }
    }
    if required == motor_parameters.applied {
        return;
    }
    motor_parameters.applied = required;
    let frictions = model.legs.iter().map(|leg| {
        let of_abduction = leg.abduction.map_or(0.0, |axis| axis.friction);
        [leg.friction[0], 0.0, of_abduction]
    });
    engine.set_parameters(|compiled| {
        let all = legs.iter().zip(&required).zip(&motor_parameters.compiled);
        for (((at, required), compiled_values), friction) in all.zip(frictions) {
            let of_drives = drive_dofs(at).into_iter().zip(friction);
            for (((dof, friction), [inertia, damping]), [armature, inertia_0]) in
                of_drives.zip(required).zip(compiled_values)
            {
                let Some(dof) = dof else { continue };
                compiled.dof_armature_mut()[dof] = armature + inertia;
                // For bodies of constant inertia MuJoCo reads this value and not the armature.
                compiled.dof_m0_mut()[dof] = inertia_0 + inertia;
                compiled.dof_damping_mut()[dof] = friction + damping;
            }
        }
    });
}

/// Returns the degrees of freedom of a leg's hip, pulley and abduction.
pub(crate) fn drive_dofs(at: &LegAddresses) -> [Option<usize>; DRIVES] {
    let [_, _, hip] = at.segments[0];
    [Some(hip), at.pulley, at.abduction].map(|address| address.map(|[_, dof]| dof))
}
