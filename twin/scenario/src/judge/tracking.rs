//! How legs follow their commands: tracking error and saturation of the drives, lift of the feet.
//!
//! It is no expectation: it has no effect on verdicts, and uses only signals that are observed.

use twinrig_kernel::SimTime;
use twinrig_kernel::signal::{DRIVES, FOOT_CLEARANCE, command, of_leg};
use twinrig_runtime::Group;

use super::Layouts;
use super::footstep::Footstep;
use super::gaited::GaitNumbers;
use super::tracked::{TrackedDrive, TrackedLeg, TrackedLift, TrackingReport};
use crate::actuator::ActuatorKind;
use crate::facts::LegFact;
use crate::left_out::LeftOut;
use crate::scene::Scene;

/// Distance from the torque–speed line, as a share of stall torque or no-load speed, within which a
/// drive counts as saturated: torques and rates are means over a period.
const LINE_TOLERANCE: f64 = 0.02;

/// Torque–speed line of a drive: of a servo, or of a motor at its supply voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits {
    /// Speed without load \[rad/s\].
    pub speed: f64,
    /// Stall torque \[N·m\].
    pub torque: f64,
}

impl DriveLimits {
    /// Returns whether a drive is on its torque–speed line at a torque \[N·m\] and a rate
    /// \[rad/s\], in either direction. A drive that is driven back has its stall torque.
    #[inline]
    fn saturates(&self, torque: f64, rate: f64) -> bool {
        let (torque, rate) = (torque / self.torque, rate / self.speed);
        let at = |torque: f64, rate: f64| torque >= (1.0 - rate).clamp(0.0, 1.0) - LINE_TOLERANCE;
        at(torque, rate) || at(-torque, -rate)
    }
}

/// Commanded motion that samples do not contain.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CommandedGait {
    /// Commanded step height of each leg of the scene \[m\]; none if the controller has none.
    pub step_heights: Vec<Option<f64>>,
    /// Reason for which step heights are unknown; none if they are known.
    pub no_step_heights: Option<String>,
    /// Time from the first command in which the gait grows to its full size \[s\].
    pub ramp: f64,
    /// Limits of the drives of hip and knee; none for drives without limits.
    pub limits: Option<[DriveLimits; 2]>,
}

impl CommandedGait {
    /// Returns whether a leg is commanded to step.
    fn has_steps(&self) -> bool {
        let heights = self.step_heights.iter().flatten();
        heights.into_iter().any(|height| *height > 0.0)
    }
}

/// Observer of a run that compares commands of the legs' drives with their motion.
#[derive(Clone, Debug)]
pub struct Tracking {
    legs: Vec<LegTracking>,
    /// Whether a drive or the clearance of a foot is in each group.
    reads: [bool; 4],
    /// Last observation of each group.
    observed: [Option<SimTime>; 4],
    ramp: f64,
    /// Times of the first command and of the end of the ramp; none before the first command.
    started: Option<[SimTime; 2]>,
    numbers: Option<GaitNumbers>,
    left_out: Vec<LeftOut>,
}

#[derive(Clone, Debug)]
struct LegTracking {
    /// Index in the scene.
    index: usize,
    name: String,
    drives: Vec<DriveTracking>,
    step_height: Option<f64>,
    /// Group and element of the clearance.
    clearance: Option<(Group, usize)>,
    lifts: Lifts,
}

/// Greatest clearances of a foot from one footstep to the next.
#[derive(Clone, Copy, Debug)]
struct Lifts {
    /// Greatest clearance since the last footstep was complete; none before the first one.
    greatest: Option<f64>,
    count: u64,
    sum: f64,
    least: f64,
}

#[derive(Clone, Debug)]
struct DriveTracking {
    name: &'static str,
    command: usize,
    group: Group,
    position: usize,
    torque: Option<usize>,
    limits: Option<DriveLimits>,
    commanded: Option<f64>,
    /// Position in the last observation of its group.
    last: Option<f64>,
    /// Statistics of the ramp, and of the gait at its full size.
    ramp: DriveStatistics,
    full: DriveStatistics,
}

#[derive(Clone, Copy, Debug, Default)]
struct DriveStatistics {
    count: u64,
    squares: f64,
    peak: f64,
    peak_at: SimTime,
    /// Number of periods, and of those in which it was saturated.
    periods: u64,
    saturated: u64,
}

impl DriveTracking {
    /// Evaluates a sample, `elapsed` seconds after the last, in the ramp or after it.
    #[inline]
    fn sample(&mut self, now: SimTime, elapsed: f64, values: &[f64], in_ramp: bool) {
        let position = values[self.position];
        let last = self.last.replace(position);
        let Some(commanded) = self.commanded else {
            return;
        };
        let of = if in_ramp {
            &mut self.ramp
        } else {
            &mut self.full
        };
        let error = commanded - position;
        of.count += 1;
        of.squares += error * error;
        if error.abs() > of.peak {
            (of.peak, of.peak_at) = (error.abs(), now);
        }
        if let (Some(limits), Some(torque), Some(from)) = (&self.limits, self.torque, last) {
            let rate = (position - from) / elapsed;
            of.periods += 1;
            of.saturated += u64::from(limits.saturates(values[torque], rate));
        }
    }
}

