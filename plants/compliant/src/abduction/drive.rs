//! Servos of the joints, and the limits of their torque.

use twinrig_legged::{abduction_entry, adopt_abduction};
use twinrig_runtime::PlantState;

use super::{AbductionJoints, JointLaw};
use crate::commands::JointCommand;
use crate::flow::AbductionState;
use crate::lanes::{Lanes, Quad};

/// Joints of all legs in a state, or their rates in a slope; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointState<T> {
    /// Angle \[rad\].
    pub angle: T,
    /// Its rate \[rad/s\].
    pub rate: T,
    /// Integral of the torque of the drive on the leg \[N·m·s\].
    pub impulse: T,
}

impl JointState<Quad> {
    /// Joints at rest at zero.
    pub const AT_REST: Self = Self {
        angle: Quad::splat(0.0),
        rate: Quad::splat(0.0),
        impulse: Quad::splat(0.0),
    };
}

impl JointState<Quad> {
    /// Returns the entries of the joints of these legs in a plant's state.
    pub fn entries<'a>(
        &'a self,
        legs: impl Iterator<Item = &'a str> + 'a,
    ) -> impl Iterator<Item = (String, Vec<f64>)> + 'a {
        legs.enumerate()
            .map(|(i, leg)| abduction_entry(leg, [self.angle.0[i], self.rate.0[i]]))
    }

    /// Adopts the entries of the joints of these legs, and adds a line for each that is missing.
    pub fn adopt<'a>(
        &mut self,
        legs: impl Iterator<Item = &'a str>,
        from: &PlantState,
        lines: &mut Vec<String>,
    ) {
        for (i, leg) in legs.enumerate() {
            [self.angle.0[i], self.rate.0[i]] = adopt_abduction(from, leg, lines);
        }
    }
}

impl<T: Copy> JointState<T> {
    /// Applies a function to all members.
    #[inline(always)]
    pub fn map<U>(&self, mut of: impl FnMut(T) -> U) -> JointState<U> {
        JointState {
            angle: of(self.angle),
            rate: of(self.rate),
            impulse: of(self.impulse),
        }
    }

    /// Applies a function to all members of some joints; `array::map` is not always inlined, and
    /// starts from no value. `any` is a value of the result.
    #[inline(always)]
    pub fn map_each<U: Copy, const A: usize>(
        joints: &[Self; A],
        any: U,
        mut of: impl FnMut(T) -> U,
    ) -> [JointState<U>; A] {
        let (angle, rate, impulse) = (any, any, any);
        let mut next = [JointState {
            angle,
            rate,
            impulse,
        }; A];
        for i in 0..A {
            next[i] = joints[i].map(&mut of);
        }
        next
    }

    /// Combines two member by member.
    #[inline(always)]
    pub fn zip<U: Copy, V>(
        &self,
        other: &JointState<U>,
        mut of: impl FnMut(T, U) -> V,
    ) -> JointState<V> {
        JointState {
            angle: of(self.angle, other.angle),
            rate: of(self.rate, other.rate),
            impulse: of(self.impulse, other.impulse),
        }
    }
}

/// Drive of the joints in one state.
#[derive(Clone, Copy)]
pub struct JointDrive<L: Lanes> {
    /// Imposed acceleration \[rad/s²\].
    pub acceleration: L,
    /// Torque of joints that turn under one \[N·m\], and which do.
    pub torque: L,
    /// See [`Self::torque`].
    pub turning: Option<L::Mask>,
    /// Torque of stops and friction \[N·m\].
    pub resistance: L,
    /// Inertia of the drives \[kg·m²\].
    pub inertia: L,
}

/// Acceleration of a joint \[rad/s²\], and torque of its drive on the leg \[N·m\].
#[derive(Debug, Clone, Copy)]
pub struct JointMotion<L> {
    /// Acceleration.
    pub acceleration: L,
    /// Torque.
    pub torque: L,
}

/// Joints of a kind at the limit of their torque.
#[derive(Debug, Clone, Copy)]
pub struct Limited<L> {
    /// Torque \[N·m\].
    pub torque: L,
    /// 1 at the greatest torque, −1 at the least, 0 for a joint that follows its command.
    pub side: L,
}

impl<L: Lanes> Limited<L> {
    /// Greatest number of rounds that determine them; two suffice but where several joints are
    /// about to reach their limits.
    pub const ROUNDS: u8 = 6;

