//! The robot between two steps: its state beyond the engine's bodies.

use rapier3d_f64::math::{Pose, Vector};
use serde::{Deserialize, Serialize};
use twinrig_legged::{DriveModels, LEGS, Ledger, LegPosture, Posture, StepLoad, Stored};
use twinrig_robot::{GRAVITY, Robot};
use twinrig_runtime::WorkCounts;

use crate::assembly::{AXIS, Handles, assemble};
use crate::drives::Drive;
use crate::model::{Model, Point, ROPES, TRUNK};
use crate::options::{Options, RapierError};
use crate::world::World;

/// State of a body of the engine.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyState {
    pub(crate) pose: Pose,
    pub(crate) velocity: Vector,
    pub(crate) turning: Vector,
}

impl BodyState {
    pub(crate) fn place(&self, point: &Point) -> Vector {
        self.pose.transform_point(point.at)
    }

    pub(crate) fn speed(&self, point: &Point) -> Vector {
        self.velocity + self.turning.cross(self.pose.rotation * point.at)
    }
}

/// States of a leg's segments and of the body above them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    pub(crate) bodies: [BodyState; 4],
}

impl View {
    pub(crate) fn place(&self, point: &Point) -> Vector {
        self.bodies[point.body].place(point)
    }

    pub(crate) fn speed(&self, point: &Point) -> Vector {
        self.bodies[point.body].speed(point)
    }

    /// Returns the axis of the joints in world coordinates.
    pub(crate) fn axis(&self) -> Vector {
        self.bodies[TRUNK].pose.rotation * AXIS
    }

    /// Returns the rates of the segments relative to the body above them \[rad/s\].
    pub(crate) fn rates(&self) -> [f64; 3] {
        let axis = self.axis();
        let trunk = self.bodies[TRUNK].turning;
        std::array::from_fn(|k| (self.bodies[k].turning - trunk).dot(axis))
    }

    /// Returns the absolute angles of the segments, unwrapped to be nearest to `last`.
    pub(crate) fn angles(&self, last: &[f64; 3]) -> [f64; 3] {
        const TURN: f64 = 2.0 * core::f64::consts::PI;
        let trunk_inverse = self.bodies[TRUNK].pose.rotation.inverse();
        std::array::from_fn(|k| {
            let relative = trunk_inverse * self.bodies[k].pose.rotation;
            let angle = -2.0 * libm::atan2(relative.y, relative.w);
            angle + TURN * libm::round((last[k] - angle) / TURN)
        })
    }

    /// Returns length, direction and rate of the line from the first point to the second.
    pub(crate) fn line(&self, ends: &[Point; 2]) -> (f64, Vector, f64) {
        let span = self.place(&ends[1]) - self.place(&ends[0]);
        let length = span.length();
        let along = span / length;
        let rate = (self.speed(&ends[1]) - self.speed(&ends[0])).dot(along);
        (length, along, rate)
    }
}

/// State of a leg beyond its bodies.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct LegState {
    /// Absolute angles of the segments \[rad\].
    pub(crate) angles: [f64; 3],
    /// Hip and pulley; the hip's angle is that of the first segment.
    pub(crate) drives: [Drive; 2],
    /// Joint of abduction, with its servo if it has one.
    pub(crate) abduction: Drive,
    /// Cable tension, mean over the last step \[N\].
    pub(crate) tension: f64,
    /// Impulses of the ropes in the last step \[N·s\].
    pub(crate) pulls: [f64; ROPES],
    /// Whether the ground pushed on the foot in the last step.
    pub(crate) in_contact: bool,
    /// Impulse of the ground since the start \[N·s\].
    pub(crate) ground: [f64; 3],
}

/// Impulses of the ground since the start, world frame \[N·s\].
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct BodyImpulses {
    /// On knee and ankle of each leg.
    pub(crate) segments: [[f64; 3]; LEGS],
    /// On the trunk.
    pub(crate) trunk: [f64; 3],
}

/// State of the robot beyond the engine's sets.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct State {
    pub(crate) legs: Vec<LegState>,
    pub(crate) body: BodyImpulses,
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
    /// Whether a foot landed in the last step.
    pub(crate) landing: bool,
    /// Length of the last step; zero before the first \[s\].
    pub(crate) last_s: f64,
    /// Correction interval of the last step \[s\].
    pub(crate) correction_s: f64,
}

/// Load of pushes in a step of the plant.
#[derive(Debug, Clone, Default)]
pub(crate) struct PushLoad {
    pub(crate) load: StepLoad,
    /// Time since the begin of that step \[s\].
    pub(crate) elapsed_s: f64,
}

/// A robot in the engine.
pub struct Machine {
    pub(crate) model: Model,
    pub(crate) options: Options,
    pub(crate) handles: Handles,
    pub(crate) world: World,
    pub(crate) state: State,
    pub(crate) push_load: PushLoad,
}