impl DriveStatistics {
    fn tracked(&self, drive: &'static str) -> Option<TrackedDrive> {
        let rms = (self.squares / self.count as f64).sqrt();
        // The first sample that is not finite makes the mean so.
        rms.is_finite().then(|| TrackedDrive {
            drive,
            rms,
            peak: self.peak,
            peak_at: self.peak_at,
            saturated: (self.periods > 0).then(|| self.saturated as f64 / self.periods as f64),
        })
    }
}

impl Lifts {
    const NONE: Lifts = Lifts {
        greatest: None,
        count: 0,
        sum: 0.0,
        least: f64::INFINITY,
    };

    /// Completes a swing and begins the next one. A footstep is complete some time after its
    /// lift-off, so that the greatest clearance is that of the swing before it.
    fn close(&mut self) {
        if let Some(greatest) = self.greatest.replace(0.0) {
            self.count += 1;
            self.sum += greatest;
            self.least = self.least.min(greatest);
        }
    }

    fn tracked(&self, commanded: Option<f64>) -> Option<TrackedLift> {
        Some(TrackedLift {
            commanded: commanded.filter(|_| self.count > 0)?,
            mean: self.sum / self.count as f64,
            least: self.least,
            count: self.count,
        })
    }
}

impl Tracking {
    /// Creates the observer of a scene for samples with these layouts; none if the controller
    /// commands no drive of a leg.
    pub fn new(scene: &Scene, layouts: &Layouts<'_>, gait: &CommandedGait) -> Option<Self> {
        let mut left_out = Vec::new();
        let legs = scene.legs.iter().enumerate();
        let legs: Vec<LegTracking> = legs
            .filter_map(|(index, leg)| {
                let step_height = gait.step_heights.get(index).copied().flatten();
                leg_tracking((index, leg), step_height, layouts, gait, &mut left_out)
            })
            .collect();
        if legs.is_empty() {
            return None;
        }
        if let Some(why) = &gait.no_step_heights {
            omit(&mut left_out, LIFT, why);
        }
        if gait.limits.is_none() {
            let why = match scene.scenario.actuator.kind {
                ActuatorKind::Ideal | ActuatorKind::None => "the drives have no limits",
                ActuatorKind::Motor | ActuatorKind::Servo | ActuatorKind::Serial => {
                    "there is no robot file with the limits of the drives"
                }
            };
            omit(&mut left_out, "saturation of the drives", why);
        }
        let reads = layouts.groups().map(|(group, _)| {
            legs.iter().any(|leg| {
                let mut drives = leg.drives.iter();
                drives.any(|drive| drive.group == group)
                    || leg.clearance.is_some_and(|(of, _)| of == group)
            })
        });
        Some(Tracking {
            legs,
            reads,
            observed: [None; 4],
            ramp: gait.ramp,
            started: None,
            numbers: gait
                .has_steps()
                .then(|| GaitNumbers::new(scene, layouts))
                .flatten(),
            left_out,
        })
    }

