//! Impulses of drives and ground, summed over time.

use crate::constraints::contact_forces::sliding;
use crate::constraints::contacts::Contact;
use crate::constraints::motion::{LegForces, Motion};
use crate::model::Model;
use crate::model::leg_constraints::CABLE;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::into_world;
use crate::model::site::Site;
use crate::model::state::State;

/// Impulses of drives and ground, summed over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImpulseSums {
    /// Hip motor and knee motor ∫ τ dt \[N·m·s\], cable ∫ F dt \[N·s\].
    pub(crate) hip: Lanes,
    pub(crate) knee: Lanes,
    pub(crate) cable: Lanes,
    /// Ground impulses on each leg, world frame \[N·s\].
    pub(crate) ground: [[f64; 3]; 4],
}

impl ImpulseSums {
    pub(crate) fn new() -> Self {
        let zero = Lanes::zero();
        Self {
            hip: zero,
            knee: zero,
            cable: zero,
            ground: [[0.0; 3]; 4],
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.hip += other.hip;
        self.knee += other.knee;
        self.cable += other.cable;
        self.add_ground(&other.ground);
    }

    /// Adds ground impulses.
    pub(crate) fn add_ground(&mut self, ground: &[[f64; 3]; 4]) {
        for (sum, part) in self
            .ground
            .iter_mut()
            .flatten()
            .zip(ground.iter().flatten())
        {
            *sum += part;
        }
    }

    /// Adds the impulses of hip motor, knee motor and cable over `weight` seconds.
    #[inline(always)]
    pub(crate) fn add_drives<const N: usize>(
        &mut self,
        model: &Model<N>,
        forces: &LegForces<Lanes>,
        weight: Lanes,
    ) {
        if model.drives.is_some() {
            self.hip += weight * forces.hip_torque;
            self.knee += weight * forces.knee_torque;
            // The error of the event time extends the motion past the event, where a cable does not
            // push.
            let tension = forces.forces[CABLE];
            self.cable += weight * tension.clamped(Lanes::zero(), Lanes::splat(f64::INFINITY));
        }
    }

    /// Adds the impulses of these contact forces over `weight` seconds; `motion` is that under
    /// them.
    pub(crate) fn add_contact_forces<const N: usize>(
        &mut self,
        model: &Model<N>,
        contacts: &[Contact],
        mut forces: &[f64],
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
    ) {
        let Some(ground) = &model.ground else {
            return;
        };
        if contacts.is_empty() {
            return;
        }
        let rotation = motion.articulated.rotation();
        for contact in contacts {
            let legs = &model.side_by_side;
            let site = Site::new(
                legs,
                &motion.articulated.chain,
                state,
                contact.leg,
                contact.links,
            );
            let footing = site.footing(ground, state.position, &rotation);
            let [n, a, b] = footing.directions;
            let rows = if contact.slides.is_some() { 1 } else { 3 };
            let (of_contact, others) = forces.split_at(rows);
            forces = others;
            if of_contact[0] <= 0.0 {
                // The error of the event time extends the motion past the event, where the ground
                // does not pull.
                continue;
            }
            let force: [f64; 3] = if let Some(last) = contact.slides {
                let s = sliding(&footing, last);
                let along = |i: usize| s[0] * a[i] + s[1] * b[i];
                let friction = model.friction[contact.leg];
                std::array::from_fn(|i| of_contact[0] * (n[i] - friction * along(i)))
            } else {
                std::array::from_fn(|i| {
                    of_contact[0] * n[i] + of_contact[1] * a[i] + of_contact[2] * b[i]
                })
            };
            let seconds = weight.lane(contact.leg);
            for (sum, part) in self.ground[contact.leg]
                .iter_mut()
                .zip(into_world(&rotation, force))
            {
                *sum += seconds * part;
            }
        }
    }
}
