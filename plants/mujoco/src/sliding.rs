//! Feet that slide without being lifted.
//!
//! MuJoCo finds forces as the minimum of a convex function. Of a contact that slides this asks
//! `a_n − aref_n = µ |a_t − aref_t|`: the faster it slides, the faster it is lifted off the ground, at µ times the velocity that
//! friction leaves it, whatever the step. Coulomb's law has no such term. Asking for as much less along the normal gives it back
//! (de Saxcé and Feng): forces are found again, from where they were found last, until what is asked for stays the same.

use nalgebra::Vector3;
use twinrig_legged::LEGS;

use crate::flow::{Flow, FlowFault};
use crate::frame::{LegFrame, TrunkFrame, spatial};
use crate::options::{Closing, Cone};

/// A foot slides if friction has so much of what it may have \[1\].
const SPENT: f64 = 1.0 - 1e-6;

/// What a foot may be lifted at \[m/s\], and of what friction leaves it \[1\].
const LIFTED: [f64; 2] = [1e-4, 1e-2];

/// A robot's foot touches at corners of the ground more than once; contacts beyond these stay MuJoCo's.
pub(crate) const CONTACTS: usize = 4 * LEGS;

impl Flow {
    /// Finds the forces of the present state.
    pub(crate) fn forward(&mut self, seconds: f64) -> Result<(), FlowFault> {
        self.engine.forward()?;
        self.slide(seconds)
    }

    /// Finds them again where feet slide.
    pub(crate) fn slide(&mut self, seconds: f64) -> Result<(), FlowFault> {
        if self.model.ground.is_none() || self.model.numerics.cone != Cone::Elliptic {
            return Ok(());
        }
        let mut asked = [0.0; CONTACTS];
        for _ in 0..self.model.numerics.sliding_rounds {
            let mut wanted = asked;
            if !self.lifts(seconds, &asked, &mut wanted) {
                break;
            }
            asked = wanted;
            self.again(&asked)?;
        }
        Ok(())
    }

    /// How much less is to be asked of each contact \[m/s²\]; says whether that is news.
    fn lifts(&mut self, seconds: f64, asked: &[f64; CONTACTS], wanted: &mut [f64]) -> bool {
        let data = self.engine.data();
        if data.contact().is_empty() {
            return false;
        }
        let then = data.qvel().iter().zip(data.qacc());
        self.qvel_then.clear();
        self.qvel_then
            .extend(then.map(|(rate, more)| rate + seconds * more));
        let [_, damping] = self.reference();
        let mut news = false;
        for (id, contact) in data.contact().iter().enumerate().take(CONTACTS) {
            let Some(leg) = self.leg_of(contact.geom) else {
                continue;
            };
            let [normal, along, across, ..] = data.contact_force(id);
            let friction = contact.friction[0];
            // One that is not pressed at all slides, too.
            let slides = libm::hypot(along, across) >= SPENT * friction * normal;
            wanted[id] = 0.0;
            if slides {
                let tangents = [1, 2].map(|row| {
                    let of = &contact.frame[3 * row..][..3];
                    Vector3::new(of[0], of[1], of[2])
                });
                let now = self.foot_at(leg, data.qvel());
                let end = self.foot_at(leg, &self.qvel_then);
                // What MuJoCo asks for is to take all of the velocity back by its damping.
                let left = (end - now) / seconds + now * damping;
                wanted[id] = friction * libm::hypot(left.dot(&tangents[0]), left.dot(&tangents[1]));
            }
            let off = (wanted[id] - asked[id]).abs();
            news |= off > LIFTED[0] / seconds + LIFTED[1] * wanted[id];
        }
        news
    }

    /// Finds forces under that.
    fn again(&mut self, asked: &[f64; CONTACTS]) -> Result<(), FlowFault> {
        let [stiffness, _] = self.reference();
        let data = self.engine.data();
        let contacts = data.contact().iter().zip(asked).enumerate();
        for (id, (contact, asked)) in contacts {
            self.rows[id] = usize::try_from(contact.efc_address)
                .ok()
                .map(|row| (row, contact.includemargin - asked / stiffness));
        }
        let rows = &self.rows[..data.contact().len().min(CONTACTS)];
        self.engine.resolve(|margins| {
            for (row, margin) in rows.iter().flatten() {
                margins[*row] = *margin;
            }
        })?;
        Ok(())
    }

    /// What MuJoCo makes of the contacts' reference: stiffness \[1/s²\] and damping \[1/s\].
    fn reference(&self) -> [f64; 2] {
        let numerics = &self.model.numerics;
        let step = self.engine.data().model().opt().timestep;
        let mut time = match numerics.closing {
            Closing::Steps(steps) => steps * self.model.step_s,
            Closing::Seconds(seconds) => seconds,
        };
        if numerics.refsafe {
            time = time.max(2.0 * step);
        }
        let [_, most] = numerics.contact_impedance;
        let ratio = numerics.contact_damping;
        let [stiffness, damping] = [
            1.0 / (most * most * time * time * ratio * ratio),
            2.0 / (most * time),
        ];
        // Stiffness is weighed by the impedance, which is the same everywhere but in the layer of `width`.
        [stiffness * most, damping]
    }

    fn leg_of(&self, geoms: [i32; 2]) -> Option<usize> {
        let is_foot = |foot: Option<usize>| {
            foot.is_some_and(|foot| geoms.iter().any(|geom| usize::try_from(*geom) == Ok(foot)))
        };
        self.at.legs.iter().position(|at| is_foot(at.foot))
    }

    /// How a foot would move in the world at these velocities \[m/s\].
    fn foot_at(&self, leg: usize, qvel: &[f64]) -> Vector3<f64> {
        let (own, qpos) = (&self.model.legs[leg], self.engine.data().qpos());
        let trunk = TrunkFrame::new(&self.model, &self.at, qpos, qvel);
        let frame = LegFrame::new(own, &self.at.legs[leg], self.model.coordinates, qpos, qvel);
        let [foot, speed] = frame.foot(own);
        trunk.carried(&spatial(foot, own.hip[1]), &spatial(speed, 0.0))
    }
}
