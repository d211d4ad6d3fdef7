//! Mismatch of contacts and phases of the controller.

use std::f64::consts::PI;

use twinrig_kernel::{SimTime, signal};
use twinrig_runtime::Group;

use crate::judge::Layouts;

/// Phase of a leg in the samples of the controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    group: Group,
    element: usize,
    /// Phase since the last sample, and before \[rad\].
    last: Option<f64>,
    before: Option<f64>,
}

impl Phase {
    pub fn find(layouts: &Layouts<'_>, leg: &str) -> Result<Self, String> {
        let name = signal::of_leg(leg, signal::PHASE);
        let (group, range) = layouts
            .find(&name)
            .ok_or_else(|| format!("there is no signal {name}"))?;
        Ok(Self {
            group,
            element: range.start,
            last: None,
            before: None,
        })
    }
}

/// Share of time in which contact and phase contradict each other.
#[derive(Clone, Debug)]
pub(super) struct Mismatch {
    phases: Vec<Phase>,
    /// Time of the last sample of the phases.
    at: SimTime,
    /// Sum over the legs of the mismatched time, and of all time \[s\].
    mismatched: f64,
    observed: f64,
}

impl Mismatch {
    pub fn new(phases: Vec<Phase>) -> Self {
        Self {
            phases,
            at: SimTime::ZERO,
            mismatched: 0.0,
            observed: 0.0,
        }
    }

    pub fn reads(&self, group: Group) -> bool {
        self.phases.iter().any(|phase| phase.group == group)
    }

    #[inline]
    pub fn phases(&mut self, now: SimTime, group: Group, values: &[f64]) {
        for phase in self.phases.iter_mut().filter(|it| it.group == group) {
            phase.before = phase.last.replace(values[phase.element]);
        }
        self.at = now;
    }

    /// Adds the time `elapsed` up to `now` with these contacts. A phase output at `now` was not in
    /// effect in that time.
    #[inline]
    pub fn sample(&mut self, now: SimTime, elapsed: f64, contacts: &[bool]) {
        for (phase, contact) in self.phases.iter().zip(contacts) {
            let phase = if self.at == now {
                phase.before
            } else {
                phase.last
            };
            let Some(phase) = phase else { continue };
            let is_swing = phase.rem_euclid(2.0 * PI) < PI;
            self.observed += elapsed;
            if is_swing == *contact {
                self.mismatched += elapsed;
            }
        }
    }

    /// Returns the share, mean of the legs; none before a phase was observed.
    pub fn share(&self) -> Option<f64> {
        (self.observed > 0.0).then(|| self.mismatched / self.observed)
    }
}
