//! A step of the engine: what it is told before, and what it tells afterwards.
//!
//! The engine takes velocities first and positions by them (v⁺ = v + h a, x⁺ = x + h v⁺). Seen as velocities half a step
//! apart from the positions, that is the leapfrog, of second order while nothing opens or closes; so the first step, which
//! has only half a step to get up speed, gets half the forces, and one after a longer or shorter step the mean.

use rapier3d_f64::dynamics::{JointAxesMask, MotorModel, RigidBodyHandle};
use rapier3d_f64::math::{Pose, Rotation, Vector};
use twinrig_contact::Terrain;

use crate::assembly::FOOT;
use crate::border::{inside, outside};
use crate::divergence::Broken;
use crate::drives::{Effort, Pace, kinds};
use crate::model::{CABLE, ROPES};
use crate::options::Joints;
use crate::robot::{Machine, View};
use crate::rope::{LINEAR, Tied};

/// Index of an angular x axis in the engine's lists.
const ANGULAR: usize = 3;

/// A stop that pushed in the last step is held on to while its gap is smaller \[m\].
const HELD: f64 = 1e-4;

/// A velocity that the engine holds has a damper so large that nothing but its greatest torque counts \[N·m·s/rad\].
const RIGID: f64 = 1e12;

/// What a step began with.
struct Before {
    view: View,
    /// Rates of the ropes \[m/s\].
    rates: [f64; ROPES],
    efforts: Option<[Effort; 2]>,
    /// Where the pulley would be in the end if no cable pulled, and how much a unit of impulse holds it back \[rad\],
    /// \[rad/(N·s)\].
    pulley: [f64; 2],
    /// Rate of the cable over that of the rope that stands for it.
    leverage: f64,
    /// Velocity of the foot \[m/s\].
    foot: Vector,
}

