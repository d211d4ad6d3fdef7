//! The judge: samples and events in, verdicts out.

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
use steps::{Counterpart, Known, StepMeter};
use touch_downs::{TouchDown, TouchDowns};
use tracker::Window;

pub use channel::Layouts;
pub use footstep::Footstep;
pub use outcome::{Outcome, Verdict};

/// What is known when a run is over.
#[derive(Clone, Copy, Debug)]
pub struct RunEnd {
    /// When it ended. If that is before the scenario's end, nothing passes, unless a fall ended it
    /// as it should and the time of the expectation was over.
    pub at: SimTime,
    /// Energy balance of the plant; none without a plant.
    pub energy: Option<EnergyBalance>,
    /// Work of the plant; none without a plant.
    pub work: Option<WorkCounts>,
    /// Simulated over wall time; none if nobody looked at a clock.
    pub real_time_factor: Option<f64>,
}

/// The footsteps of a run without changes that expectations compare with: see [`Judge::reference`].
#[derive(Clone, Debug, PartialEq)]
pub struct Reference(Vec<Vec<Option<Counterpart>>>);

/// Observes a run and judges each expectation. It never looks at a clock and never changes the run;
/// between [`Judge::new`] and [`Judge::finish`] it keeps statistics, so
/// its memory does not grow with the length of the run.
#[derive(Clone, Debug)]
pub struct Judge {
    expectations: Vec<Expectation>,
    end: SimTime,
    legs: Vec<LegFact>,
    watches: Vec<Monitor>,
    /// The watches of footsteps, by index.
    of_steps: Vec<usize>,
    feet: Vec<Foot>,
    touch_downs: TouchDowns,
    /// The footsteps that the last samples closed.
    closed: Vec<Footstep>,
    fall: FallDetector,
    /// When a fall ended the run, if it did.
    ended_at: Option<SimTime>,
    has_reference: bool,
    /// Number of values of each channel.
    lengths: [usize; 4],
}

/// Fewer samples of a channel say nothing about it.
const LEAST_SAMPLES: u64 = 10;

/// What watches for one expectation.
#[derive(Clone, Debug)]
struct Monitor {
    window: Window,
    channel: Group,
    meter: MonitorKind,
    /// How many samples of the channel were looked at.
    samples: u64,
    /// Whether the robot fell within the window of a claim that says nothing about a robot that
    /// lies: it is judged as it was before.
    fell: bool,
}

#[derive(Clone, Debug)]
enum MonitorKind {
    Signal(Meter),
    Cycle(Cycle, CycleMeter),
    Footsteps(StepMeter),
    /// Judged from what is known at the end.
    AtEnd,
    /// Cannot be observed, and why.
    Absent(String),
}

/// A foot whose footsteps are looked for.
#[derive(Clone, Debug)]
struct Foot {
    channel: Group,
    load: usize,
    position: usize,
    detector: Detector,
}

impl Judge {
    /// A judge of the scene's expectations, fed with samples of these layouts.
    pub fn new(scene: &Scene, layouts: Layouts<'_>) -> Self {
        let scenario = &scene.scenario;
        let feet = feet(scene, &layouts);
        let seen_in = feet.first().map_or(Group::Plant, |foot| foot.channel);
        let watch = |expectation| resolve::watch(expectation, scene, &layouts, seen_in);
        let watches: Vec<Monitor> = scenario.expectations.iter().map(watch).collect();
        let of_steps = |watch: &Monitor| matches!(watch.meter, MonitorKind::Footsteps(_));
        Judge {
            expectations: scenario.expectations.clone(),
            end: scenario.end(),
            legs: scene.legs.clone(),
            of_steps: (0..watches.len())
                .filter(|index| of_steps(&watches[*index]))
                .collect(),
            watches,
            closed: Vec::with_capacity(feet.len()),
            feet,
            touch_downs: TouchDowns::new(),
            fall: FallDetector::new(scene, &layouts),
            ended_at: None,
            has_reference: false,
            lengths: layouts.groups().map(|(_, layout)| layout.len()),
        }
    }

    /// The same judge, whose displacements are against the run without changes, which was watched by
    /// a judge of the same scene.
    #[must_use]
    pub fn with_reference(mut self, reference: &Reference) -> Self {
        for (watch, counterparts) in self.watches.iter_mut().zip(&reference.0) {
            if let MonitorKind::Footsteps(meter) = &mut watch.meter {
                meter.compare_with(counterparts);
            }
        }
        self.has_reference = true;
        self
    }

