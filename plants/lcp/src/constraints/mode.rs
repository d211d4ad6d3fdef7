//! Contact mode: the active stops and cables inside the legs, the motors, and the contacts on the
//! ground.

use twinrig_legged::ExternalLoad;

use crate::constraints::contacts::{Contact, Contacts};
use crate::model::drives::Commands;
use crate::model::leg_constraints::{
    ActiveConstraints, CABLE, CONSTRAINTS, DIAGONAL, HIP, PANTOGRAPH,
};
use crate::model::real::{Lanes, Real, Wide};

/// Active constraints, commands and contacts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mode {
    pub(crate) active: ActiveConstraints<Lanes>,
    pub(crate) commands: Commands<Lanes>,
    /// Kinds of constraints that are active in at least one leg.
    pub(crate) any: [bool; CONSTRAINTS],
    pub(crate) contacts: Contacts,
    /// Load of pushes at the present stage, if any; no part of the saved state.
    pub(crate) load: Option<ExternalLoad>,
}

impl Mode {
    /// Mode without constraints and without motors.
    pub(crate) fn free() -> Self {
        let none = Lanes::zero();
        Self {
            active: ActiveConstraints {
                hip: none,
                closed: none,
                open: none,
                extended: none,
                bottomed: none,
                cable: none,
            },
            commands: Commands {
                hip: none,
                pulley: none,
                hip_saturated: none,
                pulley_saturated: none,
                hip_damping: none,
                pulley_damping: none,
            },
            any: [false; CONSTRAINTS],
            contacts: Contacts::none(),
            load: None,
        }
    }

    /// Returns the mode of the motors only.
    pub(crate) fn drives_only(&self) -> Self {
        let mut mode = Self::free();
        mode.active.hip = self.active.hip;
        mode.commands = self.commands;
        mode
    }

    /// Recomputes the kinds of constraints that are active in at least one leg.
    pub(crate) fn update_any(&mut self) {
        let in_any = |lanes: Lanes| lanes.to_array().iter().any(|&active| active != 0.0);
        let active = &self.active;
        self.any[HIP] = in_any(active.hip);
        self.any[PANTOGRAPH] = in_any(active.closed + active.open);
        self.any[DIAGONAL] = in_any(active.extended + active.bottomed);
        self.any[CABLE] = in_any(active.cable);
    }

    /// Deactivates stops, cables and contacts.
    pub(crate) fn deactivate(&mut self) {
        let none = Lanes::zero();
        let active = &mut self.active;
        for constraint in [
            &mut active.closed,
            &mut active.open,
            &mut active.extended,
            &mut active.bottomed,
            &mut active.cable,
        ] {
            *constraint = none;
        }
        self.contacts.clear();
    }

    /// Returns the number of constraints that are active now and were not in `before`.
    pub(crate) fn activated_since(&self, before: &Self) -> u64 {
        let all = |mode: &Self| {
            let active = &mode.active;
            [
                active.closed,
                active.open,
                active.extended,
                active.bottomed,
                active.cable,
            ]
        };
        let mut activated = 0;
        for (now, then) in all(self).into_iter().zip(all(before)) {
            for (now, then) in now.to_array().into_iter().zip(then.to_array()) {
                activated += u64::from(now != 0.0 && then == 0.0);
            }
        }
        for contact in &self.contacts {
            let known = |other: &Contact| (other.leg, other.links) == (contact.leg, contact.links);
            activated += u64::from(!before.contacts.iter().any(known));
        }
        activated
    }
}

impl<R> ActiveConstraints<R> {
    /// Converts to another number type.
    pub(crate) fn map<S>(&self, of: impl Fn(&R) -> S) -> ActiveConstraints<S> {
        ActiveConstraints {
            hip: of(&self.hip),
            closed: of(&self.closed),
            open: of(&self.open),
            extended: of(&self.extended),
            bottomed: of(&self.bottomed),
            cable: of(&self.cable),
        }
    }
}

impl Commands<Lanes> {
    /// Converts to another number type.
    pub(crate) fn widened<R: Wide>(&self) -> Commands<R> {
        Commands {
            hip: R::of(self.hip),
            pulley: R::of(self.pulley),
            hip_saturated: R::of(self.hip_saturated),
            pulley_saturated: R::of(self.pulley_saturated),
            hip_damping: R::of(self.hip_damping),
            pulley_damping: R::of(self.pulley_damping),
        }
    }
}
