//! The judge: turns samples and events of a run into verdicts.

mod at_end;
mod bounds;
mod buses;
mod channel;
mod compare;
mod condition;
mod cycle;
mod fall;
mod footstep;
mod gait;
mod gaited;
mod gets_up;
mod labels;
mod load_cycle;
mod meter;
mod monitor;
mod observe;
mod outcome;
mod recovery;
mod resolve;
mod sequence;
mod settling;
mod sharing;
mod sliding_max;
mod steps;
mod touch_downs;
mod tracked;
mod tracker;
mod tracking;
mod trunk;
mod until;

use twinrig_kernel::SimTime;
use twinrig_runtime::Group;

use crate::expect::{Claim, Expectation};
use crate::facts::LegFact;
use crate::scene::{Scene, foot_load, foot_position};
use at_end::{cost, energy};
use channel::{Cycle, CycleEvent};
use fall::FallDetector;
use footstep::{Detector, Thresholds};
use gait::FirstLeg;
use load_cycle::LoadReaders;
use monitor::{Monitor, MonitorKind, SampleCount, sample_counts};
use outcome::{Finding, outcome};
use steps::{ReferenceStep, RunFacts, StepMeter};
use touch_downs::TouchDowns;

pub use at_end::RunEnd;
pub use channel::Layouts;
pub use footstep::Footstep;
pub use load_cycle::{LegCycle, LoadCycle};
pub use outcome::{Outcome, Verdict, Witness};
pub use tracked::{
    LIFT_SHARE_MIN, SATURATED_SHARE_MAX, Similarity, TrackedDrive, TrackedLeg, TrackedLift,
    TrackingReport,
};
pub use tracking::{CommandedGait, DriveLimits, Tracking};

/// Footsteps of a run without changes that displacements refer to; see [`Judge::reference`].
#[derive(Clone, Debug, PartialEq)]
pub struct Reference(Vec<Vec<Option<ReferenceStep>>>);

/// Observes a run and judges each expectation.
///
/// It reads no clock and does not affect the run. Between [`Judge::new`] and [`Judge::finish`] it
/// keeps statistics only, so its memory does not depend on the length of the run.
#[derive(Clone, Debug)]
pub struct Judge {
    expectations: Vec<Expectation>,
    end: SimTime,
    legs: Vec<LegFact>,
    monitors: Vec<Monitor>,
    /// Indices of the monitors of footsteps, of the monitors of cycles, and of those of signals of
    /// each group.
    step_monitors: Vec<usize>,
    cycle_monitors: Vec<usize>,
    signal_monitors: [Vec<usize>; 4],
    /// Indices of the monitors of two signals that read each group.
    pair_monitors: [Vec<usize>; 4],
    gait_monitors: Vec<usize>,
    /// Group of the feet, and its samples in each window of the monitors of footsteps.
    foot_channel: Group,
    foot_samples: Vec<SampleCount>,
    /// Whether anything reads the samples of each group.
    reads: [bool; 4],
    feet: Vec<Foot>,
    touch_downs: TouchDowns,
    load_cycles: LoadReaders,
    /// Footsteps completed by the last samples.
    closed: Vec<Footstep>,
    /// Touch-down of the first leg in the last samples.
    first_leg: FirstLeg,
    fall: FallDetector,
    /// Time at which a fall ended the run, if one did.
    ended_at: Option<SimTime>,
    has_reference: bool,
    /// Number of values of each channel.
    lengths: [usize; 4],
}

/// Least number of samples of a channel for a verdict.
const MIN_SAMPLES: u64 = 10;

/// A foot whose footsteps are detected.
#[derive(Clone, Debug)]
struct Foot {
    channel: Group,
    load: usize,
    position: usize,
    detector: Detector,
}