    /// What a run with changes is compared with, if the run that was watched is the one without;
    /// known when it is over.
    pub fn reference(&self) -> Reference {
        let counterparts = |watch: &Monitor| match &watch.meter {
            MonitorKind::Footsteps(meter) => meter.counterparts(),
            _ => Vec::new(),
        };
        Reference(self.watches.iter().map(counterparts).collect())
    }

    #[inline]
    fn find_footsteps(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        for foot in &mut self.feet {
            if foot.channel != channel {
                continue;
            }
            let position = foot.position;
            let position = [values[position], values[position + 1], values[position + 2]];
            let seen = foot.detector.sample(now, values[foot.load], position);
            if let Some(at) = seen.touch_down {
                let leg = foot.detector.leg();
                self.touch_downs.add(TouchDown { at, leg });
            }
            self.closed.extend(seen.closed);
        }
        if !self.touch_downs.waiting().is_empty() {
            self.hand_on(now);
        }
        for step in &self.closed {
            for index in &self.of_steps {
                let watch = &mut self.watches[*index];
                if let (MonitorKind::Footsteps(meter), false) = (&mut watch.meter, watch.fell) {
                    meter.step(step);
                }
            }
        }
    }

    /// Hands on the touch-downs that none can come before any more: those that may still be are not
    /// before now, nor before the touch-down of a foot that is not sure to have made a footstep.
    fn hand_on(&mut self, now: SimTime) {
        let unsure = self.feet.iter().filter_map(|foot| {
            let at = foot.detector.unsure()?;
            let leg = foot.detector.leg();
            Some(TouchDown { at, leg })
        });
        let now = TouchDown { at: now, leg: 0 };
        let horizon = unsure.fold(now, TouchDown::min);
        while let Some(touch_down) = self.touch_downs.next_before(horizon) {
            for index in &self.of_steps {
                let watch = &mut self.watches[*index];
                if let (MonitorKind::Footsteps(meter), false) = (&mut watch.meter, watch.fell) {
                    meter.touch_down(touch_down);
                }
            }
        }
    }

    /// The robot falls at `now`: claims about how it goes end here, with the footsteps as they are.
    fn fallen(&mut self, now: SimTime) {
        if self.fall.ended_at().is_some() {
            self.ended_at.get_or_insert(now);
        }
        for (watch, expectation) in self.watches.iter_mut().zip(&self.expectations) {
            if !expectation.claim.is_of_an_upright_robot() || watch.window.before < now {
                continue;
            }
            if let MonitorKind::Footsteps(meter) = &mut watch.meter {
                for touch_down in self.touch_downs.waiting() {
                    meter.touch_down(*touch_down);
                }
                for foot in &self.feet {
                    if let Some(step) = foot.detector.so_far() {
                        meter.step(&step);
                    }
                }
            }
            watch.fell = true;
        }
    }

    /// The names of the legs, which [`Footstep::leg`] is an index of.
    pub fn legs(&self) -> impl ExactSizeIterator<Item = &str> {
        self.legs.iter().map(|leg| leg.name.as_str())
    }

    /// The footsteps that the last [`Judge::samples`] closed; after [`Judge::finish`] those that the
    /// run left open, by touch-down and leg. Whoever wants them all takes them every time.
    pub fn closed(&self) -> &[Footstep] {
        &self.closed
    }

    /// When the robot fell; none if it did not, or if nothing is observed of its trunk.
    pub fn fell_at(&self) -> Option<SimTime> {
        self.fall.fell_at()
    }

    /// When a fall ended the run, where the scenario wants that: nothing later is to be run.
    pub fn ended_at(&self) -> Option<SimTime> {
        self.ended_at
    }

    /// The outcomes, one for each expectation, in their order.
    pub fn finish(&mut self, run: &RunEnd) -> Vec<Outcome> {
        self.close_footsteps();
        let outcomes = self.expectations.iter().zip(&self.watches);
        outcomes
            .map(|(expectation, watch)| {
                let finding = self.finding(expectation, watch, run);
                let finding = self.of_the_time_that_was(finding, watch, run);
                outcome(expectation, finding)
            })
            .collect()
    }

    /// The footsteps that the run leaves open are over with it.
    fn close_footsteps(&mut self) {
        self.closed.clear();
        for foot in &mut self.feet {
            self.closed.extend(foot.detector.finish());
        }
        self.closed.sort_by_key(|step| (step.touch_down, step.leg));
        self.hand_on(SimTime::MAX);
        for step in &self.closed {
            for watch in &mut self.watches {
                if let (MonitorKind::Footsteps(meter), false) = (&mut watch.meter, watch.fell) {
                    meter.step(step);
                }
            }
        }
    }

