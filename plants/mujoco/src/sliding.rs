//! Correction of the forces on sliding feet, which MuJoCo lifts.
//!
//! MuJoCo's forces minimise a convex function. For a sliding contact this implies `a_n − aref_n = µ
//! |a_t − aref_t|`: the contact is lifted off the ground at µ times the velocity that remains under
//! friction, at any step. Coulomb's law has no such term. Reducing the normal reference by the same
//! amount restores the law (de Saxcé and Feng): forces are computed again, with the last ones as
//! initial guess, until the reduction converges.

use nalgebra::Vector3;
use twinrig_legged::LEGS;

use crate::addresses::{LegAddresses, Place};
use crate::flow::{CONTACTS, Flow, FlowFault};
use crate::frame::{LegFrame, TrunkFrame};
use crate::options::{Cone, TimeConstant};

/// Share of the friction limit from which a foot slides \[1\].
const SLIDING_SHARE: f64 = 1.0 - 1e-6;

/// Tolerance of the reduction as a velocity \[m/s\], and relative to its value \[1\].
const TOLERANCE: [f64; 2] = [1e-4, 1e-2];

impl Flow {
    /// Computes the forces of the present state.
    pub(crate) fn forward(&mut self, seconds: f64) -> Result<(), FlowFault> {
        self.engine.forward()?;
        self.correct_sliding(seconds)
    }

    /// Computes them again until sliding feet are not lifted.
    pub(crate) fn correct_sliding(&mut self, seconds: f64) -> Result<(), FlowFault> {
        if self.model.ground.is_none() || self.model.numerics.cone != Cone::Elliptic {
            return Ok(());
        }
        let mut applied = [0.0; CONTACTS];
        for _ in 0..self.model.numerics.sliding_rounds {
            let mut required = applied;
            if !self.reductions(seconds, &applied, &mut required) {
                break;
            }
            applied = required;
            self.resolve_reduced(&applied)?;
        }
        Ok(())
    }

    /// Writes the required reduction of each contact's normal acceleration to `required` \[m/s²\].
    /// Returns whether it differs from that in force, `applied`.
    fn reductions(
        &mut self,
        seconds: f64,
        applied: &[f64; CONTACTS],
        required: &mut [f64],
    ) -> bool {
        let data = self.engine.data();
        if data.contact().is_empty() {
            return false;
        }
        let next = data.qvel().iter().zip(data.qacc());
        self.qvel_next.clear();
        self.qvel_next
            .extend(next.map(|(rate, more)| rate + seconds * more));
        let [_, damping] = self.reference();
        let mut changed = false;
        for (id, contact) in data.contact().iter().enumerate().take(CONTACTS) {
            let Some(point) = self.point_of(contact.geom) else {
                continue;
            };
            let [normal, along, across, ..] = data.contact_force(id);
            let friction = contact.friction[0];
            // A contact without normal force counts as sliding, too.
            let slides = libm::hypot(along, across) >= SLIDING_SHARE * friction * normal;
            required[id] = 0.0;
            if slides {
                let tangents = [1, 2].map(|row| {
                    let of = &contact.frame[3 * row..][..3];
                    Vector3::new(of[0], of[1], of[2])
                });
                let now = self.velocity_at(point, data.qvel());
                let end = self.velocity_at(point, &self.qvel_next);
                // MuJoCo's reference acceleration removes all of the velocity by its damping.
                let remaining = (end - now) / seconds + now * damping;
                required[id] = friction
                    * libm::hypot(remaining.dot(&tangents[0]), remaining.dot(&tangents[1]));
            }
            let change = (required[id] - applied[id]).abs();
            changed |= change > TOLERANCE[0] / seconds + TOLERANCE[1] * required[id];
        }
        changed
    }

    /// Computes the forces with these reductions.
    fn resolve_reduced(&mut self, applied: &[f64; CONTACTS]) -> Result<(), FlowFault> {
        let [stiffness, _] = self.reference();
        let data = self.engine.data();
        let contacts = data.contact().iter().zip(applied).enumerate();
        for (id, (contact, applied)) in contacts {
            self.rows[id] = usize::try_from(contact.efc_address)
                .ok()
                .map(|row| (row, contact.includemargin - applied / stiffness));
        }
        let rows = &self.rows[..data.contact().len().min(CONTACTS)];
        self.engine.resolve(|margins| {
            for (row, margin) in rows.iter().flatten() {
                margins[*row] = *margin;
            }
        })?;
        Ok(())
    }

    /// Returns stiffness \[1/s²\] and damping \[1/s\] of the contacts' reference acceleration, as
    /// MuJoCo derives them.
    fn reference(&self) -> [f64; 2] {
        let numerics = &self.model.numerics;
        let step = self.engine.data().model().opt().timestep;
        let mut time = match numerics.closing {
            TimeConstant::Steps(steps) => steps * self.model.step_s,
            TimeConstant::Seconds(seconds) => seconds,
        };
        if numerics.refsafe {
            time = time.max(2.0 * step);
        }
        let [_, impedance] = numerics.contact_impedance;
        let ratio = numerics.contact_damping;
        let [stiffness, damping] = [
            1.0 / (impedance * impedance * time * time * ratio * ratio),
            2.0 / (impedance * time),
        ];
        // Stiffness is multiplied by the impedance, which is constant but in the layer of `width`.
        [stiffness * impedance, damping]
    }

    fn point_of(&self, geoms: [i32; 2]) -> Option<Point> {
        let has = |geom: usize| {
            geoms
                .iter()
                .any(|other| usize::try_from(*other) == Ok(geom))
        };
        let is_foot = |at: &LegAddresses| at.foot.is_some_and(has);
        let foot = self.at.legs.iter().position(is_foot).map(Point::Foot);
        let body = || self.at.body.iter().find(|point| has(point.geom));
        foot.or_else(|| body().map(|point| Point::Body(point.place)))
    }

    /// Returns the world velocity of a contact point at these generalised velocities \[m/s\].
    fn velocity_at(&self, point: Point, qvel: &[f64]) -> Vector3<f64> {
        let qpos = self.engine.data().qpos();
        let trunk = TrunkFrame::new(&self.model, &self.at, qpos, qvel);
        let mut frames = [None; LEGS];
        let leg = match point {
            Point::Foot(leg) => Some(leg),
            Point::Body(place) => place.leg(),
        };
        if let Some(leg) = leg {
            let (model, at) = (&self.model.legs[leg], &self.at.legs[leg]);
            let coordinates = self.model.coordinates;
            frames[leg] = Some(LegFrame::new(model, at, coordinates, qpos, qvel));
        }
        match point {
            Point::Body(place) => place.motion(&self.model, &trunk, &frames)[1],
            Point::Foot(leg) => {
                let model = &self.model.legs[leg];
                let [foot, speed] =
                    frames[leg].map_or_else(Default::default, |frame| frame.foot(model));
                trunk.point_velocity(&foot, &speed)
            }
        }
    }
}

/// Contact point of the robot.
#[derive(Clone, Copy)]
enum Point {
    /// The foot of a leg.
    Foot(usize),
    /// A point of trunk or segments.
    Body(Place),
}
