//! One run of a whole rig through a scene.

use twinrig_kernel::{Field, SimTime, Unit};
use twinrig_runtime::{Group, Observer, Rig, RunEvent, WorkCounts};

use super::factory::{RigFactory, RigVariant};
use crate::budget::Share;
use crate::number::instant;
use crate::row::Status;
use crate::stopwatch::Stopwatch;
use crate::trace::{TRUNK, Trace, is_foot};

/// What was seen of a run.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) trace: Trace,
    /// What drivers and boards had counted in the end, by name.
    pub(crate) counters: Vec<(String, f64)>,
    pub(crate) work: WorkCounts,
    /// When all devices were open, and the plant was let go \[s\].
    pub(crate) opened_s: f64,
    /// How long it took, looking included \[s\].
    pub(crate) took_s: f64,
    /// What became of it, if it did not come to its end.
    pub(crate) ended: Option<(Status, String)>,
    /// It would have taken too long.
    pub(crate) cut: bool,
}

/// Looks at feet, trunk and counters.
struct TimingObserver {
    feet: Vec<Field>,
    trunk: Option<Field>,
    counters: Vec<Field>,
    counted: Vec<f64>,
    at_s: Vec<f64>,
    feet_at: Vec<[f64; 3]>,
    trunk_at: Vec<[f64; 3]>,
    finite: bool,
    opened_s: f64,
}

impl TimingObserver {
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
            trunk: vectors().find(|field| field.port.name == TRUNK),
            counted: vec![0.0; counters.len()],
            counters,
            at_s: Vec::new(),
            feet_at: Vec::new(),
            trunk_at: Vec::new(),
            finite: true,
            opened_s: 0.0,
        }
    }

    fn run(self, rig: &Rig, took_s: f64, end: Result<(), (Status, String)>, cut: bool) -> Run {
        let names = self.feet.iter().map(|field| field.port.name.clone());
        let counters = self.counters.iter().map(|field| field.port.name.clone());
        Run {
            counters: counters.zip(self.counted).collect(),
            trace: Trace::seen(names.collect(), self.at_s, self.feet_at, self.trunk_at),
            work: rig.plant().work(),
            opened_s: self.opened_s,
            took_s,
            ended: end.err(),
            cut,
        }
    }
}

impl Observer for TimingObserver {
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
                for (field, counted) in self.counters.iter().zip(&mut self.counted) {
                    *counted = values[field.offset];
                }
            }
            Group::ProcessInputs | Group::ProcessOutputs => {}
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        // A plant that is held is where it should be, which says nothing.
        if event == RunEvent::Opened {
            self.opened_s = now.as_secs_f64();
            self.at_s.clear();
            self.feet_at.clear();
            self.trunk_at.clear();
        }
    }
}

impl Run {
    /// Builds a rig and lets it run to the end of `make`.
    ///
    /// # Errors
    /// Why it could not be built.
    pub(crate) fn of(
        factory: &dyn RigFactory,
        make: &RigVariant<'_>,
        share: Share,
    ) -> Result<Self, String> {
        let mut rig = factory.rig(make)?;
        let mut looker = TimingObserver::of(&rig);
        let watch = Stopwatch::start();
        let end = SimTime::ZERO + make.duration;
        let (mut result, mut cut) = (Ok(()), false);
        let mut to = SimTime::ZERO;
        // In pieces, which makes no difference to a rig.
        while to < end && result.is_ok() {
            to = to.checked_add(make.observe).map_or(end, |to| to.min(end));
            if let Err(error) = rig.run_until(to, &mut looker) {
                result = Err((Status::Failed, error.to_string()));
            } else if !looker.finite {
                let why = format!("something is no longer a number at {}", instant(to));
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
        let took_s = watch.elapsed_s();
        Ok(looker.run(&rig, took_s, result, cut))
    }

    /// How long the same takes without looking \[s\].
    pub(crate) fn time(factory: &dyn RigFactory, make: &RigVariant<'_>) -> Option<f64> {
        let mut rig = factory.rig(make).ok()?;
        let watch = Stopwatch::start();
        rig.run_until(SimTime::ZERO + make.duration, &mut ()).ok()?;
        Some(watch.elapsed_s())
    }

    /// Counters that are not where they were in `other`: name, there, here.
    pub(crate) fn counted_otherwise(&self, other: &Self) -> Vec<(String, f64, f64)> {
        let pairs = other.counters.iter().zip(&self.counters);
        pairs
            .filter(|((_, there), (_, here))| there != here)
            .map(|((name, there), (_, here))| (name.clone(), *there, *here))
            .collect()
    }
}