impl Machine {
    /// Moves on by a step of the engine, and looks whether what came out of it can be.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), Broken> {
        let pace = self.pace(seconds);
        let share = pace.kick / seconds;
        self.soften(pace);
        let sweeps = self.sweeps(seconds);
        self.world.parameters.num_internal_pgs_iterations = sweeps as usize;
        let mut before = Vec::with_capacity(self.model.legs.len());
        for leg in 0..self.model.legs.len() {
            before.push(self.look(leg, pace));
        }
        for (leg, before) in before.iter().enumerate() {
            self.prepare(leg, before, pace);
        }
        if !self.world.step(seconds, share) {
            return Err(Broken::numbers());
        }
        (self.state.last_s, self.state.whole_s) = (seconds, pace.whole);
        for (leg, before) in before.iter().enumerate() {
            self.finish(leg, before, pace);
        }
        let stored = self.stored();
        self.state.ledger.close_step(stored);
        let counts = &mut self.state.counts;
        counts.steps += 1;
        counts.evaluations += 1;
        let solver = &self.options.solver;
        let sweeps = sweeps + solver.stabilization_iterations;
        counts.solver_iterations += u64::from(solver.solver_iterations * sweeps);
        for (leg, before) in before.iter().enumerate() {
            self.guard_leg(leg, &before.view, seconds)?;
        }
        self.guard_energy()
    }

    fn pace(&self, seconds: f64) -> Pace {
        Pace {
            seconds,
            kick: 0.5 * (self.state.last_s + seconds),
            // What an error of the last long step is to be taken back in, however many short ones that time is cut into.
            whole: seconds.max(self.state.whole_s - seconds),
        }
    }

    /// Sweeps for this step: more of them where a foot lands, or did in the last step.
    fn sweeps(&mut self, seconds: f64) -> u32 {
        let solver = self.options.solver;
        let lands = (0..self.model.legs.len()).any(|leg| self.lands(leg, seconds));
        let landed = std::mem::replace(&mut self.state.landing, lands);
        if lands || landed {
            solver.pgs_iterations.max(solver.landing_iterations)
        } else {
            solver.pgs_iterations
        }
    }

    /// Whether a foot that is in the air would be in the ground at the end of the step.
    fn lands(&self, leg: usize, seconds: f64) -> bool {
        let (Some(ground), false) = (&self.model.ground, self.state.legs[leg].stands) else {
            return false;
        };
        let (view, foot) = (self.view(leg), &self.model.legs[leg].foot);
        let below = ground.below(&outside(view.place(foot)));
        below.gap + seconds * outside(view.speed(foot)).dot(&below.normal) < 0.0
    }

    /// What a step begins with.
    fn look(&self, leg: usize, pace: Pace) -> Before {
        let view = self.view(leg);
        let efforts = self.model.drives.as_ref().map(|drives| {
            let kinds = kinds(drives);
            let drives = &self.state.legs[leg].drives;
            [0, 1].map(|k| drives[k].effort(kinds[k], pace))
        });
        let pulley = efforts.map_or([0.0; 2], |[_, knee]| {
            let at = self.state.legs[leg].drives[1].angle;
            match knee {
                Effort::Follows { mean, .. } => [at + pace.seconds * mean, 0.0],
                Effort::Drags { drag, towards } => [
                    at + pace.seconds * towards,
                    pace.seconds * self.model.legs[leg].radius / drag,
                ],
            }
        });
        Before {
            rates: std::array::from_fn(|k| view.line(&self.model.legs[leg].ropes[k].ends).2),
            efforts,
            pulley,
            leverage: self.model.legs[leg].leverage(self.state.legs[leg].angles),
            foot: view.speed(&self.model.legs[leg].foot),
            view,
        }
    }

    /// How long a rope is with the pulley at this angle.
    fn reach(&self, leg: usize, k: usize, pulley: f64) -> f64 {
        let parts = &self.model.legs[leg];
        if k == CABLE {
            parts.chord_of_cable(parts.pantograph.cable_length(pulley))
        } else {
            parts.ropes[k].length
        }
    }

    fn prepare(&mut self, leg: usize, before: &Before, pace: Pace) {
        self.push(leg, &before.view, pace.kick / pace.seconds);
        if let Some([hip, _]) = before.efforts {
            self.drive_hip(leg, hip, pace);
        }
        self.pay_out(leg, before, pace);
        self.lay_ground(leg, &before.view);
    }

    /// Has the engine take back what joints and feet are off by as slowly as in one of the long steps: what it does to take an error
    /// back it does to velocities, which stay, and in a step of a microsecond it would be a thousand times too much.
    fn soften(&mut self, pace: Pace) {
        let solver = self.options.solver;
        self.world.parameters.contact_softness =
            solver.contact_softness.for_a_step(pace.seconds, pace.whole);
        self.world.parameters.static_contact_softness = self.world.parameters.contact_softness;
        let softness = solver.joint_softness.for_a_step(pace.seconds, pace.whole);
        for (_, joint) in self.world.sets.impulse_joints.iter_mut() {
            if !joint.data.locked_axes.is_empty() {
                joint.data.softness = softness;
            }
        }
    }

    /// Forces of the springs and of friction in the joints.
    fn push(&mut self, leg: usize, view: &View, share: f64) {
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
            self.push_body(handle, forces[k], torques[k], k != 3 || leg == 0);
        }
    }

    /// Adds to the forces on a body, or begins anew.
    fn push_body(&mut self, handle: RigidBodyHandle, force: Vector, torque: Vector, anew: bool) {
        if let Some(body) = self.world.sets.bodies.get_mut(handle) {
            if anew {
                body.reset_forces(false);
                body.reset_torques(false);
            }
            body.add_force(force, false);
            body.add_torque(torque, false);
        }
    }

    /// Tells the engine what the hip's drive does.
    fn drive_hip(&mut self, leg: usize, effort: Effort, pace: Pace) {
        let (damping, towards) = match effort {
            Effort::Follows { mean, .. } => (RIGID, mean),
            Effort::Drags { drag, towards } => (drag / pace.seconds, towards),
        };
        let joints = &mut self.world.sets.impulse_joints;
        let joint = self.handles.legs[leg].hip;
        if let Some(joint) = joint.and_then(|handle| joints.get_mut(handle, false)) {
            joint.data.motor_axes = JointAxesMask::ANG_X;
            let motor = &mut joint.data.motors[ANGULAR];
            motor.model = MotorModel::ForceBased;
            (motor.stiffness, motor.damping) = (0.0, damping);
            motor.target_vel = towards;
        }
    }

    /// Sets how long the ropes are in the end of the step.
    fn pay_out(&mut self, leg: usize, before: &Before, pace: Pace) {
        for k in 0..ROPES {
            let Some(handle) = self.handles.legs[leg].ropes[k] else {
                continue;
            };
            let parts = &self.model.legs[leg];
            let rope = parts.ropes[k];
            let line = before.view.line(&rope.ends);
            // What it is too long by is taken back as slowly as in a long step: the speed of that stays. So is what a rope
            // that pulls is too short by, which is rounding: over a nanosecond it would make room for any speed.
            let over = line.0 - self.reach(leg, k, self.state.legs[leg].drives[1].angle);
            let held = self.state.legs[leg].pulls[k] > 0.0 && over > -HELD;
            let over = if held { over } else { over.max(0.0) };
            let late = over * (1.0 - pace.seconds / pace.whole);
            let most = self.reach(leg, k, before.pulley[0]) + late;
            let give = if k == CABLE {
                parts.radius * before.pulley[1] / (before.leverage * before.leverage)
            } else {
                0.0
            };
            let tied = Tied {
                most,
                give,
                line,
                held: self.state.legs[leg].pulls[k] > 0.0 && most - line.0 < HELD,
                seconds: pace.seconds,
                whole: pace.whole,
                upright: before.view.bodies[rope.ends[0].body].pose.rotation,
            };
            let response = self.response(leg, k, &before.view);
            let joint = self.world.sets.impulse_joints.get_mut(handle, false);
            match (joint, self.options.joints) {
                (None, _) => {}
                (Some(joint), Joints::Impulse) => {
                    tied.rope(&mut joint.data, response, &self.options);
                }
                (Some(joint), Joints::Multibody) => tied.line(&mut joint.data),
            }
        }
    }

    /// How fast the ends of a rope part for a unit of impulse along it, if nothing but their two bodies moved \[1/kg\].
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

    /// Puts the ground's tangent plane below the foot.
    fn lay_ground(&mut self, leg: usize, view: &View) {
        let (Some(ground), Some([_, floor])) = (&self.model.ground, self.handles.legs[leg].contact)
        else {
            return;
        };
        if matches!(ground.terrain, Terrain::Flat) {
            return;
        }
        let foot = view.place(&self.model.legs[leg].foot);
        let below = ground.below(&outside(foot));
        let normal = inside(&below.normal);
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

    /// Reads what the step did to a leg.
    fn finish(&mut self, leg: usize, before: &Before, pace: Pace) {
        let view = self.view(leg);
        let angles = view.angles(&self.state.legs[leg].angles);
        self.rub(leg, before, &angles, pace.kick / pace.seconds);
        self.finish_ropes(leg, before, &view);
        if let Some(efforts) = before.efforts {
            self.finish_drives(leg, before, efforts, angles[0], pace);
        }
        self.state.legs[leg].angles = angles;
        self.finish_ground(leg, before, &view);
    }

    /// Writes up what friction in the joints took.
    fn rub(&mut self, leg: usize, before: &Before, angles: &[f64; 3], share: f64) {
        let turned: [f64; 3] = std::array::from_fn(|k| angles[k] - self.state.legs[leg].angles[k]);
        let rates = before.view.rates();
        let relative = |of: &[f64; 3]| [of[0], of[1] - of[0], of[2] - of[1]];
        let (turned, rates) = (relative(&turned), relative(&rates));
        for (k, friction) in self.model.legs[leg].friction.iter().enumerate() {
            self.state.ledger.dissipated += share * friction * rates[k] * turned[k];
        }
    }

    fn finish_ropes(&mut self, leg: usize, before: &Before, view: &View) {
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
        before: &Before,
        efforts: [Effort; 2],
        hip: f64,
        pace: Pace,
    ) {
        let Some(drives) = &self.model.drives else {
            return;
        };
        let kinds = kinds(drives);
        let radius = self.model.legs[leg].radius;
        let given = self.hip_impulse(leg) / pace.kick;
        let known = &mut self.state.legs[leg];
        let pull = known.pulls[CABLE] / before.leverage;
        known.tension = pull / pace.kick;
        let pulley = before.pulley[0] - before.pulley[1] * pull;
        // The cable's share of what its ends and the pulley did in the meantime.
        let drives = &mut known.drives;
        let was = drives.map(|drive| (drive.angle, drive.rate));
        drives[0].finish(kinds[0], efforts[0], hip, given, pace);
        drives[1].finish(
            kinds[1],
            efforts[1],
            pulley,
            radius * pull / pace.kick,
            pace,
        );
        let wound = 0.5 * (was[1].1 + drives[1].rate);
        self.state.ledger.impact += pull * radius * wound;
        for (drive, (_, rate)) in drives.iter().zip(was) {
            self.state.ledger.actuator += drive.torque * pace.kick * 0.5 * (rate + drive.rate);
        }
    }

    /// Impulse of the hip's drive on the leg in the last step, about the joint's axis \[N·m·s\].
    fn hip_impulse(&self, leg: usize) -> f64 {
        let joint = self.handles.legs[leg].hip;
        let joint = joint.and_then(|handle| self.world.sets.impulse_joints.get(handle));
        joint.map_or(0.0, |joint| -joint.data.motors[ANGULAR].impulse)
    }

    fn finish_ground(&mut self, leg: usize, before: &Before, view: &View) {
        let Some([foot, floor]) = self.handles.legs[leg].contact else {
            return;
        };
        let Some((normal, along)) = self.impulse_on(foot, floor) else {
            self.state.legs[leg].stands = false;
            return;
        };
        let mean = 0.5 * (before.foot + view.speed(&self.model.legs[leg].foot));
        self.state.ledger.impact -= normal.dot(mean);
        self.state.ledger.dissipated -= along.dot(mean);
        let known = &mut self.state.legs[leg];
        for (sum, part) in known.ground.iter_mut().zip((normal + along).to_array()) {
            *sum += part;
        }
        let stands = normal.length_squared() > 0.0;
        if stands && !known.stands {
            self.state.counts.events += 1;
        }
        self.state.legs[leg].stands = stands;
    }
}
