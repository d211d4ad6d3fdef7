//! A step of the engine: its inputs before, and its results afterwards.
//!
//! The engine is semi-implicit (v⁺ = v + h a, x⁺ = x + h v⁺). With velocities taken half a step
//! apart from the positions this is the leapfrog, of second order while no contact opens or closes.
//! The first step therefore applies half the forces, for half a step of acceleration, and a step
//! after a longer or shorter one applies them over the mean of both.

use rapier3d_f64::dynamics::{ImpulseJointHandle, JointAxesMask, MotorModel, RigidBodyHandle};
use rapier3d_f64::math::{Pose, Rotation, Vector};
use twinrig_contact::Terrain;

use crate::abduction::JointStart;
use crate::conversion::{ANGULAR, to_engine, to_nalgebra};
use crate::divergence::Divergence;
use crate::drives::{Effort, StepTiming, kinds};
use crate::model::{CABLE, FOOT, ROPES};
use crate::options::Joints;
use crate::robot::{Machine, View};
use crate::rope::{LINEAR, RopeStep};

/// Largest gap at which a stop that pushed in the last step remains active \[m\].
const ACTIVE_GAP: f64 = 1e-4;

/// Damping of a prescribed rate, so large that it is followed at any load \[N·m·s/rad\].
const RIGID: f64 = 1e12;

/// Values at the beginning of a step.
struct StepStart {
    view: View,
    /// Rates of the ropes \[m/s\].
    rates: [f64; ROPES],
    efforts: Option<[Effort; 2]>,
    /// Angle of the pulley at the end of the step without cable tension, and its reduction per unit
    /// of impulse \[rad\], \[rad/(N·s)\].
    pulley: [f64; 2],
    /// Rate of the cable over that of the rope that represents it.
    cable_ratio: f64,
    /// Velocity of the foot \[m/s\].
    foot: Vector,
    /// Joint of a leg that abducts.
    abduction: Option<JointStart>,
}

