//! What servos and motors do in a step.

use twinrig_actuator::PositionServo;
use twinrig_legged::{LEGS, Motors, Servos};

use crate::addresses::{Address, LegAddresses};
use crate::engine::Engine;
use crate::model::{FLYWHEEL, Model, UNLIMITED};
use crate::options::Integrator;

/// What a leg's drives are given, as the ports have it: commands of hip and knee \[rad\], or voltage \[V\] and bridge of both.
pub(crate) type Inputs = [[f64; 4]; LEGS];

/// A motor for a step: its torque at the rate at which the step begins, and what its torque loses with the rate.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Winding {
    torque: f64,
    damping: f64,
}

/// A servo turned at so much more than its clutch may transmit \[N·m\].
const BEYOND: f64 = 1e-9;

/// What the model's parameters are set to for motors.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tuned {
    /// Extra inertia, and damping, of hip and pulley of each leg.
    wanted: [[[f64; 2]; 2]; LEGS],
    /// Armature and inertia at rest of both, as they were compiled.
    rest: [[[f64; 2]; 2]; LEGS],
}

impl Tuned {
    pub(crate) fn new(engine: &Engine, legs: &[LegAddresses]) -> Self {
        let mut tuned = Self::default();
        let model = engine.model();
        for (rest, at) in tuned.rest.iter_mut().zip(legs) {
            let (hip, pulley) = driven(at);
            *rest = [hip, pulley.unwrap_or(hip)]
                .map(|dof| [model.dof_armature()[dof], model.dof_m0()[dof]]);
        }
        tuned
    }
}

/// Torques that clutches may transmit, hip and knee of each leg.
pub(crate) type Limits = [[f64; 2]; LEGS];

/// The limits that clutches have while nothing is used up.
pub(crate) fn unsaturated(servos: &Servos) -> Limits {
    [servos.both().map(|servo| servo.torque().min(UNLIMITED)); LEGS]
}

/// Most that a servo gives in the direction of a torque at a rate (thesis, eq. 2.20 with its clamp, solved for the torque) \[N·m\].
fn greatest(servo: &PositionServo, torque: f64, rate: f64) -> f64 {
    if servo.torque().is_infinite() {
        return UNLIMITED;
    }
    let share = 1.0 - torque.signum() * rate / servo.speed();
    servo.torque() * share.clamp(0.0, 1.0)
}

/// Angle and rate of what a leg's drives turn: hip from its reference, pulley \[rad, rad/s\].
pub(crate) type Turned = [[f64; 2]; 2];

/// Lets the flywheels turn as the servos want: from the rate that a joint has to the one that its servo wants it to have at
/// the end of the step.
pub(crate) fn spin(
    engine: &mut Engine,
    flywheels: &[Address; 2],
    servos: &Servos,
    commands: &[f64],
    turned: &Turned,
    seconds: f64,
) {
    for (i, servo) in servos.both().into_iter().enumerate() {
        let [position, rate] = turned[i];
        let then = servo.rate_after(seconds, commands[i], position, rate);
        let [place, dof] = flywheels[i];
        let data = engine.data_mut();
        // Its angle means nothing, and would only grow.
        data.qpos_mut()[place] = 0.0;
        data.qvel_mut()[dof] = rate;
        data.qfrc_applied_mut()[dof] = FLYWHEEL * (then - rate) / seconds;
    }
}

/// Torque of a leg's clutches, which is what its servos give \[N·m\].
pub(crate) fn transmitted(engine: &Engine, flywheels: &[Address; 2]) -> [f64; 2] {
    flywheels.map(|[_, dof]| -engine.data().qfrc_constraint()[dof])
}

/// Lowers the limits of clutches that transmit more than their servos have at that rate; says whether there were some.
pub(crate) fn saturate(
    servos: &Servos,
    torques: &[f64; 2],
    turned: &Turned,
    limits: &mut [f64; 2],
) -> bool {
    let mut news = false;
    for (i, servo) in servos.both().into_iter().enumerate() {
        let most = greatest(servo, torques[i], turned[i][1]);
        if torques[i].abs() > most + BEYOND && most < limits[i] {
            limits[i] = most;
            news = true;
        }
    }
    news
}

/// Sets the clutches' limits.
pub(crate) fn limit(engine: &mut Engine, legs: &[LegAddresses], limits: &Limits) {
    engine.retune(|model| {
        let losses = model.tendon_frictionloss_mut();
        for (leg, limits) in legs.iter().zip(limits) {
            for (clutch, limit) in leg.clutches.iter().flatten().zip(limits) {
                losses[*clutch] = *limit;
            }
        }
    });
}

/// Sets the motors of all legs. What damps a motor is taken at the middle of the step, which the forces of constraints have
/// to know: so it is an inertia of h c/2, and the torque that of the rate at the step's begin. The method of fourth order
/// takes it as the damping that it is.
pub(crate) fn power(
    engine: &mut Engine,
    model: &Model,
    legs: &[LegAddresses],
    (motors, inputs, turned): (&Motors, &Inputs, &[Turned; LEGS]),
    seconds: f64,
    tuned: &mut Tuned,
) {
    let mut wanted = tuned.wanted;
    for (leg, at) in legs.iter().enumerate() {
        let radius = model.legs[leg].pulley_radius;
        // The pulley is a slide at its radius.
        let per = [1.0, 1.0 / (radius * radius)];
        for (i, motor) in motors.both().into_iter().enumerate() {
            let [voltage, bridge] = [inputs[leg][2 * i], inputs[leg][2 * i + 1]];
            let line = motor.line(voltage, bridge);
            let explicit = model.numerics.integrator == Integrator::Rk4;
            let winding = if explicit {
                Winding {
                    torque: line.torque,
                    damping: line.damping,
                }
            } else {
                Winding {
                    torque: line.torque_at(turned[leg][i][1]),
                    damping: 0.0,
                }
            };
            let inertia = if explicit {
                0.0
            } else {
                0.5 * seconds * line.damping
            };
            wanted[leg][i] = [inertia * per[i], winding.damping * per[i]];
            if let Some(actuators) = at.motors {
                engine.data_mut().ctrl_mut()[actuators[i]] = winding.torque;
            }
        }
    }
    if wanted == tuned.wanted {
        return;
    }
    tuned.wanted = wanted;
    let frictions = model.legs.iter().map(|leg| leg.friction[0]);
    engine.retune(|compiled| {
        let all = legs.iter().zip(&wanted).zip(&tuned.rest);
        for (((at, wanted), rest), friction) in all.zip(frictions) {
            let (hip, pulley) = driven(at);
            let dofs = [Some((hip, friction)), pulley.map(|pulley| (pulley, 0.0))];
            for ((dof, [inertia, damping]), [armature, whole]) in
                dofs.into_iter().zip(wanted).zip(rest)
            {
                let Some((dof, friction)) = dof else { continue };
                compiled.dof_armature_mut()[dof] = armature + inertia;
                // Of bodies whose inertia is always the same MuJoCo takes this and does not look again.
                compiled.dof_m0_mut()[dof] = whole + inertia;
                compiled.dof_damping_mut()[dof] = friction + damping;
            }
        }
    });
}

/// The velocities that the drives of a leg turn: the hip's, the pulley's.
pub(crate) fn driven(at: &LegAddresses) -> (usize, Option<usize>) {
    let [_, _, [_, hip]] = at.segments[0];
    (hip, at.pulley.map(|[_, dof]| dof))
}