    /// Nothing passes of which a part was not seen: after a fall, or after the end of a run that
    /// ended early.
    fn of_the_time_that_was(&self, finding: Finding, watch: &Monitor, run: &RunEnd) -> Finding {
        if watch.fell && finding.verdict != Verdict::Fail {
            return fell(self.fall.fell_at());
        }
        if run.at >= self.end || finding.verdict != Verdict::Pass {
            return finding;
        }
        match self.ended_at {
            Some(_) if watch.window.before <= run.at => finding,
            Some(at) => fell(Some(at)),
            None => Finding::unobserved(format!("the run ended at {} of {}", run.at, self.end)),
        }
    }

    fn finding(&self, expectation: &Expectation, watch: &Monitor, run: &RunEnd) -> Finding {
        match (&watch.meter, &expectation.claim) {
            (MonitorKind::Absent(why), _) => Finding::unobserved(why.clone()),
            (MonitorKind::Signal(meter), _) => of_samples(meter.finding(), watch),
            (MonitorKind::Cycle(_, meter), _) => meter.finding(watch.window.before.min(run.at)),
            (MonitorKind::Footsteps(meter), _) => {
                of_samples(self.of_footsteps(meter, watch), watch)
            }
            (MonitorKind::AtEnd, Claim::EnergyResidual(limits)) => {
                energy(run.energy.as_ref(), limits)
            }
            (MonitorKind::AtEnd, Claim::Cost(measure, limits)) => cost(*measure, limits, run),
            (MonitorKind::AtEnd, _) => Finding::unobserved("nothing watched it"),
        }
    }

    fn of_footsteps(&self, meter: &StepMeter, watch: &Monitor) -> Finding {
        let mut feet = self.feet.iter().map(|foot| &foot.detector);
        if let Some(at) = feet.clone().find_map(|detector| detector.broken_at) {
            return Finding::not_a_number(Some(at));
        }
        if meter.legs().is_empty() {
            return Finding::unobserved("the scene has no such leg");
        }
        let unseen = |leg: &&usize| feet.all(|detector| detector.leg() != **leg);
        if let Some(leg) = meter.legs().iter().find(unseen) {
            let name = &self.legs[*leg].name;
            return Finding::unobserved(format!("nothing tells load and place of foot {name}"));
        }
        if meter.wants_a_reference() && !self.has_reference {
            return Finding::unobserved("there was no run without changes");
        }
        meter.finding(&Known {
            legs: &self.legs,
            fell: watch.fell,
            lost: self.touch_downs.is_lost(),
        })
    }
}

impl Observer for Judge {
    /// # Panics
    /// If `values` has another length than the layout that [`Judge::new`] was given.
    #[inline]
    fn samples(&mut self, now: SimTime, channel: Group, values: &[f64]) {
        assert_eq!(
            values.len(),
            self.lengths[channel as usize],
            "samples of another layout"
        );
        self.closed.clear();
        if self.fall.sample(now, channel, values) {
            self.fallen(now);
        }
        self.find_footsteps(now, channel, values);
        for watch in &mut self.watches {
            if watch.channel != channel || watch.fell {
                continue;
            }
            match &mut watch.meter {
                MonitorKind::Signal(meter) if watch.window.contains(now) => {
                    watch.samples += u64::from(meter.sample(now, values));
                    if meter.ends_the_run() {
                        self.ended_at.get_or_insert(now);
                    }
                }
                MonitorKind::Signal(meter) => meter.outside(values),
                MonitorKind::Footsteps(_) => {
                    watch.samples += u64::from(watch.window.contains(now));
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
        for watch in &mut self.watches {
            if let MonitorKind::Cycle(cycle, meter) = &mut watch.meter
                && *cycle == of
                && watch.window.contains(now)
            {
                meter.event(now, event);
            }
        }
    }
}

/// The finding of a watch of samples.
fn of_samples(finding: Finding, watch: &Monitor) -> Finding {
    finding.of_few(watch.samples, LEAST_SAMPLES, "samples")
}

fn fell(at: Option<SimTime>) -> Finding {
    let seconds = at.map_or(0.0, |at| tracker::seconds(at.since_start()));
    Finding::unobserved(format!("fell at {seconds} s"))
}

/// The feet whose load and place are observed.
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
