//! The judge: turns samples and events of a run into verdicts.

mod at_end;
mod channel;
mod cycle;
mod fall;
mod footstep;
mod meter;
mod outcome;
mod resolve;
mod steps;
mod touch_downs;
mod tracker;
mod trunk;

use twinrig_kernel::SimTime;
use twinrig_runtime::{EnergyBalance, Group, Observer, RunEvent, WorkCounts};

use crate::expect::{Claim, Expectation};
use crate::scene::{LegFact, Scene, foot_load, foot_position};
use at_end::{cost, energy};
use channel::{Cycle, CycleEvent};
use cycle::CycleMeter;
use fall::FallDetector;
use footstep::{Detector, Thresholds};
use meter::Meter;
use outcome::{Finding, outcome};
use steps::{ReferenceStep, RunFacts, StepMeter};
use touch_downs::{TouchDown, TouchDowns};
use tracker::Window;

pub use channel::Layouts;
pub use footstep::Footstep;
pub use outcome::{Outcome, Verdict};

/// Final data of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunEnd {
    /// Time at which the run ended. If that is before the end of the scenario, no expectation
    /// passes, unless a fall ended the run as configured and the window of the expectation was
    /// complete.
    pub at: SimTime,
    /// Energy balance of the plant; none without a plant.
    pub energy: Option<EnergyBalance>,
    /// Work of the plant; none without a plant.
    pub work: Option<WorkCounts>,
    /// Simulated over wall-clock time; none if it was not measured.
    pub real_time_factor: Option<f64>,
}

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
    /// Indices of the monitors of footsteps, of the monitors of cycles, and of those that read the
    /// samples of each group.
    step_monitors: Vec<usize>,
    cycle_monitors: Vec<usize>,
    sample_monitors: [Vec<usize>; 4],
    /// Whether anything reads the samples of each group.
    reads: [bool; 4],
    feet: Vec<Foot>,
    touch_downs: TouchDowns,
    /// Footsteps completed by the last samples.
    closed: Vec<Footstep>,
    fall: FallDetector,
    /// Time at which a fall ended the run, if one did.
    ended_at: Option<SimTime>,
    has_reference: bool,
    /// Number of values of each channel.
    lengths: [usize; 4],
}

/// Least number of samples of a channel for a verdict.
const MIN_SAMPLES: u64 = 10;

/// Monitor of one expectation.
#[derive(Clone, Debug)]
struct Monitor {
    window: Window,
    channel: Group,
    meter: MonitorKind,
    /// Number of evaluated samples of the channel.
    samples: u64,
    /// Whether the robot fell within the window of a claim about an upright robot, which is then
    /// judged by the data before the fall.
    fell: bool,
}