impl Judge {
    /// Creates a judge of the scene's expectations for samples with these layouts.
    pub fn new(scene: &Scene, layouts: Layouts<'_>) -> Self {
        let scenario = &scene.scenario;
        let feet = feet(scene, &layouts);
        let foot_channel = feet.first().map_or(Group::Plant, |foot| foot.channel);
        let monitor = |expectation| resolve::monitor(expectation, scene, &layouts, foot_channel);
        let monitors = scenario.expectations.iter().map(monitor);
        let mut monitors: Vec<Monitor> = monitors.collect();
        let is_shared = sharing::share(&mut monitors, &scenario.expectations);
        let indices = |is_selected: &dyn Fn(&Monitor) -> bool| -> Vec<usize> {
            let indices = 0..monitors.len();
            indices
                .filter(|index| is_selected(&monitors[*index]))
                .collect()
        };
        let step_monitors = indices(&Monitor::is_of_footsteps);
        let is_of_signal = |monitor: &Monitor| matches!(monitor.meter, MonitorKind::Signal(_));
        let signal_monitors = layouts.groups().map(|(group, _)| {
            let mut indices = indices(&|monitor| monitor.channel == group && is_of_signal(monitor));
            indices.retain(|index| !is_shared[*index]);
            indices
        });
        let pair_monitors = layouts
            .groups()
            .map(|(group, _)| indices(&|monitor| monitor.reads_pair(group)));
        let fall = FallDetector::new(scene, &layouts);
        let gait_monitors = indices(&|monitor| matches!(monitor.meter, MonitorKind::Gait(_)));
        let reads_of_gaits = |group| {
            let mut gaits = gait_monitors.iter().map(|index| &monitors[*index]);
            gaits.any(|monitor| {
                matches!(&monitor.meter, MonitorKind::Gait(meter) if meter.reads(group))
                    || monitor.channel == group
            })
        };
        Judge {
            expectations: scenario.expectations.clone(),
            end: scenario.end(),
            legs: scene.legs.clone(),
            load_cycles: LoadReaders::new(
                load_of_legs(&feet, foot_channel, scene.legs.len()),
                Thresholds::of(scene),
                indices(&Monitor::reads_load_cycles),
            ),
            cycle_monitors: indices(&|monitor| matches!(monitor.meter, MonitorKind::Cycle(..))),
            reads: layouts.groups().map(|(group, _)| {
                fall.reads(group)
                    || feet.iter().any(|foot| foot.channel == group)
                    || group == foot_channel && !step_monitors.is_empty()
                    || !signal_monitors[group as usize].is_empty()
                    || !pair_monitors[group as usize].is_empty()
                    || reads_of_gaits(group)
            }),
            gait_monitors,
            first_leg: FirstLeg::default(),
            step_monitors,
            signal_monitors,
            pair_monitors,
            foot_channel,
            foot_samples: sample_counts(&monitors),
            monitors,
            closed: Vec::with_capacity(feet.len()),
            feet,
            touch_downs: TouchDowns::new(),
            fall,
            ended_at: None,
            has_reference: false,
            lengths: layouts.groups().map(|(_, layout)| layout.len()),
        }
    }

    /// Collects the cycles of the loads, whether or not an expectation evaluates them; see
    /// [`Judge::load_cycles`].
    #[must_use]
    pub fn with_load_cycles(mut self) -> Self {
        self.load_cycles.collect();
        self
    }

    /// Sets the run without changes that displacements refer to, observed by a judge of the same
    /// scene.
    #[must_use]
    pub fn with_reference(mut self, reference: &Reference) -> Self {
        for (monitor, reference_steps) in self.monitors.iter_mut().zip(&reference.0) {
            if let MonitorKind::Footsteps(meter) = &mut monitor.meter {
                meter.set_reference(reference_steps);
            }
        }
        self.has_reference = true;
        self
    }

    /// Returns the reference for a run with changes, if the observed run is the one without;
    /// complete after [`Judge::finish`].
    pub fn reference(&self) -> Reference {
        let reference_steps = |monitor: &Monitor| match &monitor.meter {
            MonitorKind::Footsteps(meter) => meter.reference_steps(),
            _ => Vec::new(),
        };
        Reference(self.monitors.iter().map(reference_steps).collect())
    }

