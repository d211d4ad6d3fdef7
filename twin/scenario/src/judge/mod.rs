//! The judge: samples and events in, verdicts out.

mod cycle;
mod footstep;
mod gait;
mod meter;
mod outcome;
mod phase;
mod resolve;
mod tracker;
mod trunk;

use twinrig_kernel::{Layout, SimTime, Unit};

use crate::expect::{Claim, CostMeasure, Expectation};
use crate::limits::Limits;
use crate::scene::{LegFact, Scene, foot_load, foot_position};
use cycle::CycleMeter;
use footstep::{Detector, Thresholds};
use gait::Gait;
use meter::Meter;
use outcome::Finding;
use tracker::Window;
use trunk::TILT;

pub use footstep::Footstep;
pub use outcome::{Outcome, Verdict};

/// Where samples come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The outputs of the plant.
    Plant,
    /// What the controller is told.
    ProcessInputs,
    /// What the controller says.
    ProcessOutputs,
    /// What drivers and boards count.
    Gauges,
}

/// How the samples of each channel are laid out.
#[derive(Clone, Copy, Debug)]
pub struct Layouts<'l> {
    /// Of [`Channel::Plant`].
    pub plant: &'l Layout,
    /// Of [`Channel::ProcessInputs`].
    pub process_inputs: &'l Layout,
    /// Of [`Channel::ProcessOutputs`].
    pub process_outputs: &'l Layout,
    /// Of [`Channel::Gauges`].
    pub gauges: &'l Layout,
    /// The names of the tasks, which [`Cycle::Task`] numbers: those of buses.
    pub tasks: &'l [String],
}

impl Layouts<'_> {
    /// Channels and their layouts, in the order in which a signal is looked for.
    fn channels(&self) -> [(Channel, &Layout); 4] {
        [
            (Channel::Plant, self.plant),
            (Channel::ProcessInputs, self.process_inputs),
            (Channel::ProcessOutputs, self.process_outputs),
            (Channel::Gauges, self.gauges),
        ]
    }
}

/// Whose cycle something happens to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cycle {
    /// The controller's.
    Control,
    /// That of the task of this number.
    Task(usize),
}

/// What happens to a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happening {
    /// A cycle begins.
    CycleBegin,
    /// It ends.
    CycleEnd,
    /// A cycle could not begin when it should have: the last one had not ended.
    CycleMissed,
}

/// What is known when a run is over.
#[derive(Clone, Copy, Debug)]
pub struct RunEnd<'r> {
    /// When it ended. If that is before the scenario's end, nothing passes.
    pub at: SimTime,
    /// The residual of the energy books and the energy exchanged \[J\]; none where nobody keeps books.
    pub energy: Option<(f64, f64)>,
    /// The work that the plant took, by the names of [`CostMeasure::COUNTS`].
    pub work: &'r [(&'r str, u64)],
    /// Simulated over wall time; none if nobody looked at a clock.
    pub real_time_factor: Option<f64>,
    /// The footsteps of the run without changes, if there was one.
    pub reference: Option<&'r [Footstep]>,
}

/// Watches a run and says what became of each expectation. It never looks at a clock and never changes what it watches;
/// between [`Judge::new`] and [`Judge::finish`] it allocates only to keep footsteps.
#[derive(Clone, Debug)]
pub struct Judge {
    expectations: Vec<Expectation>,
    end: SimTime,
    legs: Vec<LegFact>,
    watches: Vec<Watch>,
    feet: Vec<Foot>,
    footsteps: Vec<Footstep>,
    /// Number of values of each channel.
    lengths: [usize; 4],
}

/// Fewer samples of a channel say nothing about it.
const LEAST_SAMPLES: u64 = 10;

/// What watches for one expectation.
#[derive(Clone, Debug)]
struct Watch {
    window: Window,
    channel: Channel,
    meter: Watcher,
    /// How many samples of the channel were looked at.
    samples: u64,
}

#[derive(Clone, Debug)]
enum Watcher {
    Signal(Meter),
    Cycle(Cycle, CycleMeter),
    /// Footsteps, which are judged at the end.
    Footsteps,
    /// Judged from what is known at the end.
    AtEnd,
    /// Cannot be observed, and why.
    Absent(String),
}

