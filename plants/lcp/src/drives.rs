//! The drives in continuous time: what acceleration they want, and what torque they have for it.
//!
//! A motor gives its joint the acceleration that the cascade of [`PositionServo`] asks for, as long as it has the torque for
//! it; else its torque is all it has, which the line of a direct-current motor limits: at the rate q̇ it pushes with at
//! most τ clamp(1 − q̇/q̇₀, 0, 1) (thesis, eq. 2.20 with its clamp, solved for the torque).

use twinrig_actuator::PositionServo;

use crate::hold::Driven;
use crate::real::Real;

/// What hip and pulley of each leg are told \[rad\], and which way a motor that is used up pushes: −1, 0 or 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Commands<R> {
    /// The hip's absolute angle.
    pub(crate) hip: R,
    pub(crate) pulley: R,
    pub(crate) hip_spent: R,
    pub(crate) pulley_spent: R,
}

/// Acceleration that a servo asks for \[rad/s²\].
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn wanted<R: Real>(servo: &PositionServo, command: R, position: R, rate: R) -> R {
    let speed = R::splat(servo.speed());
    let error = (command - position).beyond(R::splat(servo.dead_band()));
    let target = (error * R::splat(1.0 / servo.lag())).clamped(-speed, speed);
    (target - rate) * R::splat(servo.stiffness())
}

/// Torque of a motor that is used up, in the direction `spent` \[N·m\].
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn greatest<R: Real>(servo: &PositionServo, spent: R, rate: R) -> R {
    if servo.torque().is_infinite() {
        return R::zero();
    }
    let share = R::splat(1.0) - spent * rate * R::splat(1.0 / servo.speed());
    spent * R::splat(servo.torque()) * share.clamped(R::zero(), R::splat(1.0))
}

/// What the drives of a leg do.
#[inline(always)]
#[allow(clippy::inline_always)]
pub(crate) fn driven<R: Real>(
    hip: &PositionServo,
    knee: &PositionServo,
    commands: &Commands<R>,
    hip_angle: R,
    hip_rate: R,
    pulley: R,
    pulley_rate: R,
) -> Driven<R> {
    let one = R::splat(1.0);
    let hip_spent = commands.hip_spent * commands.hip_spent;
    let knee_spent = commands.pulley_spent * commands.pulley_spent;
    let inertia = R::splat(knee.inertia());
    Driven {
        hip_acceleration: wanted(hip, commands.hip, hip_angle, hip_rate),
        hip_torque: greatest(hip, commands.hip_spent, hip_rate),
        hip_inertia: hip_spent * R::splat(hip.inertia()),
        pulley,
        pulley_rate,
        pulley_acceleration: (one - knee_spent)
            * wanted(knee, commands.pulley, pulley, pulley_rate)
            + greatest(knee, commands.pulley_spent, pulley_rate) / inertia,
        pulley_mobility: knee_spent / inertia,
    }
}
