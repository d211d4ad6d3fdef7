//! Event log.

use super::contacts::Contact;
use super::events::Stop;
use super::mode::Mode;
use crate::model::real::Real;

/// Activation or deactivation of a stop or a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LoggedEvent {
    pub(crate) at_s: f64,
    pub(crate) leg: usize,
    pub(crate) what: &'static str,
    pub(crate) reached: bool,
}

/// Log of the changes of mode, while enabled.
#[derive(Debug, Clone, Default)]
pub(crate) struct EventLog {
    pub(crate) enabled: bool,
    pub(crate) events: Vec<LoggedEvent>,
}

impl EventLog {
    /// Logs the differences between two modes of a robot with legs of up to `links` links.
    pub(crate) fn record(
        &mut self,
        legs: usize,
        links: usize,
        [before, after]: [&Mode; 2],
        at_s: f64,
    ) {
        if !self.enabled {
            return;
        }
        for leg in 0..legs {
            for stop in Stop::ALL {
                let [was, is] = [before, after].map(|mode| stop.active_in(mode).lane(leg) != 0.0);
                self.push(at_s, leg, stop.name(), [was, is]);
            }
            for links in 3..=links {
                let [was, is] = [before, after].map(|mode| {
                    let of = |c: &Contact| (c.leg, c.links) == (leg, links);
                    mode.contacts.iter().any(of)
                });
                let what = if links == 3 { "ground" } else { "toe" };
                self.push(at_s, leg, what, [was, is]);
            }
        }
    }

    /// Logs a constraint if it has become active or inactive.
    fn push(&mut self, at_s: f64, leg: usize, what: &'static str, [was, is]: [bool; 2]) {
        if was != is {
            self.events.push(LoggedEvent {
                at_s,
                leg,
                what,
                reached: is,
            });
        }
    }
}
