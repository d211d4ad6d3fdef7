//! The drives in continuous time: what acceleration they want, and what torque they have for it.
//!
//! A motor gives its joint the acceleration that the cascade of [`PositionServo`] asks for, as long as it has the torque for
//! it; else its torque is all it has, which the line of a direct-current motor limits: at the rate q̇ it pushes with at
//! most τ clamp(1 − q̇/q̇₀, 0, 1) (thesis, eq. 2.20 with its clamp, solved for the torque).
//!
//! A motor that is given a voltage is one that is used up for good: it never imposes an acceleration, and its torque is
//! τ₀ − c q̇ (`twinrig_actuator::DcMotor`), with its rotor's inertia at the joint.

use twinrig_actuator::PositionServo;
use twinrig_legged::{Fitted, Motors, Servos};

use crate::constraints::Driven;
use crate::real::{Lanes, Real};

/// What hip and pulley of each leg are told \[rad\], and which way a motor that is used up pushes: −1, 0 or 1. Where the
/// drives are motors: their torques at standstill \[N·m\], what damps them \[N·m·s/rad\], and always 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Commands<R> {
    /// The hip's absolute angle.
    pub(crate) hip: R,
    pub(crate) pulley: R,
    pub(crate) hip_saturated: R,
    pub(crate) pulley_saturated: R,
    pub(crate) hip_damping: R,
    pub(crate) pulley_damping: R,
}

/// Where a leg's drives are, and how fast they turn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turned<R> {
    pub(crate) hip: R,
    pub(crate) hip_rate: R,
    pub(crate) pulley: R,
    pub(crate) pulley_rate: R,
}

/// Acceleration that a servo asks for \[rad/s²\].
#[inline(always)]
pub(crate) fn wanted<R: Real>(servo: &PositionServo, command: R, position: R, rate: R) -> R {
    let speed = R::splat(servo.speed());
    let error = (command - position).beyond(R::splat(servo.dead_band()));
    let target = (error * R::splat(1.0 / servo.lag())).clamped(-speed, speed);
    (target - rate) * R::splat(servo.stiffness())
}

/// Torque of a motor that is used up, in the direction `saturated` \[N·m\].
#[inline(always)]
pub(crate) fn greatest<R: Real>(servo: &PositionServo, saturated: R, rate: R) -> R {
    if servo.torque().is_infinite() {
        return R::zero();
    }
    let share = R::splat(1.0) - saturated * rate * R::splat(1.0 / servo.speed());
    saturated * R::splat(servo.torque()) * share.clamped(R::zero(), R::splat(1.0))
}

/// The line through the torque of a motor that is used up, about a rate: torque at standstill \[N·m\], and what it falls by
/// with the rate \[N·m·s/rad\]. Zero where no motor is used up.
pub(crate) fn line(servo: &PositionServo, saturated: Lanes, rate: Lanes) -> [Lanes; 2] {
    if servo.torque().is_infinite() {
        return [Lanes::zero(); 2];
    }
    let (zero, one) = (Lanes::zero(), Lanes::splat(1.0));
    let share = one - saturated * rate * Lanes::splat(1.0 / servo.speed());
    let pushes = share.simd_gt(zero);
    let falls = pushes & share.simd_lt(one);
    let torque = saturated * Lanes::splat(servo.torque());
    let damping = saturated * saturated * Lanes::splat(servo.torque() / servo.speed());
    [
        pushes.bitselect(torque, zero),
        falls.bitselect(damping, zero),
    ]
}

/// What the drives of a leg do.
#[inline(always)]
pub(crate) fn driven<R: Real>(
    drives: &Fitted,
    commands: &Commands<R>,
    turned: &Turned<R>,
) -> Driven<R> {
    match drives {
        Fitted::Servos(servos) => served(servos, commands, turned),
        Fitted::Motors(motors) => powered(motors, commands, turned),
    }
}

#[inline(always)]
fn served<R: Real>(servos: &Servos, commands: &Commands<R>, turned: &Turned<R>) -> Driven<R> {
    let Servos { hip, knee } = servos;
    let Turned {
        hip: hip_angle,
        hip_rate,
        pulley,
        pulley_rate,
    } = *turned;
    let one = R::splat(1.0);
    let hip_saturated = commands.hip_saturated * commands.hip_saturated;
    let knee_saturated = commands.pulley_saturated * commands.pulley_saturated;
    let inertia = R::splat(knee.inertia());
    Driven {
        hip_acceleration: wanted(hip, commands.hip, hip_angle, hip_rate),
        hip_torque: greatest(hip, commands.hip_saturated, hip_rate),
        hip_inertia: hip_saturated * R::splat(hip.inertia()),
        pulley,
        pulley_rate,
        pulley_acceleration: (one - knee_saturated)
            * wanted(knee, commands.pulley, pulley, pulley_rate)
            + greatest(knee, commands.pulley_saturated, pulley_rate) / inertia,
        pulley_mobility: knee_saturated / inertia,
    }
}

#[inline(always)]
fn powered<R: Real>(motors: &Motors, commands: &Commands<R>, turned: &Turned<R>) -> Driven<R> {
    let per_inertia = R::splat(1.0 / motors.knee.inertia());
    let winding = commands.pulley - commands.pulley_damping * turned.pulley_rate;
    Driven {
        hip_acceleration: R::zero(),
        hip_torque: commands.hip - commands.hip_damping * turned.hip_rate,
        hip_inertia: R::splat(motors.hip.inertia()),
        pulley: turned.pulley,
        pulley_rate: turned.pulley_rate,
        pulley_acceleration: winding * per_inertia,
        pulley_mobility: per_inertia,
    }
}
