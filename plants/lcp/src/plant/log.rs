//! Event log.

use crate::constraints::events::Stop;
use crate::constraints::mode::{Contact, Mode};
use crate::integrators::flow::Flow;
use crate::model::real::Real;

/// Activation or deactivation of a stop or a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoggedEvent {
    pub(crate) at_s: f64,
    pub(crate) leg: usize,
    pub(crate) what: &'static str,
    pub(crate) reached: bool,
}

impl Stop {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::Open => "open",
            Self::Extended => "extended",
            Self::Bottomed => "bottomed",
            Self::Cable => "cable",
        }
    }
}

impl<const N: usize> Flow<N> {
    /// Logs the differences between the present mode and `next`.
    pub(crate) fn log_changes(&mut self, next: &Mode, at_s: f64) {
        if !self.logging {
            return;
        }
        for leg in 0..self.model.legs.len() {
            for stop in Stop::ALL {
                let [was, is] =
                    [&self.mode, next].map(|mode| stop.active_in(mode).lane(leg) != 0.0);
                if was != is {
                    let (what, reached) = (stop.name(), is);
                    self.log.push(LoggedEvent {
                        at_s,
                        leg,
                        what,
                        reached,
                    });
                }
            }
            for links in 3..=N {
                let stands = |mode: &Mode| {
                    let of = |c: &Contact| (c.leg, c.links) == (leg, links);
                    mode.contacts.iter().any(of)
                };
                if stands(&self.mode) != stands(next) {
                    let what = if links == 3 { "ground" } else { "toe" };
                    let reached = stands(next);
                    self.log.push(LoggedEvent {
                        at_s,
                        leg,
                        what,
                        reached,
                    });
                }
            }
        }
    }
}
