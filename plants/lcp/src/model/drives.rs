//! Drives in continuous time: commanded acceleration and available torque.
//!
//! A servo imposes on its joint the acceleration of the cascade of [`PositionServo`] as long as its
//! torque suffices. Otherwise it is saturated: its torque is limited by the torque–speed line of a
//! direct-current motor, at the rate q̇ to τ clamp(1 − q̇/q̇₀, 0, 1) (thesis, eq. 2.20 with its
//! clamp, solved for the torque).
//!
//! A motor with voltage input is treated as permanently saturated: it never imposes an
//! acceleration, its torque is τ₀ − c q̇ (`twinrig_actuator::DcMotor`), and the inertia of its
//! rotor acts at the joint.

use twinrig_actuator::PositionServo;
use twinrig_legged::{DriveModels, Motors, Servos};

use crate::model::leg_constraints::DriveAction;
use crate::model::real::{Lanes, Real};

/// Commands of hip and pulley of each leg \[rad\], and direction of torque of a saturated servo:
/// −1, 0 or 1. For motors: stall torque \[N·m\], damping \[N·m·s/rad\], and always 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Commands<R> {
    /// Absolute angle of the hip.
    pub(crate) hip: R,
    pub(crate) pulley: R,
    pub(crate) hip_saturated: R,
    pub(crate) pulley_saturated: R,
    pub(crate) hip_damping: R,
    pub(crate) pulley_damping: R,
}

/// Angles \[rad\] and rates \[rad/s\] of the drives of a leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DriveCoordinates<R> {
    pub(crate) hip: R,
    pub(crate) hip_rate: R,
    pub(crate) pulley: R,
    pub(crate) pulley_rate: R,
}

/// Returns the acceleration commanded by a servo \[rad/s²\].
#[inline(always)]
pub(crate) fn commanded_acceleration<R: Real>(
    servo: &PositionServo,
    command: R,
    position: R,
    rate: R,
) -> R {
    let speed = R::splat(servo.speed());
    let error = (command - position).beyond(R::splat(servo.dead_band()));
    let target = (error * R::splat(1.0 / servo.lag())).clamped(-speed, speed);
    (target - rate) * R::splat(servo.stiffness())
}

/// Returns the torque of a saturated servo, in the direction `saturated` \[N·m\].
#[inline(always)]
pub(crate) fn saturation_torque<R: Real>(servo: &PositionServo, saturated: R, rate: R) -> R {
    if servo.torque().is_infinite() {
        return R::zero();
    }
    let share = R::splat(1.0) - saturated * rate * R::splat(1.0 / servo.speed());
    saturated * R::splat(servo.torque()) * share.clamped(R::zero(), R::splat(1.0))
}

/// Returns the torque–speed line of a saturated servo about a rate: stall torque \[N·m\] and
/// damping \[N·m·s/rad\]. Zero where the servo is not saturated.
pub(crate) fn torque_speed_line(
    servo: &PositionServo,
    saturated: Lanes,
    rate: Lanes,
) -> [Lanes; 2] {
    if servo.torque().is_infinite() {
        return [Lanes::zero(); 2];
    }
    let (zero, one) = (Lanes::zero(), Lanes::splat(1.0));
    let share = one - saturated * rate * Lanes::splat(1.0 / servo.speed());
    let has_torque = share.simd_gt(zero);
    let falls = has_torque & share.simd_lt(one);
    let torque = saturated * Lanes::splat(servo.torque());
    let damping = saturated * saturated * Lanes::splat(servo.torque() / servo.speed());
    [
        has_torque.bitselect(torque, zero),
        falls.bitselect(damping, zero),
    ]
}

/// Returns the action of the drives of a leg.
#[inline(always)]
pub(crate) fn drive_action<R: Real>(
    drives: &DriveModels,
    commands: &Commands<R>,
    coordinates: &DriveCoordinates<R>,
) -> DriveAction<R> {
    match drives {
        DriveModels::Servos(servos) => servo_action(servos, commands, coordinates),
        DriveModels::Motors(motors) => motor_action(motors, commands, coordinates),
    }
}

#[inline(always)]
fn servo_action<R: Real>(
    servos: &Servos,
    commands: &Commands<R>,
    coordinates: &DriveCoordinates<R>,
) -> DriveAction<R> {
    let Servos { hip, knee } = servos;
    let DriveCoordinates {
        hip: hip_angle,
        hip_rate,
        pulley,
        pulley_rate,
    } = *coordinates;
    let one = R::splat(1.0);
    let hip_saturated = commands.hip_saturated * commands.hip_saturated;
    let knee_saturated = commands.pulley_saturated * commands.pulley_saturated;
    let inertia = R::splat(knee.inertia());
    DriveAction {
        hip_acceleration: commanded_acceleration(hip, commands.hip, hip_angle, hip_rate),
        hip_torque: saturation_torque(hip, commands.hip_saturated, hip_rate),
        hip_inertia: hip_saturated * R::splat(hip.inertia()),
        pulley,
        pulley_rate,
        pulley_acceleration: (one - knee_saturated)
            * commanded_acceleration(knee, commands.pulley, pulley, pulley_rate)
            + saturation_torque(knee, commands.pulley_saturated, pulley_rate) / inertia,
        pulley_mobility: knee_saturated / inertia,
    }
}

#[inline(always)]
fn motor_action<R: Real>(
    motors: &Motors,
    commands: &Commands<R>,
    coordinates: &DriveCoordinates<R>,
) -> DriveAction<R> {
    let per_inertia = R::splat(1.0 / motors.knee.inertia());
    let winding = commands.pulley - commands.pulley_damping * coordinates.pulley_rate;
    DriveAction {
        hip_acceleration: R::zero(),
        hip_torque: commands.hip - commands.hip_damping * coordinates.hip_rate,
        hip_inertia: R::splat(motors.hip.inertia()),
        pulley: coordinates.pulley,
        pulley_rate: coordinates.pulley_rate,
        pulley_acceleration: winding * per_inertia,
        pulley_mobility: per_inertia,
    }
}
