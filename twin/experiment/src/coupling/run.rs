//! Run of a complete rig.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Field, SimTime, Unit, signal};
use twinrig_report::number::instant;
use twinrig_runtime::{Group, Observer, Rig, RunEvent, WorkCounts};

use super::factory::{RigFactory, RigVariant};
use crate::budget::Share;
use crate::measured::Measured;
use crate::plants::row::Status;
use crate::plants::trace::{Trace, is_foot};
use crate::stopwatch::Stopwatch;

/// Samples and totals of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    pub(crate) trace: Trace,
    /// Final counters of drivers and boards, by name.
    pub(crate) counters: Vec<(String, f64)>,
    pub(crate) work: WorkCounts,
    /// Time at which all devices were open and the plant was released \[s\].
    pub(crate) opened_s: f64,
    /// Run time, sampling included \[s\].
    pub(crate) wall_s: f64,
    /// Status and reason of a run that did not complete.
    pub(crate) ended: Option<(Status, String)>,
    /// Truncated by the budget.
    pub(crate) cut: bool,
}

impl Measured for Run {
    fn is_cut(&self) -> bool {
        self.cut
    }
}

/// Observer that samples feet, trunk and counters.
struct TraceObserver {
    feet: Vec<Field>,
    trunk: Option<Field>,
    counters: Vec<Field>,
    counter_values: Vec<f64>,
    at_s: Vec<f64>,
    feet_at: Vec<[f64; 3]>,
    trunk_at: Vec<[f64; 3]>,
    finite: bool,
    opened_s: f64,
}

impl TraceObserver {
    fn of(rig: &Rig) -> Self {
        let vectors = || {
            let fields = rig.layout(Group::Plant).fields();
            fields.filter(|field| field.port.size == 3).cloned()
        };
        let diagnostics = rig.layout(Group::Diagnostics).fields();
        let counters =
            diagnostics.filter(|field| field.port.unit == Unit::One && field.port.size == 1);
        let counters: Vec<Field> = counters.cloned().collect();
        Self {
            feet: vectors()
                .filter(|field| is_foot(&field.port.name))
                .collect(),
            trunk: vectors().find(|field| field.port.name == signal::BODY_POSITION),
            counter_values: vec![0.0; counters.len()],
            counters,
            at_s: Vec::new(),
            feet_at: Vec::new(),
            trunk_at: Vec::new(),
            finite: true,
            opened_s: 0.0,
        }
    }

    fn run(self, rig: &Rig, run_s: f64, end: Result<(), (Status, String)>, cut: bool) -> Run {
        let names = self.feet.iter().map(|field| field.port.name.clone());
        let counters = self.counters.iter().map(|field| field.port.name.clone());
        Run {
            counters: counters.zip(self.counter_values).collect(),
            trace: Trace::from_samples(names.collect(), self.at_s, self.feet_at, self.trunk_at),
            work: rig.plant().work(),
            opened_s: self.opened_s,
            wall_s: run_s,
            ended: end.err(),
            cut,
        }
    }
}

impl Observer for TraceObserver {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let place = |field: &Field| {
            let at = &values[field.range()];
            [at[0], at[1], at[2]]
        };
        match group {
            Group::Plant => {
                self.finite &= values.iter().all(|value| value.is_finite());
                self.at_s.push(now.as_secs_f64());
                self.feet_at.extend(self.feet.iter().map(place));
                self.trunk_at.extend(self.trunk.as_ref().map(place));
            }
            Group::Diagnostics => {
                for (field, value) in self.counters.iter().zip(&mut self.counter_values) {
                    *value = values[field.offset];
                }
            }
            Group::ProcessInputs | Group::ProcessOutputs => {}
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        // While the plant is held before its release, the error is zero and not significant.
        if event == RunEvent::Opened {
            self.opened_s = now.as_secs_f64();
            self.at_s.clear();
            self.feet_at.clear();
            self.trunk_at.clear();
        }
    }
}

impl Run {
    /// Builds a rig and runs it for the duration of `variant`.
    ///
    /// # Errors
    /// The reason why the rig could not be built.
    pub(crate) fn of(
        factory: &dyn RigFactory,
        variant: &RigVariant<'_>,
        share: Share,
    ) -> Result<Self, String> {
        let mut rig = factory.rig(variant)?;
        let mut observer = TraceObserver::of(&rig);
        let stopwatch = Stopwatch::start();
        let end = SimTime::ZERO + variant.duration;
        let (mut result, mut cut) = (Ok(()), false);
        let mut to = SimTime::ZERO;
        // Running a rig in pieces does not change its results.
        while to < end && result.is_ok() {
            to = to
                .checked_add(variant.observe)
                .map_or(end, |to| to.min(end));
            if let Err(error) = rig.run_until(to, &mut observer) {
                result = Err((Status::Failed, error.to_string()));
            } else if !observer.finite {
                let why = format!("a value is not finite at {}", instant(to));
                result = Err((Status::Unstable, why));
            } else if share.deadline.passed() && to < end {
                cut = true;
                let why = format!(
                    "too slow: at {} after {:.1} s, its budget",
                    instant(to),
                    share.seconds
                );
                result = Err((Status::Failed, why));
            }
        }
        let run_s = stopwatch.elapsed_s();
        Ok(observer.run(&rig, run_s, result, cut))
    }

    /// Measures the run time without sampling \[s\].
    pub(crate) fn time(factory: &dyn RigFactory, variant: &RigVariant<'_>) -> Option<f64> {
        let mut rig = factory.rig(variant).ok()?;
        let stopwatch = Stopwatch::start();
        rig.run_until(SimTime::ZERO + variant.duration, &mut ())
            .ok()?;
        Some(stopwatch.elapsed_s())
    }

    /// Returns the counters that differ from `other`: name, value there, value here.
    pub(crate) fn changed_counters(&self, other: &Self) -> Vec<(String, f64, f64)> {
        let pairs = other.counters.iter().zip(&self.counters);
        pairs
            .filter(|((_, there), (_, here))| there != here)
            .map(|((name, there), (_, here))| (name.clone(), *there, *here))
            .collect()
    }
}