/// A foot whose footsteps are looked for.
#[derive(Clone, Debug)]
struct Foot {
    channel: Channel,
    load: usize,
    position: usize,
    detector: Detector,
}

impl Judge {
    /// A judge of the scene's expectations, fed with samples of these layouts.
    pub fn new(scene: &Scene, layouts: Layouts<'_>) -> Self {
        let scenario = &scene.scenario;
        let spec = scenario.observe.footsteps;
        let thresholds = Thresholds {
            touch_down: spec.touch_down.newton(scene.weight),
            lift_off: spec.lift_off.newton(scene.weight),
            shortest_swing: spec.shortest_swing,
            least_impulse: spec.least_impulse * scene.weight,
        };
        let feet = scene.legs.iter().enumerate().filter_map(|(index, leg)| {
            let (channel, load) = resolve::find(&layouts, &foot_load(&leg.name))?;
            let (other, position) = resolve::find(&layouts, &foot_position(&leg.name))?;
            (channel == other && load.len() == 1 && position.len() == 3).then(|| Foot {
                channel,
                load: load.start,
                position: position.start,
                detector: Detector::new(index, thresholds),
            })
        });
        let feet: Vec<Foot> = feet.collect();
        let expectations = scenario.expectations.iter();
        let seen_in = feet.first().map_or(Channel::Plant, |foot| foot.channel);
        let watch = |expectation| resolve::watch(expectation, scene, &layouts, seen_in);
        let watches = expectations.map(watch);
        // Four footsteps a second and leg are a brisk trot; more only cost an allocation.
        let expected = scenario.duration.as_nanos() / 1_000_000_000 * 4 * feet.len() as u64 + 64;
        Judge {
            expectations: scenario.expectations.clone(),
            end: scenario.end(),
            legs: scene.legs.clone(),
            watches: watches.collect(),
            feet,
            lengths: layouts.channels().map(|(_, layout)| layout.len()),
            footsteps: Vec::with_capacity(usize::try_from(expected).unwrap_or(64).min(1 << 20)),
        }
    }

    /// Takes the samples of a channel, laid out as [`Judge::new`] was told.
    ///
    /// # Panics
    /// If `values` has another length than the layout: whoever wired the judge made a mistake.
    #[inline]
    pub fn samples(&mut self, now: SimTime, channel: Channel, values: &[f64]) {
        assert_eq!(
            values.len(),
            self.lengths[channel as usize],
            "samples of another layout"
        );
        for foot in &mut self.feet {
            if foot.channel != channel {
                continue;
            }
            let position = foot.position;
            let position = [values[position], values[position + 1], values[position + 2]];
            if let Some(footstep) = foot.detector.sample(now, values[foot.load], position) {
                self.footsteps.push(footstep);
            }
        }
        for watch in &mut self.watches {
            if watch.channel != channel {
                continue;
            }
            match &mut watch.meter {
                Watcher::Signal(meter) if watch.window.contains(now) => {
                    watch.samples += u64::from(meter.sample(now, values));
                }
                Watcher::Signal(meter) => meter.outside(values),
                Watcher::Footsteps => {
                    watch.samples += u64::from(watch.window.contains(now));
                }
                Watcher::Cycle(..) | Watcher::AtEnd | Watcher::Absent(_) => {}
            }
        }
    }

    /// Takes an event of a cycle.
    #[inline]
    pub fn event(&mut self, now: SimTime, of: Cycle, happening: Happening) {
        for watch in &mut self.watches {
            if let Watcher::Cycle(whose, meter) = &mut watch.meter
                && *whose == of
                && watch.window.contains(now)
            {
                meter.event(now, happening);
            }
        }
    }

    /// The names of the legs, which [`Footstep::leg`] is an index of.
    pub fn legs(&self) -> impl ExactSizeIterator<Item = &str> {
        self.legs.iter().map(|leg| leg.name.as_str())
    }

    /// The footsteps so far, in the order in which they were closed: the list only grows while the run goes on. After
    /// [`Judge::finish`] it holds the footsteps that the run left open too, and is sorted by touch-down and leg.
    pub fn footsteps(&self) -> &[Footstep] {
        &self.footsteps
    }

