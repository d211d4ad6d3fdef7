//! What the joints carried in the last step, given to the bodies before the engine sweeps over the next.
//!
//! The engine sweeps over its constraints one by one and stops after so many times; where light segments hang on a heavy
//! trunk, hundreds of sweeps are not enough to find what the joints carry. Its own warm start (`warmstart_joints`) does not
//! help: it gives each constraint its last impulse just before it solves that same constraint, which takes it away again,
//! so that for joints without give nothing is left of it. So what the joints carried is found from what the bodies did,
//! given to them as forces, and the engine is left to find what has changed.

use rapier3d_f64::math::Vector;
use twinrig_robot::GRAVITY;

use crate::model::TRUNK;
use crate::robot::{Machine, View};
use crate::step::Before;

impl Machine {
    /// Pushes the bodies as the joints did in the last step.
    pub(crate) fn carry(&mut self, leg: usize, view: &View, share: f64) {
        for k in 0..3 {
            let force = Vector::from_array(self.state.legs[leg].carried[k]) * share;
            let [above, below] = self.arms(leg, k, view);
            let upper = if k == 0 { TRUNK } else { k - 1 };
            let handles = &self.handles.legs[leg];
            let [lower, upper] = [k, upper].map(|body| handles.body(self.handles.trunk, body));
            self.push_body(lower, force, below.cross(force), false);
            self.push_body(upper, -force, -above.cross(force), false);
        }
    }

    /// A joint seen from the bodies above and below it.
    fn arms(&self, leg: usize, k: usize, view: &View) -> [Vector; 2] {
        let parts = &self.model.legs[leg];
        let down = |body: usize, along: f64| {
            view.bodies[body].pose.rotation * Vector::new(0.0, 0.0, -along)
        };
        let below = down(k, -parts.segments[k].centre);
        let above = if k == 0 {
            view.bodies[TRUNK].pose.rotation * parts.hip
        } else {
            let upper = &parts.segments[k - 1];
            down(k - 1, upper.length - upper.centre)
        };
        [above, below]
    }

    /// Finds what the joints carried: what moved the bodies beside all that is known.
    pub(crate) fn weigh(
        &mut self,
        leg: usize,
        before: &Before,
        view: &View,
        seconds: f64,
        share: f64,
    ) {
        let (mut force, mut torque) = ([Vector::ZERO; 4], [Vector::ZERO; 4]);
        for k in 0..3 {
            [force[k], torque[k]] = self.unexplained(leg, k, before, view, seconds, share);
        }
        let mut known = |body: usize, arm: Vector, impulse: Vector| {
            force[body] -= impulse;
            torque[body] -= arm.cross(impulse);
        };
        let parts = &self.model.legs[leg];
        let state = &self.state.legs[leg];
        for (rope, pull) in parts.ropes.iter().zip(state.pulls) {
            let (_, along, _) = before.view.line(&rope.ends);
            let pull = along * (pull * share * seconds);
            for (end, impulse) in rope.ends.iter().zip([pull, -pull]) {
                known(end.body, before.view.bodies[end.body].pose.rotation * end.at, impulse);
            }
        }
        if let Some([foot, floor]) = self.handles.legs[leg].contact
            && let Some((normal, along)) = self.impulse_on(foot, floor)
        {
            let arm = before.view.bodies[2].pose.rotation * parts.foot.at;
            known(2, arm, normal + along);
        }
        torque[0] -= before.view.axis() * self.hip_impulse(leg);
        let axis = before.view.axis();
        let mut lower = (Vector::ZERO, Vector::ZERO);
        for k in (0..3).rev() {
            if k < 2 {
                let [above, _] = self.arms(leg, k + 1, &before.view);
                force[k] += lower.0;
                torque[k] += lower.1 + above.cross(lower.0);
            }
            let [_, below] = self.arms(leg, k, &before.view);
            let turning = torque[k] - below.cross(force[k]);
            // A joint carries nothing about its own axis.
            lower = (force[k], turning - axis * axis.dot(turning));
            let by = 1.0 / (share * seconds);
            let across = axis * axis.dot(lower.0);
            self.state.legs[leg].carried[k] = ((lower.0 - across) * by).to_array();
        }
    }

    /// Impulses on a segment beside gravity and the forces that we gave it, but for those of its joints.
    fn unexplained(
        &self,
        leg: usize,
        k: usize,
        before: &Before,
        view: &View,
        seconds: f64,
        share: f64,
    ) -> [Vector; 2] {
        let segment = &self.model.legs[leg].segments[k];
        let (then, now) = (&before.view.bodies[k], &view.bodies[k]);
        let along = self.options.axial_share * segment.moment;
        let inertia = Vector::new(segment.moment, segment.moment, along);
        let turned = then.pose.rotation.inverse() * (now.turning - then.turning);
        let weight = Vector::new(0.0, 0.0, -GRAVITY * segment.mass * share);
        let [force, torque] = before.given[k];
        [
            (now.velocity - then.velocity) * segment.mass - (force + weight) * seconds,
            then.pose.rotation * (inertia * turned) - torque * seconds,
        ]
    }
}