#[derive(Clone, Debug)]
enum MonitorKind {
    Signal(Meter),
    Cycle(Cycle, CycleMeter),
    Footsteps(StepMeter),
    /// Judged from the final data of the run.
    AtEnd,
    /// Not observable, with the reason.
    Absent(String),
}

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
        let monitors: Vec<Monitor> = scenario.expectations.iter().map(monitor).collect();
        let indices = |is_selected: &dyn Fn(&Monitor) -> bool| -> Vec<usize> {
            let indices = 0..monitors.len();
            indices
                .filter(|index| is_selected(&monitors[*index]))
                .collect()
        };
        let is_of_footsteps =
            |monitor: &Monitor| matches!(monitor.meter, MonitorKind::Footsteps(_));
        let is_of_signal = |monitor: &Monitor| matches!(monitor.meter, MonitorKind::Signal(_));
        let sample_monitors = layouts.groups().map(|(group, _)| {
            indices(&|monitor| {
                monitor.channel == group && (is_of_signal(monitor) || is_of_footsteps(monitor))
            })
        });
        let fall = FallDetector::new(scene, &layouts);
        Judge {
            expectations: scenario.expectations.clone(),
            end: scenario.end(),
            legs: scene.legs.clone(),
            step_monitors: indices(&is_of_footsteps),
            cycle_monitors: indices(&|monitor| matches!(monitor.meter, MonitorKind::Cycle(..))),
            reads: layouts.groups().map(|(group, _)| {
                fall.reads(group)
                    || feet.iter().any(|foot| foot.channel == group)
                    || !sample_monitors[group as usize].is_empty()
            }),
            sample_monitors,
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

    #[inline]
    fn find_footsteps(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        for foot in &mut self.feet {
            if foot.channel != channel {
                continue;
            }
            let position = foot.position;
            let position = [values[position], values[position + 1], values[position + 2]];
            let detection = foot.detector.sample(now, values[foot.load], position);
            if let Some(at) = detection.touch_down {
                let leg = foot.detector.leg();
                self.touch_downs.add(TouchDown { at, leg });
            }
            if let Some(step) = detection.closed {
                self.closed.push(step);
            }
        }
        if !self.touch_downs.pending().is_empty() {
            self.release_touch_downs(now);
        }
        for step in &self.closed {
            for index in &self.step_monitors {
                let monitor = &mut self.monitors[*index];
                if let (MonitorKind::Footsteps(meter), false) = (&mut monitor.meter, monitor.fell) {
                    meter.step(step);
                }
            }
        }
    }

    /// Releases the touch-downs that no earlier one can precede any more. A future one is not
    /// before `now`, nor before the touch-down of a foot whose footstep is unconfirmed.
    fn release_touch_downs(&mut self, now: SimTime) {
        let unconfirmed = self.feet.iter().filter_map(|foot| {
            let at = foot.detector.unconfirmed()?;
            let leg = foot.detector.leg();
            Some(TouchDown { at, leg })
        });
        let now = TouchDown { at: now, leg: 0 };
        let horizon = unconfirmed.fold(now, TouchDown::min);
        while let Some(touch_down) = self.touch_downs.next_before(horizon) {
            for index in &self.step_monitors {
                let monitor = &mut self.monitors[*index];
                if let (MonitorKind::Footsteps(meter), false) = (&mut monitor.meter, monitor.fell) {
                    meter.touch_down(touch_down);
                }
            }
        }
    }

    /// Handles a fall at `now`: claims about an upright robot end, with the footsteps up to now.
    fn handle_fall(&mut self, now: SimTime) {
        if self.fall.ended_at().is_some() {
            self.ended_at.get_or_insert(now);
        }
        for (monitor, expectation) in self.monitors.iter_mut().zip(&self.expectations) {
            if !expectation.claim.requires_upright_robot() || monitor.window.before < now {
                continue;
            }
            if let MonitorKind::Footsteps(meter) = &mut monitor.meter {
                for touch_down in self.touch_downs.pending() {
                    meter.touch_down(*touch_down);
                }
                for foot in &self.feet {
                    if let Some(step) = foot.detector.provisional() {
                        meter.step(&step);
                    }
                }
            }
            monitor.fell = true;
        }
    }

    /// Returns the names of the legs, which [`Footstep::leg`] indexes.
    pub fn legs(&self) -> impl ExactSizeIterator<Item = &str> {
        self.legs.iter().map(|leg| leg.name.as_str())
    }

    /// Returns the footsteps completed by the last [`Judge::samples`]; after [`Judge::finish`]
    /// those that were open at the end of the run, by touch-down and leg. A caller that requires
    /// all of them reads them after each call.
    pub fn closed(&self) -> &[Footstep] {
        &self.closed
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

    /// Returns the outcomes, one for each expectation, in their order.
    pub fn finish(&mut self, run: &RunEnd) -> Vec<Outcome> {
        self.close_footsteps();
        let outcomes = self.expectations.iter().zip(&self.monitors);
        outcomes
            .map(|(expectation, monitor)| {
                let finding = self.finding(expectation, monitor, run);
                let finding = self.restrict_to_observed(finding, monitor, run);
                outcome(expectation, finding)
            })
            .collect()
    }

    /// Completes the footsteps that are open at the end of the run.
    fn close_footsteps(&mut self) {
        self.closed.clear();
        for foot in &mut self.feet {
            self.closed.extend(foot.detector.finish());
        }
        self.closed.sort_by_key(|step| (step.touch_down, step.leg));
        self.release_touch_downs(SimTime::MAX);
        for step in &self.closed {
            for monitor in &mut self.monitors {
                if let (MonitorKind::Footsteps(meter), false) = (&mut monitor.meter, monitor.fell) {
                    meter.step(step);
                }
            }
        }
    }

    /// Turns a pass into an unobserved finding if a part of the window was not observed: after a
    /// fall, or after the end of a run that ended early.
    fn restrict_to_observed(&self, finding: Finding, monitor: &Monitor, run: &RunEnd) -> Finding {
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

    fn finding(&self, expectation: &Expectation, monitor: &Monitor, run: &RunEnd) -> Finding {
        match (&monitor.meter, &expectation.claim) {
            (MonitorKind::Absent(reason), _) => Finding::unobserved(reason.clone()),
            (MonitorKind::Signal(meter), _) => sample_finding(meter.finding(), monitor),
            (MonitorKind::Cycle(_, meter), _) => meter.finding(monitor.window.before.min(run.at)),
            (MonitorKind::Footsteps(meter), _) => {
                sample_finding(self.footstep_finding(meter, monitor), monitor)
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

impl Observer for Judge {
    /// # Panics
    /// If the length of `values` differs from that of the layout passed to [`Judge::new`].
    #[inline]
    fn samples(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        assert_eq!(
            values.len(),
            self.lengths[channel as usize],
            "the number of samples differs from the layout"
        );
        self.closed.clear();
        if !self.reads[channel as usize] {
            return;
        }
        if self.fall.sample(now, channel, values) {
            self.handle_fall(now);
        }
        self.find_footsteps(now, channel, values);
        for index in &self.sample_monitors[channel as usize] {
            let monitor = &mut self.monitors[*index];
            if monitor.fell {
                continue;
            }
            match &mut monitor.meter {
                MonitorKind::Signal(meter) if monitor.window.contains(now) => {
                    monitor.samples += u64::from(meter.sample(now, values));
                    if meter.ends_the_run() {
                        self.ended_at.get_or_insert(now);
                    }
                }
                MonitorKind::Signal(meter) => meter.outside(values),
                MonitorKind::Footsteps(_) => {
                    monitor.samples += u64::from(monitor.window.contains(now));
                }
                MonitorKind::Cycle(..) | MonitorKind::AtEnd | MonitorKind::Absent(_) => {}
            }
        }
    }

    #[inline]
    fn event(&mut self, now: SimTime, event: RunEvent) {
        let Some((of, event)) = CycleEvent::of(event) else {
            return;
        };
        for index in &self.cycle_monitors {
            let monitor = &mut self.monitors[*index];
            if let MonitorKind::Cycle(cycle, meter) = &mut monitor.meter
                && *cycle == of
                && monitor.window.contains(now)
            {
                meter.event(now, event);
            }
        }
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

/// Returns the feet whose load and position are observed.
fn feet(scene: &Scene, layouts: &Layouts<'_>) -> Vec<Foot> {
    let spec = scene.scenario.observe.footsteps;
    let thresholds = Thresholds {
        touch_down: spec.touch_down.newton(scene.weight),
        lift_off: spec.lift_off.newton(scene.weight),
        shortest_swing: spec.shortest_swing,
        least_impulse: spec.least_impulse * scene.weight,
    };
    let legs = scene.legs.iter().enumerate();
    let feet = legs.filter_map(|(index, leg)| {
        let (channel, load) = resolve::find(layouts, &foot_load(&leg.name))?;
        let (other, position) = resolve::find(layouts, &foot_position(&leg.name))?;
        (channel == other && load.len() == 1 && position.len() == 3).then(|| Foot {
            channel,
            load: load.start,
            position: position.start,
            detector: Detector::new(index, thresholds),
        })
    });
    feet.collect()
}