impl Machine {
    /// Advances by a step of the engine, and checks the result for divergence.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), Divergence> {
        if self.options.step_only {
            return self.step_alone(seconds);
        }
        let timing = self.timing(seconds);
        let share = timing.force_seconds / seconds;
        self.set_softness(timing);
        let sweeps = self.sweeps(seconds);
        self.world.parameters.num_internal_pgs_iterations = sweeps as usize;
        let mut before = Vec::with_capacity(self.model.legs.len());
        for leg in 0..self.model.legs.len() {
            before.push(self.evaluate(leg, timing));
        }
        for (leg, before) in before.iter().enumerate() {
            self.prepare(leg, before, timing);
        }
        let body = self.body_velocities();
        let pushed = self.push(timing);
        if !self.world.step(seconds, share) {
            return Err(Divergence::not_finite());
        }
        if let Some(pushed) = &pushed {
            self.add_push_work(pushed, timing);
        }
        self.push_load.elapsed_s += seconds;
        (self.state.last_s, self.state.correction_s) = (seconds, timing.correction_seconds);
        for (leg, before) in before.iter().enumerate() {
            self.finish(leg, before, timing);
        }
        self.finish_body(&body);
        let stored = self.stored();
        self.state.ledger.close_step(stored);
        let counts = &mut self.state.counts;
        counts.steps += 1;
        counts.evaluations += 1;
        let solver = &self.options.solver;
        let sweeps = sweeps + solver.stabilization_iterations;
        counts.solver_iterations += u64::from(solver.solver_iterations * sweeps);
        for (leg, before) in before.iter().enumerate() {
            self.check_leg(leg, &before.view, seconds)?;
        }
        self.check_energy()
    }

    fn timing(&self, seconds: f64) -> StepTiming {
        StepTiming {
            seconds,
            force_seconds: 0.5 * (self.state.last_s + seconds),
            // Errors of the last long step are corrected over its length, however many short steps
            // divide that time.
            correction_seconds: seconds.max(self.state.correction_s - seconds),
        }
    }

    /// Returns the sweeps for this step: more if a foot lands or a leg reaches a stop of abduction,
    /// or did in the last step.
    fn sweeps(&mut self, seconds: f64) -> u32 {
        let solver = self.options.solver;
        let mut legs = 0..self.model.legs.len();
        let lands = legs.any(|leg| self.lands(leg, seconds) || self.stops(leg, seconds));
        let landed = std::mem::replace(&mut self.state.landing, lands);
        if lands || landed {
            solver.pgs_iterations.max(solver.landing_iterations)
        } else {
            solver.pgs_iterations
        }
    }

    /// Returns whether a foot without contact would penetrate the ground by the end of the step.
    fn lands(&self, leg: usize, seconds: f64) -> bool {
        let (Some(ground), false) = (&self.model.ground, self.state.legs[leg].in_contact) else {
            return false;
        };
        let (view, foot) = (self.view(leg), &self.model.legs[leg].foot);
        let below = ground.below(&to_nalgebra(view.place(foot)));
        below.gap + seconds * to_nalgebra(view.speed(foot)).dot(&below.normal) < 0.0
    }

    /// Evaluates a leg at the beginning of the step.
    fn evaluate(&self, leg: usize, timing: StepTiming) -> StepStart {
        let view = self.view(leg);
        let efforts = self.model.drives.as_ref().map(|drives| {
            let kinds = kinds(drives);
            let drives = &self.state.legs[leg].drives;
            [0, 1].map(|k| drives[k].effort(kinds[k], timing))
        });
        let pulley = efforts.map_or([0.0; 2], |[_, knee]| {
            let at = self.state.legs[leg].drives[1].angle;
            match knee {
                Effort::Rate { mean, .. } => [at + timing.seconds * mean, 0.0],
                Effort::Damper {
                    coefficient,
                    target,
                } => [
                    at + timing.seconds * target,
                    timing.seconds * self.model.legs[leg].radius / coefficient,
                ],
            }
        });
        StepStart {
            rates: std::array::from_fn(|k| view.line(&self.model.legs[leg].ropes[k].ends).2),
            efforts,
            pulley,
            cable_ratio: self.model.legs[leg].cable_ratio(self.state.legs[leg].angles),
            foot: view.speed(&self.model.legs[leg].foot),
            abduction: self.joint_start(leg, &view, timing),
            view,
        }
    }

    /// Returns the length of a rope with the pulley at this angle.
    fn rope_length(&self, leg: usize, k: usize, pulley: f64) -> f64 {
        let parts = &self.model.legs[leg];
        if k == CABLE {
            parts.chord_of_cable(parts.pantograph.cable_length(pulley))
        } else {
            parts.ropes[k].length
        }
    }

    fn prepare(&mut self, leg: usize, before: &StepStart, timing: StepTiming) {
        self.apply_forces(leg, &before.view, timing.force_seconds / timing.seconds);
        if let Some([hip, _]) = before.efforts {
            self.set_motor(self.handles.legs[leg].hip, hip, timing);
        }
        if let Some(joint) = &before.abduction {
            self.prepare_joint(leg, joint, timing);
        }
        self.set_ropes(leg, before, timing);
        self.place_ground(leg, &before.view);
    }

    /// Has the engine correct joint gaps and penetrations as slowly as in a long step: corrections
    /// change velocities, which remain, and in a step of a microsecond the change would be a
    /// thousand times too large.
    fn set_softness(&mut self, timing: StepTiming) {
        let solver = self.options.solver;
        self.world.parameters.contact_softness = solver
            .contact_softness
            .for_step(timing.seconds, timing.correction_seconds);
        self.world.parameters.static_contact_softness = self.world.parameters.contact_softness;
        let softness = solver
            .joint_softness
            .for_step(timing.seconds, timing.correction_seconds);
        for (_, joint) in self.world.sets.impulse_joints.iter_mut() {
            if !joint.data.locked_axes.is_empty() {
                joint.data.softness = softness;
            }
        }
    }

    /// Applies the forces of springs and of joint friction.
    fn apply_forces(&mut self, leg: usize, view: &View, share: f64) {
        let (mut forces, mut torques) = ([Vector::ZERO; 4], [Vector::ZERO; 4]);
        let parts = &self.model.legs[leg];
        for spring in &parts.springs {
            let (length, along, _) = view.line(&spring.ends);
            let pull = along * (share * spring.stiffness * (length - spring.rest));
            for (end, force) in spring.ends.iter().zip([pull, -pull]) {
                forces[end.body] += force;
                let arm = view.bodies[end.body].pose.rotation * end.at;
                torques[end.body] += arm.cross(force);
            }
        }
        let [first, second, third] = view.rates();
        let turns = [first, second - first, third - second];
        for k in 0..3 {
            let torque = view.axis() * (share * parts.friction[k] * turns[k]);
            torques[k] -= torque;
            torques[if k == 0 { 3 } else { k - 1 }] += torque;
        }
        for k in 0..4 {
            let handle = self.handles.legs[leg].body(self.handles.trunk, k);
            let is_trunk = handle == self.handles.trunk;
            self.add_force_to(handle, forces[k], torques[k], !is_trunk || leg == 0);
        }
    }

    /// Adds a force and a torque to those on a body, after clearing these if `reset`.
    pub(crate) fn add_force_to(
        &mut self,
        handle: RigidBodyHandle,
        force: Vector,
        torque: Vector,
        reset: bool,
    ) {
        if let Some(body) = self.world.sets.bodies.get_mut(handle) {
            if reset {
                body.reset_forces(false);
                body.reset_torques(false);
            }
            body.add_force(force, false);
            body.add_torque(torque, false);
        }
    }

    /// Configures the motor of a joint.
    pub(crate) fn set_motor(
        &mut self,
        motor: Option<ImpulseJointHandle>,
        effort: Effort,
        timing: StepTiming,
    ) {
        let (damping, target) = match effort {
            Effort::Rate { mean, .. } => (RIGID, mean),
            Effort::Damper {
                coefficient,
                target,
            } => (coefficient / timing.seconds, target),
        };
        let joints = &mut self.world.sets.impulse_joints;
        if let Some(joint) = motor.and_then(|handle| joints.get_mut(handle, false)) {
            joint.data.motor_axes = JointAxesMask::ANG_X;
            let motor = &mut joint.data.motors[ANGULAR];
            motor.model = MotorModel::ForceBased;
            (motor.stiffness, motor.damping) = (0.0, damping);
            motor.target_vel = target;
        }
    }

    /// Sets the lengths of the ropes at the end of the step.
    fn set_ropes(&mut self, leg: usize, before: &StepStart, timing: StepTiming) {
        for k in 0..ROPES {
            let Some(handle) = self.handles.legs[leg].ropes[k] else {
                continue;
            };
            let parts = &self.model.legs[leg];
            let rope = parts.ropes[k];
            let line = before.view.line(&rope.ends);
            // Excess length is corrected as slowly as in a long step, since the velocity of the
            // correction remains. So is the slack of a rope that pulls, which is rounding: over a
            // nanosecond it would permit any velocity.
            let violation = line.0 - self.rope_length(leg, k, self.state.legs[leg].drives[1].angle);
            let active = self.state.legs[leg].pulls[k] > 0.0 && violation > -ACTIVE_GAP;
            let violation = if active {
                violation
            } else {
                violation.max(0.0)
            };
            let deferred = violation * (1.0 - timing.seconds / timing.correction_seconds);
            let max_length = self.rope_length(leg, k, before.pulley[0]) + deferred;
            let compliance = if k == CABLE {
                parts.radius * before.pulley[1] / (before.cable_ratio * before.cable_ratio)
            } else {
                0.0
            };
            let rope_step = RopeStep {
                max_length,
                compliance,
                line,
                active: self.state.legs[leg].pulls[k] > 0.0 && max_length - line.0 < ACTIVE_GAP,
                seconds: timing.seconds,
                correction_seconds: timing.correction_seconds,
                attitude: before.view.bodies[rope.ends[0].body].pose.rotation,
            };
            let response = self.response(leg, k, &before.view);
            let joint = self.world.sets.impulse_joints.get_mut(handle, false);
            match (joint, self.options.joints) {
                (None, _) => {}
                (Some(joint), Joints::Impulse) => {
                    rope_step.as_rope(&mut joint.data, response, &self.options);
                }
                (Some(joint), Joints::Multibody) => rope_step.as_limit(&mut joint.data),
            }
        }
    }

    /// Returns the relative velocity of the ends of a rope per unit of impulse along it, for its
    /// two bodies without joints \[1/kg\].
    fn response(&self, leg: usize, k: usize, view: &View) -> f64 {
        let rope = &self.model.legs[leg].ropes[k];
        let (_, along, _) = view.line(&rope.ends);
        let mut sum = 0.0;
        for end in &rope.ends {
            let handle = self.handles.legs[leg].body(self.handles.trunk, end.body);
            let Some(body) = self.world.sets.bodies.get(handle) else {
                continue;
            };
            let properties = body.mass_properties();
            let masses = properties.effective_inv_mass;
            let turn = (view.bodies[end.body].pose.rotation * end.at).cross(along);
            sum +=
                along.dot(masses * along) + turn.dot(properties.effective_world_inv_inertia * turn);
        }
        sum
    }

    /// Places the ground plane of the foot tangent to the terrain below it.
    fn place_ground(&mut self, leg: usize, view: &View) {
        let (Some(ground), Some([_, floor])) = (&self.model.ground, self.handles.legs[leg].contact)
        else {
            return;
        };
        if matches!(ground.terrain, Terrain::Flat) {
            return;
        }
        let foot = view.place(&self.model.legs[leg].foot);
        let below = ground.below(&to_nalgebra(foot));
        let normal = to_engine(&below.normal);
        let pose = Pose::from_parts(
            foot - normal * (below.gap + FOOT),
            Rotation::from_rotation_arc(Vector::Z, normal),
        );
        if let Some(collider) = self.world.sets.colliders.get_mut(floor)
            && *collider.position() != pose
        {
            collider.set_position(pose);
        }
    }

    /// Reads the results of the step for a leg.
    fn finish(&mut self, leg: usize, before: &StepStart, timing: StepTiming) {
        let view = self.view(leg);
        let angles = view.angles(&self.state.legs[leg].angles);
        self.add_friction_work(leg, before, &angles, timing.force_seconds / timing.seconds);
        self.finish_ropes(leg, before, &view);
        if let Some(efforts) = before.efforts {
            self.finish_drives(leg, before, efforts, angles[0], timing);
        }
        self.state.legs[leg].angles = angles;
        if let Some(joint) = &before.abduction {
            self.finish_joint(leg, joint, &view, timing);
        }
        self.finish_ground(leg, before, &view);
    }

    /// Adds the work of joint friction to the energy balance.
    fn add_friction_work(&mut self, leg: usize, before: &StepStart, angles: &[f64; 3], share: f64) {
        let rotations: [f64; 3] =
            std::array::from_fn(|k| angles[k] - self.state.legs[leg].angles[k]);
        let rates = before.view.rates();
        let relative = |of: &[f64; 3]| [of[0], of[1] - of[0], of[2] - of[1]];
        let (rotations, rates) = (relative(&rotations), relative(&rates));
        for (k, friction) in self.model.legs[leg].friction.iter().enumerate() {
            self.state.ledger.dissipated += share * friction * rates[k] * rotations[k];
        }
    }

    fn finish_ropes(&mut self, leg: usize, before: &StepStart, view: &View) {
        for k in 0..ROPES {
            let Some(handle) = self.handles.legs[leg].ropes[k] else {
                continue;
            };
            let joint = self.world.sets.impulse_joints.get(handle);
            let pull = joint.map_or(0.0, |joint| {
                if joint.data.motor_axes.is_empty() {
                    joint.data.limits[LINEAR].impulse
                } else {
                    joint.data.motors[LINEAR].impulse
                }
            });
            let rate = view.line(&self.model.legs[leg].ropes[k].ends).2;
            let known = &mut self.state.legs[leg];
            if pull > 0.0 && known.pulls[k] <= 0.0 {
                self.state.counts.events += 1;
            }
            known.pulls[k] = pull;
            self.state.ledger.impact += 0.5 * pull * (before.rates[k] + rate);
        }
    }

    fn finish_drives(
        &mut self,
        leg: usize,
        before: &StepStart,
        efforts: [Effort; 2],
        hip: f64,
        timing: StepTiming,
    ) {
        let Some(drives) = &self.model.drives else {
            return;
        };
        let kinds = kinds(drives);
        let radius = self.model.legs[leg].radius;
        let delivered = self.motor_impulse(self.handles.legs[leg].hip) / timing.force_seconds;
        let known = &mut self.state.legs[leg];
        let pull = known.pulls[CABLE] / before.cable_ratio;
        known.tension = pull / timing.force_seconds;
        let pulley = before.pulley[0] - before.pulley[1] * pull;
        let drives = &mut known.drives;
        let previous = drives.map(|drive| (drive.angle, drive.rate));
        drives[0].finish(kinds[0], efforts[0], hip, delivered, timing);
        drives[1].finish(
            kinds[1],
            efforts[1],
            pulley,
            radius * pull / timing.force_seconds,
            timing,
        );
        // Work of the cable on the pulley.
        let rate = 0.5 * (previous[1].1 + drives[1].rate);
        self.state.ledger.impact += pull * radius * rate;
        for (drive, (_, rate)) in drives.iter().zip(previous) {
            self.state.ledger.actuator +=
                drive.torque * timing.force_seconds * 0.5 * (rate + drive.rate);
        }
    }

    /// Returns the impulse of a motor in the last step, about its axis \[N·m·s\].
    pub(crate) fn motor_impulse(&self, motor: Option<ImpulseJointHandle>) -> f64 {
        let joint = motor.and_then(|handle| self.world.sets.impulse_joints.get(handle));
        joint.map_or(0.0, |joint| -joint.data.motors[ANGULAR].impulse)
    }

    fn finish_ground(&mut self, leg: usize, before: &StepStart, view: &View) {
        let Some([foot, floor]) = self.handles.legs[leg].contact else {
            return;
        };
        let Some((normal, along)) = self.impulse_on(foot, floor) else {
            self.state.legs[leg].in_contact = false;
            return;
        };
        let mean = 0.5 * (before.foot + view.speed(&self.model.legs[leg].foot));
        self.state.ledger.impact -= normal.dot(mean);
        self.state.ledger.dissipated -= along.dot(mean);
        let known = &mut self.state.legs[leg];
        for (sum, part) in known.ground.iter_mut().zip((normal + along).to_array()) {
            *sum += part;
        }
        let in_contact = normal.length_squared() > 0.0;
        if in_contact && !known.in_contact {
            self.state.counts.events += 1;
        }
        self.state.legs[leg].in_contact = in_contact;
    }
}