    /// The outcomes, one for each expectation, in their order.
    pub fn finish(&mut self, run: &RunEnd<'_>) -> Vec<Outcome> {
        for foot in &mut self.feet {
            self.footsteps.extend(foot.detector.finish());
        }
        self.footsteps
            .sort_by_key(|step| (step.touch_down, step.leg));
        let outcomes = self.expectations.iter().zip(&self.watches);
        outcomes
            .map(|(expectation, watch)| {
                let mut finding = self.finding(expectation, watch, run);
                if run.at < self.end && finding.verdict == Verdict::Pass {
                    finding.verdict = Verdict::Unobserved;
                    finding.detail = format!("the run ended at {} of {}", run.at, self.end);
                }
                outcome(expectation, finding)
            })
            .collect()
    }

    fn finding(&self, expectation: &Expectation, watch: &Watch, run: &RunEnd<'_>) -> Finding {
        match (&watch.meter, &expectation.claim) {
            (Watcher::Absent(why), _) => Finding::unobserved(why.clone()),
            (Watcher::Signal(meter), _) => of_samples(meter.finding(), watch),
            (Watcher::Cycle(_, meter), _) => meter.finding(watch.window.before.min(run.at)),
            (Watcher::Footsteps, Claim::Footstep(claim)) => {
                let broken = self.feet.iter().find_map(|foot| foot.detector.broken_at);
                if broken.is_some() {
                    return Finding::not_a_number(broken);
                }
                let gait = Gait {
                    legs: &self.legs,
                    footsteps: &self.footsteps,
                    reference: run.reference,
                    window: watch.window,
                    seen: &|leg| self.feet.iter().any(|foot| foot.detector.leg() == leg),
                };
                of_samples(gait.finding(claim), watch)
            }
            (Watcher::AtEnd, Claim::EnergyResidual(limits)) => energy(run.energy, limits),
            (Watcher::AtEnd, Claim::Cost(measure, limits)) => cost(*measure, limits, run),
            (Watcher::AtEnd | Watcher::Footsteps, _) => Finding::unobserved("nothing watched it"),
        }
    }
}

/// The finding of a watch of samples.
fn of_samples(finding: Finding, watch: &Watch) -> Finding {
    finding.of_few(watch.samples, LEAST_SAMPLES, "samples")
}

fn energy(books: Option<(f64, f64)>, limits: &Limits) -> Finding {
    let Some((residual, exchanged)) = books else {
        return Finding::unobserved("nobody keeps energy books");
    };
    if exchanged == 0.0 {
        return Finding::unobserved("no energy was exchanged");
    }
    let share = residual.abs() / exchanged;
    if share.is_finite() {
        Finding::of(limits.compare(share, share), None, "")
    } else {
        Finding::not_a_number(None)
    }
}

fn cost(measure: CostMeasure, limits: &Limits, run: &RunEnd<'_>) -> Finding {
    let value = match measure {
        CostMeasure::RealTimeFactor => run.real_time_factor,
        CostMeasure::Count(name) => {
            let count = run.work.iter().find(|(known, _)| *known == name);
            count.map(|(_, count)| *count as f64)
        }
    };
    match value {
        Some(value) if value.is_finite() => Finding::of(limits.compare(value, value), None, ""),
        Some(_) => Finding::not_a_number(None),
        None => Finding::unobserved("nobody counted"),
    }
}

fn outcome(expectation: &Expectation, finding: Finding) -> Outcome {
    let finite = |value: f64| value.is_finite().then_some(value);
    let numbers = finding.comparison;
    let unit = match resolve::unit(&expectation.claim) {
        Unit::Meter if finding.detail == TILT => Unit::Radian,
        unit => unit,
    };
    Outcome {
        name: expectation.name.clone(),
        verdict: finding.verdict,
        optional: expectation.optional,
        measured: numbers.and_then(|numbers| finite(numbers.measured)),
        bound: numbers.and_then(|numbers| finite(numbers.bound)),
        other_bound: numbers.and_then(|numbers| numbers.other),
        unit,
        margin: numbers.and_then(|numbers| finite(numbers.margin)),
        first_violation: finding.first_violation,
        detail: finding.detail,
    }
}
