//! Changes of process variables: what they are to be, and the acts of a branch that let them be so.

use twinrig_kernel::SimTime;
use twinrig_runtime::{Change, RigError, slewed};

use super::{Ended, Session, next_multiple};
use crate::branch::{Act, Branch, Target};
use crate::error::LiveError;
use crate::live_run::{check_slew, index_of};

impl Session<'_> {
    /// Lets a variable of the controller have a value from the next control step on. With `slew`,
    /// the greatest change per second, it is approached in steps, one at each control step.
    ///
    /// # Errors
    /// [`LiveError::NoSuchVariable`], or [`LiveError::Refused`] if the controller would refuse the
    /// value now.
    pub fn set(&mut self, variable: &str, value: f64, slew: Option<f64>) -> Result<(), LiveError> {
        self.set_all(&[(variable, value, slew)])
    }

    /// Sets several variables as [`Self::set`] does, all or none.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_all(&mut self, values: &[(&str, f64, Option<f64>)]) -> Result<(), LiveError> {
        let mut targets = Vec::new();
        for &(variable, value, slew) in values {
            check_slew(slew)?;
            let names = self.variables.iter().map(|(name, _)| name.as_str());
            targets.push((index_of(variable, names)?, Target { value, slew }));
        }
        let values = targets.iter().map(|(index, target)| (*index, target.value));
        let checked = self.rig.check_values(&values.collect::<Vec<_>>());
        checked.map_err(|error| LiveError::Refused(refusal(error)))?;
        self.targets.extend(targets);
        Ok(())
    }

    /// Returns the value that a variable is to have, by its index.
    pub fn target(&self, variable: usize) -> Option<f64> {
        if let Some(target) = self.targets.get(&variable) {
            return Some(target.value);
        }
        Some(self.commanded(variable)?.1)
    }

    /// Returns the last value of a variable that an act gives or that it has, and the time from
    /// which it has it.
    fn commanded(&self, variable: usize) -> Option<(SimTime, f64)> {
        let made = self.branches[self.present].acts[..self.scheduled].iter();
        let last = made.rev().find(|act| act.variable == variable);
        let pending = last.filter(|act| act.at > self.now);
        pending.map(|act| (act.at, act.value)).or_else(|| {
            let variable = self.variables().get(variable)?;
            Some((self.now, variable.value()))
        })
    }

    /// Schedules the acts of the branch that were made now, and turns targets into acts.
    pub(super) fn make_acts(&mut self) {
        while let Some(act) = self.branches[self.present].acts.get(self.scheduled)
            && act.made <= self.now
            && self.targets.is_empty()
        {
            let act = act.clone();
            self.schedule(&act);
        }
        if self.targets.is_empty() {
            return;
        }
        self.leave_past();
        let period = self.rig.period();
        let at = next_multiple(self.now, period);
        let targets: Vec<(usize, Target)> = self
            .targets
            .iter()
            .map(|(&index, &target)| (index, target))
            .collect();
        for (variable, target) in targets {
            let Some((since, present)) = self.commanded(variable) else {
                continue;
            };
            // One change of a variable at an instant, and none that a scenario may not have.
            if at >= self.assembly.end() || since >= at || self.is_changed_by_scenario(variable, at)
            {
                continue;
            }
            let value = target.slew.map_or(target.value, |rate| {
                slewed(present, target.value, rate, period)
            });
            if value.to_bits() == target.value.to_bits() {
                self.targets.remove(&variable);
            }
            let act = Act {
                made: self.now,
                at,
                variable,
                value,
            };
            self.branches[self.present].acts.push(act.clone());
            self.schedule(&act);
        }
    }

    fn is_changed_by_scenario(&self, variable: usize, at: SimTime) -> bool {
        let name = &self.variables[variable].0;
        let mut changes = self.assembly.scenario().changes.iter();
        changes.any(|change| change.at == at && change.variable == *name)
    }

    /// Begins a branch if the present one has gone on from here already.
    fn leave_past(&mut self) {
        let branch = &self.branches[self.present];
        if self.now >= branch.reached && self.scheduled == branch.acts.len() {
            return;
        }
        let acts = branch.acts[..self.scheduled].to_vec();
        self.branches.push(Branch {
            parent: Some(self.present),
            begin: self.now,
            acts,
            reached: self.now,
            fingerprint: Some(self.fingerprint()),
        });
        self.present = self.branches.len() - 1;
        if let Ok(snapshots) = &mut self.snapshots {
            snapshots.truncate(self.now);
        }
    }

    fn schedule(&mut self, act: &Act) {
        let name = &self.variables[act.variable].0;
        if let Err(error) = self.rig.schedule(act.at, name, Change::To(act.value)) {
            let text = self.assembly.rig_error(error).to_string();
            self.ended = Some(Ended::Failed(text));
        }
        self.scheduled += 1;
    }
}

/// Returns the reason for which a value is refused, without the time.
fn refusal(error: RigError) -> String {
    match error {
        RigError::Change { source, .. } => source.to_string(),
        error => error.to_string(),
    }
}
