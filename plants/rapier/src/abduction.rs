//! Joints of abduction over a step of the engine: their servo, friction and stops.
//!
//! The carrier of a leg is on a hinge of the engine, whose limits are the stops; they become active
//! only after they have been exceeded.

use rapier3d_f64::math::Vector;

use crate::assembly::ABDUCTION;
use crate::conversion::ANGULAR;
use crate::drives::{Effort, Kind, StepTiming};
use crate::model::TRUNK;
use crate::robot::{Machine, View};

/// A joint at the beginning of a step.
#[derive(Clone, Copy)]
pub(crate) struct JointStart {
    /// Rate \[rad/s\].
    rate: f64,
    /// Viscous friction \[N·m·s/rad\].
    friction: f64,
    /// Action of the servo, if there is one.
    effort: Option<Effort>,
}

impl Machine {
    /// Returns angle and rate of a leg's carrier relative to the trunk \[rad, rad/s\].
    fn carrier_motion(&self, view: &View) -> [f64; 2] {
        let (trunk, carrier) = (self.trunk(), &view.bodies[TRUNK]);
        let relative = trunk.pose.rotation.inverse() * carrier.pose.rotation;
        let axis = trunk.pose.rotation * ABDUCTION;
        let rate = (carrier.turning - trunk.turning).dot(axis);
        [2.0 * libm::atan(relative.x / relative.w), rate]
    }

    /// Returns the joint of a leg that abducts.
    pub(crate) fn joint_start(
        &self,
        leg: usize,
        view: &View,
        timing: StepTiming,
    ) -> Option<JointStart> {
        let carrier = self.model.legs[leg].carrier.as_ref()?;
        let servo = self.model.abduction.as_ref().map(Kind::Servo);
        let [_, rate] = self.carrier_motion(view);
        Some(JointStart {
            rate,
            friction: carrier.axis.friction,
            effort: servo.map(|servo| self.state.legs[leg].abduction.effort(servo, timing)),
        })
    }

    /// Returns whether a joint is at a stop, or would pass one by the end of the step.
    pub(crate) fn stops(&self, leg: usize, seconds: f64) -> bool {
        let Some(carrier) = &self.model.legs[leg].carrier else {
            return false;
        };
        let [least, greatest] = carrier.axis.range;
        let [angle, rate] = self.carrier_motion(&self.view(leg));
        let next = angle + seconds * rate;
        angle.min(next) < least || angle.max(next) > greatest
    }

    /// Applies friction, over the interval of forces, and sets the motor of the servo. The first
    /// leg resets the forces on the trunk.
    pub(crate) fn prepare_joint(&mut self, leg: usize, start: &JointStart, timing: StepTiming) {
        let Some(handles) = self.handles.legs[leg].carrier else {
            return;
        };
        let share = timing.force_seconds / timing.seconds;
        let axis = self.trunk().pose.rotation * ABDUCTION;
        let torque = axis * (share * start.friction * start.rate);
        self.add_force_to(handles.body, Vector::ZERO, -torque, false);
        self.add_force_to(self.handles.trunk, Vector::ZERO, torque, leg == 0);
        if let Some(effort) = start.effort {
            self.set_motor(handles.drive, effort, timing);
        }
    }

    /// Reads the results of the step.
    pub(crate) fn finish_joint(
        &mut self,
        leg: usize,
        start: &JointStart,
        view: &View,
        timing: StepTiming,
    ) {
        let Some(handles) = self.handles.legs[leg].carrier else {
            return;
        };
        let [angle, rate] = self.carrier_motion(view);
        let hinge = self.world.sets.impulse_joints.get(handles.hinge);
        let stop = hinge.map_or(0.0, |hinge| hinge.data.limits[ANGULAR].impulse);
        let delivered = self.motor_impulse(handles.drive) / timing.force_seconds;
        let share = timing.force_seconds / timing.seconds;
        let (state, ledger) = (&mut self.state.legs[leg], &mut self.state.ledger);
        let before = state.abduction;
        ledger.dissipated += share * start.friction * start.rate * (angle - before.angle);
        ledger.impact += 0.5 * stop * (start.rate + rate);
        let drive = &mut state.abduction;
        if let (Some(servo), Some(effort)) = (&self.model.abduction, start.effort) {
            drive.finish(Kind::Servo(servo), effort, angle, delivered, timing);
            ledger.actuator +=
                drive.torque * timing.force_seconds * 0.5 * (before.rate + drive.rate);
        } else {
            (drive.angle, drive.rate) = (angle, rate);
        }
    }
}
