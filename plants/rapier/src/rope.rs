//! Stops and cables as ropes.

use rapier3d_f64::dynamics::{GenericJoint, JointAxesMask, MotorModel};
use rapier3d_f64::math::{Rotation, Vector};

use crate::options::Options;

/// Index of a linear x axis in the engine's lists.
pub(crate) const LINEAR: usize = 0;

/// A gap that counts as closed \[m\].
const TOUCHING: f64 = 1e-9;

/// More than what the engine's measure of a length and ours differ by \[m\].
const ROUNDING: f64 = 1e-12;

/// A rope in a step.
pub(crate) struct Tied {
    /// How long it is in the end \[m\], and how much longer a unit of impulse makes it \[m/(N·s)\].
    pub(crate) most: f64,
    pub(crate) give: f64,
    /// Length, direction, rate.
    pub(crate) line: (f64, Vector, f64),
    /// It pulled in the last step and is still all but taut.
    pub(crate) held: bool,
    /// Of the step, and in which errors are taken back \[s\].
    pub(crate) seconds: f64,
    pub(crate) whole: f64,
    /// Attitude of the body that it begins at.
    pub(crate) upright: Rotation,
}

impl Tied {
    /// As the engine's own rope, which looks ahead: its end is not passed.
    pub(crate) fn rope(&self, joint: &mut GenericJoint, response: f64, options: &Options) {
        let softness = options.solver.joint_softness;
        joint.softness = softness.as_hard_as_in(self.seconds, self.whole);
        if self.give > 0.0 {
            // Undamped, a softness of this frequency gives so much and corrects all of an error.
            let compliance = self.give / (self.seconds * response);
            let turn = 2.0 * core::f64::consts::PI * self.seconds;
            joint.softness.natural_frequency = 1.0 / (turn * libm::sqrt(compliance));
            joint.softness.damping_ratio = 0.0;
        }
        (joint.limits[LINEAR].min, joint.limits[LINEAR].max) = (0.0, self.most);
    }

    /// As a limit along a line, since the engine has no ropes between the links of a tree. It does not look ahead either: a
    /// rope that will be taut in this step is tied to be so just at its end.
    pub(crate) fn line(&self, joint: &mut GenericJoint) {
        let (length, _, rate) = self.line;
        let gap = self.most - length;
        let ahead = gap + TOUCHING < self.seconds * rate;
        (joint.limit_axes, joint.motor_axes) = (JointAxesMask::LIN_X, JointAxesMask::empty());
        if self.give > 0.0 && (ahead || self.held || gap <= TOUCHING) {
            self.turn(joint);
            joint.limit_axes = JointAxesMask::empty();
            joint.motor_axes = JointAxesMask::LIN_X;
            let motor = &mut joint.motors[LINEAR];
            motor.model = MotorModel::ForceBased;
            motor.stiffness = 0.0;
            motor.damping = 1.0 / self.give;
            motor.target_vel = gap / self.seconds;
            motor.max_force = f64::MAX;
        } else if ahead || self.held {
            self.tie(joint);
        } else if gap <= TOUCHING {
            self.turn(joint);
            let reach = self.most.min(length - ROUNDING);
            (joint.limits[LINEAR].min, joint.limits[LINEAR].max) = (-f64::MAX, reach);
        } else {
            joint.limit_axes = JointAxesMask::empty();
            joint.limits[LINEAR].impulse = 0.0;
        }
    }

    /// Lets the joint's x axis lie along the rope.
    fn turn(&self, joint: &mut GenericJoint) {
        let along = Rotation::from_rotation_arc(Vector::X, self.line.1);
        joint.local_frame1.rotation = self.upright.inverse() * along;
    }

    /// As long as it can be in the end, neither more nor less: both limits count, since each is reached.
    fn tie(&self, joint: &mut GenericJoint) {
        self.turn(joint);
        // The engine measures the length anew and may round it to either side.
        let length = self.line.0;
        let limits = &mut joint.limits[LINEAR];
        if self.most >= length {
            (limits.min, limits.max) = (self.most.max(length + ROUNDING), length - ROUNDING);
        } else {
            (limits.min, limits.max) = (length + ROUNDING, self.most.min(length - ROUNDING));
        }
    }
}
