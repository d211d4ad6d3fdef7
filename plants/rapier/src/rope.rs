//! Stops and cables as ropes.

use rapier3d_f64::dynamics::{GenericJoint, JointAxesMask, MotorModel};
use rapier3d_f64::math::{Rotation, Vector};

use crate::options::Options;

/// Index of the linear x axis in the engine's lists.
pub(crate) const LINEAR: usize = 0;

/// Largest gap of a taut rope \[m\].
const TAUT_GAP: f64 = 1e-9;

/// Bound of the rounding difference between the engine's and this crate's measure of a length
/// \[m\].
const ROUNDING: f64 = 1e-12;

/// Data of a rope for a step.
pub(crate) struct RopeStep {
    /// Maximum length at the end of the step \[m\], and its increase per unit of impulse
    /// \[m/(N·s)\].
    pub(crate) max_length: f64,
    pub(crate) compliance: f64,
    /// Length, direction, rate.
    pub(crate) line: (f64, Vector, f64),
    /// It pulled in the last step and is still taut to within a tolerance.
    pub(crate) active: bool,
    /// Length of the step, and correction interval \[s\].
    pub(crate) seconds: f64,
    pub(crate) correction_seconds: f64,
    /// Attitude of the body of the first end.
    pub(crate) attitude: Rotation,
}

impl RopeStep {
    /// Configures the engine's own rope, which looks ahead: its limit is not exceeded.
    pub(crate) fn as_rope(&self, joint: &mut GenericJoint, response: f64, options: &Options) {
        let softness = options.solver.joint_softness;
        joint.softness = softness.as_stiff_as_in(self.seconds, self.correction_seconds);
        if self.compliance > 0.0 {
            // An undamped softness of this frequency has this compliance and corrects the whole
            // error.
            let relative_compliance = self.compliance / (self.seconds * response);
            let turn = 2.0 * core::f64::consts::PI * self.seconds;
            joint.softness.natural_frequency = 1.0 / (turn * libm::sqrt(relative_compliance));
            joint.softness.damping_ratio = 0.0;
        }
        (joint.limits[LINEAR].min, joint.limits[LINEAR].max) = (0.0, self.max_length);
    }

    /// Configures a limit along the line, since the engine has no ropes between the links of a
    /// tree. The limit has no look-ahead: a rope that becomes taut in this step is fixed to be taut
    /// exactly at its end.
    pub(crate) fn as_limit(&self, joint: &mut GenericJoint) {
        let (length, _, rate) = self.line;
        let gap = self.max_length - length;
        let becomes_taut = gap + TAUT_GAP < self.seconds * rate;
        (joint.limit_axes, joint.motor_axes) = (JointAxesMask::LIN_X, JointAxesMask::empty());
        if self.compliance > 0.0 && (becomes_taut || self.active || gap <= TAUT_GAP) {
            self.align(joint);
            joint.limit_axes = JointAxesMask::empty();
            joint.motor_axes = JointAxesMask::LIN_X;
            let motor = &mut joint.motors[LINEAR];
            motor.model = MotorModel::ForceBased;
            motor.stiffness = 0.0;
            motor.damping = 1.0 / self.compliance;
            motor.target_vel = gap / self.seconds;
            motor.max_force = f64::MAX;
        } else if becomes_taut || self.active {
            self.fix_length(joint);
        } else if gap <= TAUT_GAP {
            self.align(joint);
            let limit = self.max_length.min(length - ROUNDING);
            (joint.limits[LINEAR].min, joint.limits[LINEAR].max) = (-f64::MAX, limit);
        } else {
            joint.limit_axes = JointAxesMask::empty();
            joint.limits[LINEAR].impulse = 0.0;
        }
    }

    /// Aligns the joint's x axis with the rope.
    fn align(&self, joint: &mut GenericJoint) {
        let along = Rotation::from_rotation_arc(Vector::X, self.line.1);
        joint.local_frame1.rotation = self.attitude.inverse() * along;
    }

    /// Fixes the length at the end of the step: both limits are active, since each is reached.
    fn fix_length(&self, joint: &mut GenericJoint) {
        self.align(joint);
        // The engine measures the length anew and may round it in either direction.
        let length = self.line.0;
        let limits = &mut joint.limits[LINEAR];
        if self.max_length >= length {
            (limits.min, limits.max) = (self.max_length.max(length + ROUNDING), length - ROUNDING);
        } else {
            (limits.min, limits.max) = (length + ROUNDING, self.max_length.min(length - ROUNDING));
        }
    }
}
