//! Forces of pushes on trunk and feet, held at their mean over a step of the engine.

use nalgebra::Vector3;
use rapier3d_f64::math::Vector;
use twinrig_legged::{ExternalLoad, Readings, StepLoad};

use crate::conversion::to_engine;
use crate::drives::StepTiming;
use crate::robot::{Machine, PushLoad};

/// Forces of pushes in a step of the engine, world axes.
pub(crate) struct Pushed {
    /// Force on the trunk \[N\], and torque about its centre of mass \[N·m\].
    force: Vector,
    torque: Vector,
    /// Forces on the feet \[N\].
    feet: Vec<Vector>,
    /// Velocities before the step: of the trunk, linear and angular, and of the feet.
    trunk: [Vector; 2],
    speeds: Vec<Vector>,
}

impl Machine {
    /// Sets the load of the next step of the plant.
    pub(crate) fn set_push_load(&mut self, load: &StepLoad) {
        self.push_load.load.copy_from(load);
        // Forces on legs are set anew in every step, and with them those on the trunk.
        if self.model.legs.is_empty() {
            self.add_force_to(self.handles.trunk, Vector::ZERO, Vector::ZERO, true);
        }
    }

    fn mean_load(&self, seconds: f64) -> Option<ExternalLoad> {
        let PushLoad { load, elapsed_s } = &self.push_load;
        (!load.is_empty()).then(|| load.mean(*elapsed_s, elapsed_s + seconds))
    }

    /// Adds the forces of pushes to those on the bodies.
    pub(crate) fn push(&mut self, timing: StepTiming) -> Option<Pushed> {
        let load = self.mean_load(timing.seconds)?;
        let rotation = self.rotation();
        let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[(i, j)]));
        let [.., roll, pitch, yaw] = load.wrench(&rows, |value| value);
        let trunk = self.trunk();
        let pushed = Pushed {
            force: to_engine(&load.force.into()),
            torque: to_engine(&(rotation * Vector3::new(roll, pitch, yaw))),
            feet: load.feet.map(|force| to_engine(&force.into())).to_vec(),
            trunk: [trunk.velocity, trunk.turning],
            speeds: self.foot_speeds(),
        };
        let share = timing.force_seconds / timing.seconds;
        let reset = self.model.legs.is_empty();
        let (force, torque) = (share * pushed.force, share * pushed.torque);
        self.add_force_to(self.handles.trunk, force, torque, reset);
        for leg in 0..self.model.legs.len() {
            let foot = self.model.legs[leg].foot;
            let arm = self.view(leg).bodies[foot.body].pose.rotation * foot.at;
            let handle = self.handles.legs[leg].body(self.handles.trunk, foot.body);
            let force = share * pushed.feet[leg];
            self.add_force_to(handle, force, arm.cross(force), false);
        }
        Some(pushed)
    }

    /// Adds the work of pushes in a completed step to the energy balance.
    pub(crate) fn add_push_work(&mut self, pushed: &Pushed, timing: StepTiming) {
        let trunk = self.trunk();
        let [velocity, turning] = pushed.trunk;
        let mut twice = pushed.force.dot(velocity + trunk.velocity)
            + pushed.torque.dot(turning + trunk.turning);
        let speeds = pushed.speeds.iter().zip(self.foot_speeds());
        for ((before, after), force) in speeds.zip(&pushed.feet) {
            twice += force.dot(*before + after);
        }
        self.state.ledger.external += 0.5 * twice * timing.force_seconds;
    }

    fn foot_speeds(&self) -> Vec<Vector> {
        let legs = self.model.legs.iter().enumerate();
        legs.map(|(leg, model)| self.view(leg).speed(&model.foot))
            .collect()
    }
}
