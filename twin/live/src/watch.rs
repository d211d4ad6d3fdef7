//! Fingerprint, judge and events of a run on the way.

use std::collections::VecDeque;

use twinrig_kernel::{SimTime, signal};
use twinrig_record::Fingerprint;
use twinrig_rig::Assembly;
use twinrig_rig::run::executor::Executor;
use twinrig_rig::run::judging::judge;
use twinrig_runtime::{Group, Observer, RunEvent};
use twinrig_scenario::{Judge, Outcome, RunEnd};

/// Number of events that are kept.
const EVENTS: usize = 256;

/// Something that happens at an instant, to which a run can be advanced.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Instant.
    pub at: SimTime,
    /// What happens.
    pub kind: EventKind,
}

/// Kind of an event.
#[derive(Clone, Debug, PartialEq)]
pub enum EventKind {
    /// The foot of a leg begins to bear load.
    TouchDown(String),
    /// The foot of a leg bears no load any longer.
    LiftOff(String),
    /// A process variable has a new value.
    Change {
        /// Index of the variable.
        variable: usize,
        /// Its new value.
        value: f64,
    },
    /// A task, by its index, is busy beyond its period.
    Skipped(usize),
    /// The process is busy beyond its period.
    Overrun,
    /// All devices are open.
    Opened,
    /// The robot falls.
    Fall,
}

/// A foot: its leg, the place of its load in the samples of the plant, and whether it is loaded.
#[derive(Clone)]
struct Foot {
    leg: usize,
    load: usize,
    is_loaded: Option<bool>,
}

/// What is kept of a run up to an instant.
#[derive(Clone)]
pub(crate) struct Watch {
    pub(crate) fingerprint: Fingerprint,
    pub(crate) judge: Judge,
    feet: Vec<Foot>,
}

impl Watch {
    pub(crate) fn new(assembly: &Assembly<'_>, executor: &dyn Executor) -> Self {
        let judge = judge(assembly, executor);
        let layout = executor.layout(Group::Plant);
        let foot = |(leg, name): (usize, &str)| {
            let load = layout.find(&signal::of_leg(name, signal::FOOT_LOAD))?;
            Some(Foot {
                leg,
                load: load.start,
                is_loaded: None,
            })
        };
        Self {
            feet: judge.legs().enumerate().filter_map(foot).collect(),
            fingerprint: Fingerprint::new(),
            judge,
        }
    }

    /// Returns the outcomes that the expectations would have if the scenario ended with `run`, now.
    pub(crate) fn outcomes(&self, run: &RunEnd<'_>) -> Vec<Outcome> {
        let mut judge = self.judge.clone();
        judge.end_at(run.at);
        judge.finish(run)
    }
}

/// The newest events of a session, and the number of all.
#[derive(Default)]
pub(crate) struct Events {
    pub(crate) newest: VecDeque<Event>,
    pub(crate) count: u64,
}

impl Events {
    fn add(&mut self, at: SimTime, kind: EventKind) {
        if self.newest.len() == EVENTS {
            self.newest.pop_front();
        }
        self.newest.push_back(Event { at, kind });
        self.count += 1;
    }

    /// Removes those after `at`, which a run that is sought back to `at` has yet to have.
    pub(crate) fn truncate(&mut self, at: SimTime) {
        self.newest.retain(|event| event.at <= at);
    }
}

/// Observer of a session: its watch, its events, and the caller's.
pub(crate) struct Watched<'w> {
    pub(crate) watch: &'w mut Watch,
    pub(crate) events: &'w mut Events,
    pub(crate) caller: &'w mut dyn Observer,
}

impl Observer for Watched<'_> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let Watch {
            fingerprint,
            judge,
            feet,
        } = &mut *self.watch;
        Observer::samples(fingerprint, now, group, values);
        let stood = judge.fell_at().is_none();
        judge.samples(now, group, values);
        if group == Group::Plant {
            for foot in feet {
                let is_loaded = values[foot.load] > 0.0;
                if foot.is_loaded.is_some_and(|was| was != is_loaded) {
                    let leg = judge.legs().nth(foot.leg).unwrap_or_default().to_owned();
                    let kind = if is_loaded {
                        EventKind::TouchDown(leg)
                    } else {
                        EventKind::LiftOff(leg)
                    };
                    self.events.add(now, kind);
                }
                foot.is_loaded = Some(is_loaded);
            }
        }
        if stood && judge.fell_at().is_some() {
            self.events.add(now, EventKind::Fall);
        }
        self.caller.samples(now, group, values);
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        Observer::event(&mut self.watch.fingerprint, now, event);
        self.watch.judge.event(now, event);
        let kind = match event {
            RunEvent::Change { variable, value } => Some(EventKind::Change { variable, value }),
            RunEvent::TaskSkipped {
                task,
                implied: false,
            } => Some(EventKind::Skipped(task)),
            RunEvent::Overrun { .. } => Some(EventKind::Overrun),
            RunEvent::Opened => Some(EventKind::Opened),
            RunEvent::ProcessBegin { .. }
            | RunEvent::ProcessEnd
            | RunEvent::TaskBegin { .. }
            | RunEvent::TaskEnd { .. }
            | RunEvent::TaskSkipped { .. } => None,
        };
        if let Some(kind) = kind {
            self.events.add(now, kind);
        }
        self.caller.event(now, event);
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        Observer::bytes(&mut self.watch.fingerprint, now, trace, bytes);
        self.caller.bytes(now, trace, bytes);
    }
}