    /// Evaluates the samples of a group.
    #[inline]
    pub fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group == Group::ProcessOutputs {
            let ramp = self.ramp;
            self.started.get_or_insert_with(|| [now, after(now, ramp)]);
            for drive in self.legs.iter_mut().flat_map(|leg| &mut leg.drives) {
                drive.commanded = Some(values[drive.command]);
            }
        }
        let in_ramp = !self.is_full_at(now);
        if let Some(numbers) = self.numbers.as_mut().filter(|_| !in_ramp) {
            numbers.samples(now, group, values);
        }
        if !self.reads[group as usize] {
            return;
        }
        let last = self.observed[group as usize].replace(now);
        let elapsed = last.map_or(0.0, |last| (now - last).as_secs_f64());
        for leg in &mut self.legs {
            for drive in leg.drives.iter_mut().filter(|drive| drive.group == group) {
                drive.sample(now, elapsed, values, in_ramp);
            }
            if let (Some((of, element)), Some(greatest)) = (leg.clearance, &mut leg.lifts.greatest)
                && of == group
                && values[element] > *greatest
            {
                *greatest = values[element];
            }
        }
    }

    /// Evaluates a completed footstep.
    pub fn footstep(&mut self, step: &Footstep) {
        let is_full = self.is_full_at(step.touch_down);
        if let Some(numbers) = self.numbers.as_mut().filter(|_| is_full) {
            numbers.footstep(step);
        }
        let leg = self.legs.iter_mut().find(|leg| leg.index == step.leg);
        if let Some(leg) = leg.filter(|_| is_full) {
            leg.lifts.close();
        }
    }

    /// Returns whether the gait has its full size.
    fn is_full_at(&self, now: SimTime) -> bool {
        self.started.is_some_and(|[_, full]| full < now)
    }

    /// Returns the tracking up to now: of the gait at its full size, or of its ramp if the run
    /// ended before.
    pub fn report(&self) -> TrackingReport {
        let mut left_out = self.left_out.clone();
        let mut drives = self.legs.iter().flat_map(|leg| &leg.drives);
        let in_ramp = !drives.any(|drive| drive.full.count > 0);
        let legs = self.legs.iter();
        let legs: Vec<TrackedLeg> = legs
            .map(|leg| TrackedLeg {
                leg: leg.name.clone(),
                drives: leg
                    .drives
                    .iter()
                    .filter_map(|drive| {
                        let of = if in_ramp { &drive.ramp } else { &drive.full };
                        of.tracked(drive.name)
                    })
                    .collect(),
                lift: leg.lifts.tracked(leg.step_height),
            })
            .collect();
        if in_ramp {
            let why = "the run ended before the gait had its full size";
            omit(&mut left_out, LIFT, why);
        } else if self.legs.iter().any(|leg| leg.lifts.count == 0)
            && left_out.iter().all(|left_out| left_out.part != LIFT)
        {
            omit(&mut left_out, LIFT, "a foot made no two footsteps");
        }
        TrackingReport {
            from: self.started.map_or(
                SimTime::ZERO,
                |[ramp, full]| if in_ramp { ramp } else { full },
            ),
            in_ramp,
            legs,
            similarity: self.numbers.as_ref().map(GaitNumbers::similarity),
            left_out,
        }
    }
}

/// Name of the lift among omitted parts.
const LIFT: &str = "lift of the feet";

/// Adds an omitted part, unless it is there.
fn omit(left_out: &mut Vec<LeftOut>, part: &str, why: &str) {
    if left_out.iter().all(|other| other.part != part) {
        left_out.push(LeftOut {
            part: part.to_owned(),
            why: why.to_owned(),
        });
    }
}

/// Returns the time `seconds` after `now`.
fn after(now: SimTime, seconds: f64) -> SimTime {
    let nanos = (seconds * 1e9).clamp(0.0, 1e18);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "it is not negative, and below 2^63"
    )]
    let nanos = nanos as u64;
    let later = twinrig_kernel::SimDuration::from_nanos(nanos);
    now.checked_add(later).unwrap_or(SimTime::MAX)
}

/// Returns the tracking of a leg; none if the controller does not command its drives.
fn leg_tracking(
    (leg_index, leg): (usize, &LegFact),
    step_height: Option<f64>,
    layouts: &Layouts<'_>,
    gait: &CommandedGait,
    left_out: &mut Vec<LeftOut>,
) -> Option<LegTracking> {
    let mut drives = Vec::new();
    let mut is_commanded = false;
    for (index, (position, torque)) in DRIVES.into_iter().enumerate() {
        let name = TrackingReport::DRIVES[index];
        let Some(commanded) = layouts.process_outputs.find(&command(&leg.name, name)) else {
            continue;
        };
        is_commanded = true;
        let Some((group, position)) = layouts.find(&of_leg(&leg.name, position)) else {
            let why = format!("nothing observes leg/*/{position}");
            omit(
                left_out,
                &format!("tracking error of the {name} drives"),
                &why,
            );
            continue;
        };
        let signal = of_leg(&leg.name, torque);
        let found = layouts.find(&signal).filter(|(other, _)| *other == group);
        let limits = gait.limits.map(|limits| limits[index]);
        if found.is_none() && limits.is_some() {
            let why = format!("nothing observes leg/*/{torque}");
            omit(left_out, "saturation of the drives", &why);
        }
        drives.push(DriveTracking {
            name,
            command: commanded.start,
            group,
            position: position.start,
            torque: found.map(|(_, range)| range.start),
            limits,
            commanded: None,
            last: None,
            ramp: DriveStatistics::default(),
            full: DriveStatistics::default(),
        });
    }
    let clearance = layouts.find(&of_leg(&leg.name, FOOT_CLEARANCE));
    if clearance.is_none() && step_height.is_some() && is_commanded {
        let why = format!("nothing observes leg/*/{FOOT_CLEARANCE}");
        omit(left_out, LIFT, &why);
    }
    is_commanded.then(|| LegTracking {
        index: leg_index,
        name: leg.name.clone(),
        drives,
        step_height,
        clearance: clearance.map(|(group, range)| (group, range.start)),
        lifts: Lifts::NONE,
    })
}
