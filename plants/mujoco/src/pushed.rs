//! Forces of pushes on trunk and feet, held at their mean over a step.

use nalgebra::Vector3;
use twinrig_legged::StepLoad;

use crate::flow::Flow;
use crate::push_load::{PushLoad, Pushed};

impl Flow {
    /// Sets the load of the next step.
    pub(crate) fn set_push_load(&mut self, load: &StepLoad) {
        if !self.push_load.load.is_empty() {
            self.engine.data_mut().xfrc_applied_mut().fill([0.0; 6]);
        }
        self.push_load.load.copy_from(load);
        self.push_load.forces = None;
    }

    /// Applies the forces of pushes on the bodies of the engine, in the present pose.
    pub(crate) fn push(&mut self, seconds: f64) {
        if self.push_load.load.is_empty() {
            return;
        }
        let load = self.push_load.load.mean(0.0, seconds);
        let rotation = self.trunk.rotation;
        let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[(i, j)]));
        let [.., roll, pitch, yaw] = load.wrench(&rows, |value| value);
        let pushed = Pushed {
            force: load.force.into(),
            torque: rotation * Vector3::new(roll, pitch, yaw),
            feet: load.feet.map(Vector3::from),
        };
        let trunk = self.at.trunk_body;
        self.apply(trunk, self.trunk.position, pushed.force, pushed.torque);
        for leg in 0..self.model.legs.len() {
            let ([foot, _], body) = (self.foot(leg), self.at.legs[leg].foot_body);
            self.apply(body, foot, pushed.feet[leg], Vector3::zeros());
        }
        self.push_load.forces = Some(pushed);
    }

    /// Applies a force at a place, and a torque, on a body of the engine.
    fn apply(
        &mut self,
        body: usize,
        place: Vector3<f64>,
        force: Vector3<f64>,
        torque: Vector3<f64>,
    ) {
        let data = self.engine.data_mut();
        let centre = Vector3::from(data.xipos()[body]);
        let torque = torque + (place - centre).cross(&force);
        let [[x, y, z], [roll, pitch, yaw]]: [[f64; 3]; 2] = [force.into(), torque.into()];
        data.xfrc_applied_mut()[body] = [x, y, z, roll, pitch, yaw];
    }

    /// Forgets the load, of which a restored state of the engine may have the forces.
    pub(crate) fn forget_pushes(&mut self) {
        self.engine.data_mut().xfrc_applied_mut().fill([0.0; 6]);
        self.push_load = PushLoad::default();
    }

    /// Returns the power of pushes at the present velocities \[W\].
    pub(crate) fn push_power(&self) -> f64 {
        let Some(pushed) = &self.push_load.forces else {
            return 0.0;
        };
        let trunk = &self.trunk;
        let turning = trunk.rotation * trunk.angular_velocity;
        let mut power = pushed.force.dot(&trunk.velocity) + pushed.torque.dot(&turning);
        for (leg, force) in pushed.feet.iter().enumerate().take(self.model.legs.len()) {
            let [_, velocity] = self.foot(leg);
            power += force.dot(&velocity);
        }
        power
    }
}