impl Machine {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, RapierError> {
        let model = Model::new(robot, options)?;
        let posture = options.setup.posture(robot)?;
        let abduction = vec![[0.0; 2]; model.legs.len()];
        let mut machine = Self::at(model, options.clone(), &posture, &abduction);
        machine.hold_commands();
        Ok(machine)
    }

    /// Builds the robot at a posture, with angle and rate of abduction of each leg
    /// \[rad, rad/s\], and with all commands zero.
    pub(crate) fn at(
        model: Model,
        options: Options,
        posture: &Posture,
        abduction: &[[f64; 2]],
    ) -> Self {
        let (sets, handles) = assemble(&model, &options, posture, abduction);
        let world = World::new(sets, &options.solver);
        let legs = model.legs.iter().zip(abduction);
        let legs = legs.map(|(leg, [abducted, abduction_rate])| {
            let at = posture.legs.iter().find(|(name, _)| *name == leg.name);
            let at = at.map_or_else(LegPosture::default, |(_, at)| *at);
            let drive = |angle, rate| Drive {
                angle,
                rate,
                ..Drive::default()
            };
            LegState {
                angles: at.angles,
                drives: [
                    drive(at.angles[0], at.rates[0]),
                    drive(at.pulley, at.pulley_rate),
                ],
                abduction: drive(*abducted, *abduction_rate),
                ..LegState::default()
            }
        });
        let state = State {
            legs: legs.collect(),
            ..State::default()
        };
        let mut machine = Self {
            model,
            options,
            handles,
            world,
            state,
            push_load: PushLoad::default(),
        };
        machine.state.ledger = Ledger::opened(machine.stored());
        machine
    }

    /// Sets the commands of servos to their present angles.
    pub(crate) fn hold_commands(&mut self) {
        if let Some(DriveModels::Servos(_)) = self.model.drives {
            for drive in self.state.legs.iter_mut().flat_map(|leg| &mut leg.drives) {
                drive.command[0] = drive.angle;
            }
        }
        for leg in &mut self.state.legs {
            leg.abduction.command[0] = leg.abduction.angle;
        }
    }

    fn body_state(&self, handle: rapier3d_f64::dynamics::RigidBodyHandle) -> BodyState {
        let body = &self.world.sets.bodies[handle];
        BodyState {
            pose: *body.position(),
            velocity: body.linvel(),
            turning: body.angvel(),
        }
    }

    pub(crate) fn trunk(&self) -> BodyState {
        self.body_state(self.handles.trunk)
    }

    pub(crate) fn view(&self, leg: usize) -> View {
        let handles = &self.handles.legs[leg];
        let body = |k| self.body_state(handles.body(self.handles.trunk, k));
        View {
            bodies: [0, 1, 2, TRUNK].map(body),
        }
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
        let [mut kinetic, mut spring, mut gravity] = [0.0; 3];
        let mut body = |body_state: &BodyState, mass: f64, inertia: Vector| {
            let body_rate = body_state.pose.rotation.inverse() * body_state.turning;
            kinetic += 0.5
                * (mass * body_state.velocity.length_squared()
                    + body_rate.dot(inertia * body_rate));
            gravity += mass * GRAVITY * body_state.pose.translation.z;
        };
        if self.model.base != twinrig_legged::Base::Fixed {
            body(&self.trunk(), self.model.mass, self.model.inertia);
        }
        for (i, leg) in self.model.legs.iter().enumerate() {
            let view = self.view(i);
            for (body_state, segment) in view.bodies.iter().zip(&leg.segments) {
                let along = self.options.axial_share * segment.moment;
                let inertia = Vector::new(segment.moment, segment.moment, along);
                body(body_state, segment.mass, inertia);
            }
            if let Some(carrier) = &leg.carrier {
                let inertia = Vector::splat(carrier.moment);
                body(&view.bodies[TRUNK], carrier.mass, inertia);
            }
            for segment_spring in &leg.springs {
                let stretch = view.line(&segment_spring.ends).0 - segment_spring.rest;
                spring += 0.5 * segment_spring.stiffness * stretch * stretch;
            }
        }
        if let Some(drives) = &self.model.drives {
            let inertias = drives.inertias();
            for leg in &self.state.legs {
                for (drive, inertia) in leg.drives.iter().zip(inertias) {
                    kinetic += 0.5 * inertia * drive.rate * drive.rate;
                }
            }
        }
        if let Some(servo) = &self.model.abduction {
            for leg in &self.state.legs {
                kinetic += 0.5 * servo.inertia() * leg.abduction.rate * leg.abduction.rate;
            }
        }
        [kinetic, spring, gravity]
    }
}