    /// Returns no joints at their limit.
    #[inline(always)]
    pub fn none(zero: L) -> Self {
        Self {
            torque: zero,
            side: zero,
        }
    }

    /// Returns the joints that need a torque beyond its limit.
    #[inline(always)]
    pub fn beyond(torque: L, limit: L) -> Self {
        let (zero, one) = (torque.zero(), torque.like(1.0));
        let side = one.or(torque.gt(limit), (-one).or(limit.gt(torque), zero));
        Self {
            torque: limit,
            side,
        }
    }

    /// Returns whether there are such joints.
    #[inline(always)]
    pub fn any(&self) -> bool {
        self.side.any(self.side.abs().gt(self.side.zero()))
    }

    /// Returns the joints at their limit in the next round, and whether they differ: whether one is
    /// at its limit depends on the others. `beyond` has those that would need more torque, `lag` is
    /// the commanded less the present acceleration.
    #[inline(always)]
    pub fn next(&self, beyond: &Self, lag: L) -> (Self, bool) {
        let zero = lag.zero();
        let follows = zero.gt(self.side.abs() - 0.5);
        let kept = zero.or(zero.gt(lag * self.side), self.side);
        let next = Self {
            torque: beyond.torque.or(follows, self.torque),
            side: beyond.side.or(follows, kept),
        };
        let differs = (next.side - self.side).abs().gt(zero);
        (next, zero.any(differs))
    }
}

impl AbductionJoints<Quad> {
    /// Returns the motion of joints in a state.
    pub fn state(&self, joint: &JointState<Quad>) -> AbductionState {
        AbductionState {
            angle: joint.angle,
            rate: joint.rate,
            impulse: joint.impulse,
            inertia: self.inertia(),
        }
    }
}

impl<L: Lanes> AbductionJoints<L> {
    /// Returns the commanded accelerations; none without position servos.
    #[inline(always)]
    fn commanded(&self, set_point: L, joint: &JointState<L>) -> Option<L> {
        match &self.law {
            JointLaw::Servo(servo) => Some(servo.acceleration(set_point, joint.angle, joint.rate)),
            JointLaw::Free | JointLaw::Motor(_) => None,
        }
    }

    /// Returns the drive of joints in a state, some of them at the limit of their torque; joints
    /// without drives turn freely. `resistance` is the torque of stops and friction \[N·m\].
    #[inline(always)]
    pub fn drive(
        &self,
        command: &JointCommand<L>,
        joint: &JointState<L>,
        resistance: L,
        limited: Option<&Limited<L>>,
    ) -> JointDrive<L> {
        let zero = command.set_point.zero();
        let inertia = self.inertia;
        let turned = |torque| JointDrive {
            acceleration: zero,
            torque,
            turning: Some(zero.like(1.0).gt(zero)),
            resistance,
            inertia,
        };
        match &self.law {
            JointLaw::Free => turned(zero),
            JointLaw::Motor(_) => turned(command.set_point - command.damping * joint.rate),
            JointLaw::Servo(servo) => JointDrive {
                acceleration: servo.acceleration(command.set_point, joint.angle, joint.rate),
                torque: limited.map_or(zero, |limited| limited.torque),
                turning: limited.map(|limited| limited.side.abs().gt(zero)),
                resistance,
                inertia,
            },
        }
    }

    /// Returns the joints whose servos need a torque beyond its limit, if there are such servos.
    #[inline(always)]
    pub fn beyond(&self, motion: &JointMotion<L>, joint: &JointState<L>) -> Option<Limited<L>> {
        let JointLaw::Servo(servo) = &self.law else {
            return None;
        };
        if !servo.is_limited() {
            return None;
        }
        let torque = motion.torque + motion.acceleration * servo.inertia();
        Some(Limited::beyond(torque, servo.limited(torque, joint.rate)))
    }

    /// Returns the joints at their limit in the next round, and whether they differ.
    #[inline(always)]
    pub fn next(
        &self,
        limited: &Limited<L>,
        motion: &JointMotion<L>,
        command: &JointCommand<L>,
        joint: &JointState<L>,
    ) -> Option<(Limited<L>, bool)> {
        let lag = self.commanded(command.set_point, joint)? - motion.acceleration;
        Some(limited.next(&self.beyond(motion, joint)?, lag))
    }
}