    /// Returns the names of the legs, which [`Footstep::leg`] indexes.
    pub fn legs(&self) -> impl ExactSizeIterator<Item = &str> {
        self.legs.iter().map(|leg| leg.name.as_str())
    }

    /// Returns the footsteps completed by the last [`samples`](twinrig_runtime::Observer::samples);
    /// after [`Judge::finish`] those that were open at the end of the run, by touch-down and leg. A
    /// caller that requires all of them reads them after each call.
    pub fn closed(&self) -> &[Footstep] {
        &self.closed
    }

    /// Returns the cycles of the loads found by the last
    /// [`samples`](twinrig_runtime::Observer::samples), up to 15 s after their time; after
    /// [`Judge::finish`] those up to the end of the run. They are collected by a judge
    /// [with load cycles](Judge::with_load_cycles).
    pub fn load_cycles(&self) -> &[LoadCycle] {
        self.load_cycles.collected()
    }

    /// Returns the time of the fall; none without a fall, or if the trunk is not observed.
    pub fn fell_at(&self) -> Option<SimTime> {
        self.fall.fell_at()
    }

    /// Returns the time at which a fall ended the run, if the scenario specifies that; the run
    /// should stop there.
    pub fn ended_at(&self) -> Option<SimTime> {
        self.ended_at
    }

    /// Moves the end of the scenario to `at`, where a plant has ended it regularly: expectations
    /// whose window reaches beyond are judged by what was observed until then.
    pub fn end_at(&mut self, at: SimTime) {
        self.end = self.end.min(at);
    }

    /// Returns the outcomes, one for each expectation, in their order.
    pub fn finish(&mut self, run: &RunEnd<'_>) -> Vec<Outcome> {
        self.load_cycles.clear();
        self.load_cycles.finish(&mut self.monitors);
        self.close_footsteps();
        sharing::distribute(&mut self.monitors);
        for monitor in &mut self.monitors {
            if let MonitorKind::Sequence(meter) = &mut monitor.meter {
                monitor.samples = meter.finish();
            }
        }
        let outcomes = self.expectations.iter().zip(&self.monitors);
        outcomes
            .map(|(expectation, monitor)| {
                let finding = self.finding(expectation, monitor, run);
                let finding = self.restrict_to_observed(finding, monitor, run);
                let finding = buses::restrict(finding, expectation, monitor, &self.legs, run.buses);
                outcome(expectation, monitor.named(finding))
            })
            .collect()
    }

    /// Completes the footsteps that are open at the end of the run.
    fn close_footsteps(&mut self) {
        for monitor in self.monitors.iter_mut().filter(|monitor| !monitor.fell) {
            monitor.take_samples(&self.foot_samples);
        }
        self.closed.clear();
        for foot in &mut self.feet {
            self.closed.extend(foot.detector.finish());
        }
        self.closed.sort_by_key(|step| (step.touch_down, step.leg));
        self.release_touch_downs(SimTime::MAX);
        for step in &self.closed {
            for monitor in &mut self.monitors {
                monitor.step(step);
            }
        }
    }

    /// Turns a pass into an unobserved finding if a part of the window was not observed: after a
    /// fall, or after the end of a run that ended early.
    fn restrict_to_observed(
        &self,
        finding: Finding,
        monitor: &Monitor,
        run: &RunEnd<'_>,
    ) -> Finding {
        if monitor.fell && monitor.includes_falls() {
            return finding;
        }
        if monitor.fell && finding.verdict != Verdict::Fail {
            return fell(self.fall.fell_at());
        }
        if run.at >= self.end || finding.verdict != Verdict::Pass {
            return finding;
        }
        match self.ended_at {
            Some(_) if monitor.window.before <= run.at => finding,
            Some(at) => fell(Some(at)),
            None => Finding::unobserved(format!("the run ended at {} of {}", run.at, self.end)),
        }
    }

    fn finding(&self, expectation: &Expectation, monitor: &Monitor, run: &RunEnd<'_>) -> Finding {
        match (&monitor.meter, &expectation.claim) {
            (MonitorKind::Absent(reason), _) => Finding::unobserved(reason.clone()),
            (MonitorKind::Signal(meter), _) => sample_finding(meter.finding(), monitor),
            (MonitorKind::Comparison(meter), _) => sample_finding(meter.finding(), monitor),
            (MonitorKind::Sequence(meter), _) => sample_finding(meter.finding(), monitor),
            (MonitorKind::Cycle(_, meter), _) => {
                let misses = buses::deadline_misses(expectation, monitor, run.buses);
                meter.finding(monitor.window.before.min(run.at), misses)
            }
            (MonitorKind::Footsteps(meter), _) => {
                sample_finding(self.footstep_finding(meter, monitor), monitor)
            }
            (MonitorKind::Gait(meter), _) => {
                let survived = match self.fall.fell_at().filter(|_| monitor.fell) {
                    Some(at) => {
                        // Time after the window has no influence.
                        let end = monitor.window.before.min(self.end);
                        at.since_start().as_secs_f64() / end.since_start().as_secs_f64()
                    }
                    None => 1.0,
                };
                sample_finding(meter.finding(survived), monitor)
            }
            (MonitorKind::AtEnd, Claim::EnergyResidual(limits)) => {
                energy(run.energy.as_ref(), limits)
            }
            (MonitorKind::AtEnd, Claim::Cost(measure, limits)) => cost(*measure, limits, run),
            (MonitorKind::AtEnd, _) => Finding::unobserved("it is not monitored"),
        }
    }

    fn footstep_finding(&self, meter: &StepMeter, monitor: &Monitor) -> Finding {
        let mut feet = self.feet.iter().map(|foot| &foot.detector);
        if let Some(at) = feet.clone().find_map(|detector| detector.non_finite_at) {
            return Finding::not_a_number(Some(at));
        }
        if meter.legs().is_empty() {
            return Finding::unobserved("the scene has no such leg");
        }
        let lacks_signals = |leg: &&usize| feet.all(|detector| detector.leg() != **leg);
        if let Some(leg) = meter.legs().iter().find(lacks_signals) {
            let name = &self.legs[*leg].name;
            return Finding::unobserved(format!(
                "nothing observes load and position of foot {name}"
            ));
        }
        if meter.requires_reference() && !self.has_reference {
            return Finding::unobserved("there is no reference run");
        }
        meter.finding(&RunFacts {
            legs: &self.legs,
            fell: monitor.fell,
            overflowed: self.touch_downs.has_overflowed(),
        })
    }
}

/// Returns the finding of a monitor of samples, which requires a minimum number of them.
fn sample_finding(finding: Finding, monitor: &Monitor) -> Finding {
    finding.require_count(monitor.samples, MIN_SAMPLES, "samples")
}

fn fell(at: Option<SimTime>) -> Finding {
    let seconds = at.map_or(0.0, |at| tracker::seconds(at.since_start()));
    Finding::unobserved(format!("fell at {seconds} s"))
}

/// Returns the index of the load of each leg in the samples of a channel.
fn load_of_legs(feet: &[Foot], channel: Group, legs: usize) -> Vec<Option<usize>> {
    let load = |leg| {
        let mut feet = feet.iter().filter(|foot| foot.channel == channel);
        let foot = feet.find(|foot| foot.detector.leg() == leg);
        foot.map(|foot| foot.load)
    };
    (0..legs).map(load).collect()
}

/// Returns the feet whose load and position are observed.
fn feet(scene: &Scene, layouts: &Layouts<'_>) -> Vec<Foot> {
    let thresholds = Thresholds::of(scene);
    let legs = scene.legs.iter().enumerate();
    let feet = legs.filter_map(|(index, leg)| {
        let (channel, load) = layouts.find(&foot_load(&leg.name))?;
        let (other, position) = layouts.find(&foot_position(&leg.name))?;
        (channel == other && load.len() == 1 && position.len() == 3).then(|| Foot {
            channel,
            load: load.start,
            position: position.start,
            detector: Detector::new(index, thresholds),
        })
    });
    feet.collect()
}
