//! Footstep-aligned comparison of runs that are not expected to be bit-identical: two plants, two
//! builds, before and after a change.
//!
//! Footsteps are paired ([`pair_footsteps`], [`EventComparison::legs`]); the time of the second run
//! is warped onto the first so that paired events coincide, which removes mere delays from the
//! signal differences. A leg's signals are aligned by the touch-downs and lift-offs of that leg,
//! all others by the touch-downs of the leg with the most pairs.
//!
//! A gait is periodic, so the lag that all legs have in common is found first (`lag`); then the
//! footsteps of each leg are paired (`pairing`). `twin study precision` pairs by the same.

mod drift;
mod footstep;
mod lag;
mod median;
mod pairing;
mod warp;

pub use drift::{Drift, Ends, PARTS, PartingPoint, SHARES};
pub use footstep::RecordedFootstep;
pub use median::median;
pub use pairing::{Pairing, Pairings, pair_footsteps};

use drift::{Samples, drift, ends};
use footstep::footsteps;
use twinrig_kernel::{SimTime, signal};
use warp::Warp;

use crate::{RecordError, Recording, SampledGroup};

/// Footstep-aligned comparison of two runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventComparison {
    /// Common time window of both recordings \[s\]; nothing outside it is compared.
    pub window_s: [f64; 2],
    /// Stride of the legs \[s\]; `None` if no leg has two touch-downs.
    pub stride_s: Option<f64>,
    /// Legs with footsteps in either run.
    pub legs: Vec<LegFootsteps>,
    /// Components of the signals sampled in both runs.
    pub signals: Vec<SignalDrift>,
    /// Signals, as `group: name`, that only the first recording has, or that differ in size or
    /// unit.
    pub only_in_a: Vec<String>,
    /// The same for the second recording.
    pub only_in_b: Vec<String>,
}

/// Footsteps of a leg in both runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LegFootsteps {
    /// Name of the leg.
    pub leg: String,
    /// Footsteps of the first run, in order of time, without those already in progress at the start
    /// of the later recording.
    pub a: Vec<RecordedFootstep>,
    /// Footsteps of the second run.
    pub b: Vec<RecordedFootstep>,
    /// Pairing of the footsteps, as indices into both.
    pub pairing: Pairing,
}

/// Difference of two runs in one signal component.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalDrift {
    /// Group of the signal.
    pub group: String,
    /// Name of the signal.
    pub signal: String,
    /// Unit of the signal.
    pub unit: String,
    /// Index of the component, from 0.
    pub component: usize,
    /// Number of components of the signal.
    pub components: usize,
    /// Leg whose footsteps align the signal; `None` if there are no pairs.
    pub by_leg: Option<String>,
    /// Differences after alignment by footsteps.
    pub aligned: Drift,
    /// Differences at equal times.
    pub plain: Drift,
    /// Values in both runs at the first and last common sample; `None` if the runs share no time.
    pub ends: Option<Ends>,
}

/// Compares two recordings by their footsteps. `ends` are the end times of the runs; a footstep
/// beyond the end of the other run does not count as missing.
///
/// # Errors
/// [`RecordError::Decode`] if the footsteps of a recording cannot be decoded.
pub fn compare_events(
    a: &Recording,
    b: &Recording,
    ends: [SimTime; 2],
) -> Result<EventComparison, RecordError> {
    let ends_s = ends.map(SimTime::as_secs_f64);
    let begin = |recording: &Recording| {
        let groups = recording.groups().iter();
        let first = groups.filter_map(|group| recording.samples(group).next());
        let first = first.map(|sample| sample.time.as_secs_f64());
        first.reduce(f64::min).unwrap_or(0.0)
    };
    let begins = [begin(a), begin(b)];
    let window = [begins[0].max(begins[1]), ends_s[0].min(ends_s[1])];
    let (stride_s, legs) = legs(footsteps(a)?, footsteps(b)?, begins, ends_s);
    let warps = Warps::of(&legs, window[0]);
    let mut comparison = EventComparison {
        window_s: window,
        stride_s,
        legs,
        ..EventComparison::default()
    };
    for group in a.groups() {
        match b.group(&group.name) {
            Some(other) => compare_group((a, group), (b, other), &warps, &mut comparison),
            None => comparison
                .only_in_a
                .extend(qualified_names(group, |_| true)),
        }
    }
    for group in b.groups() {
        if a.group(&group.name).is_none() {
            comparison
                .only_in_b
                .extend(qualified_names(group, |_| true));
        }
    }
    Ok(comparison)
}

/// Pairs the footsteps of each leg; also returns the stride.
fn legs(
    a: Vec<(String, Vec<RecordedFootstep>)>,
    mut b: Vec<(String, Vec<RecordedFootstep>)>,
    begins: [f64; 2],
    ends: [f64; 2],
) -> (Option<f64>, Vec<LegFootsteps>) {
    // The touch-down time of a footstep in progress at the start of a recording is unknown.
    let fully_recorded = |footsteps: Vec<RecordedFootstep>| {
        let from = begins[0].max(begins[1]);
        let known = |step: &RecordedFootstep| begins[0] == begins[1] || step.touch_down_s > from;
        footsteps.into_iter().filter(known).collect::<Vec<_>>()
    };
    let mut both = Vec::new();
    for (leg, of_a) in a {
        let index = b.iter().position(|(other, _)| *other == leg);
        let of_b = index.map_or_else(Vec::new, |index| b.remove(index).1);
        both.push((leg, fully_recorded(of_a), fully_recorded(of_b)));
    }
    both.extend(
        b.into_iter()
            .map(|(leg, of_b)| (leg, Vec::new(), fully_recorded(of_b))),
    );
    let footsteps: Vec<_> = both.iter().map(|(_, a, b)| [&a[..], &b[..]]).collect();
    let pairings = pair_footsteps(&footsteps, ends);
    let legs = both.into_iter().zip(pairings.legs);
    let legs = legs.map(|((leg, a, b), pairing)| LegFootsteps { leg, a, b, pairing });
    (pairings.stride_s, legs.collect())
}

/// Time warps of the legs and of all other signals.
struct Warps {
    legs: Vec<(String, Warp)>,
    /// Leg whose touch-downs align the signals of no leg.
    body: Option<(String, Warp)>,
}

impl Warps {
    /// Creates the warps of runs that begin together at `from`.
    fn of(legs: &[LegFootsteps], from: f64) -> Self {
        let knots = |leg: &LegFootsteps, lift_offs: bool| {
            let pairs = leg.pairing.pairs.iter().map(|&(i, j)| (leg.a[i], leg.b[j]));
            let knots = pairs.flat_map(|(a, b)| {
                let touch_down = [a.touch_down_s, b.touch_down_s];
                let lift_off = [a.lift_off_s, b.lift_off_s];
                [Some(touch_down), lift_offs.then_some(lift_off)]
            });
            let knots: Vec<[f64; 2]> = knots.flatten().collect();
            Warp::through(std::iter::once([from; 2]).chain(knots))
        };
        let paired = legs.iter().filter(|leg| !leg.pairing.pairs.is_empty());
        // On a tie the first leg is used.
        let most = paired.clone().reduce(|most, leg| {
            if leg.pairing.pairs.len() > most.pairing.pairs.len() {
                leg
            } else {
                most
            }
        });
        Self {
            legs: paired
                .map(|leg| (leg.leg.clone(), knots(leg, true)))
                .collect(),
            body: most.map(|leg| (leg.leg.clone(), knots(leg, false))),
        }
    }

    /// Returns the time warp of a signal, with its leg.
    fn for_signal(&self, signal: &str) -> Option<&(String, Warp)> {
        let leg_warp = signal::parse_leg(signal)
            .and_then(|(leg, _)| self.legs.iter().find(|(name, _)| name == leg));
        leg_warp.or(self.body.as_ref())
    }
}

fn qualified_names(group: &SampledGroup, include: impl Fn(&crate::Signal) -> bool) -> Vec<String> {
    let signals = group.signals.iter().filter(|signal| include(signal));
    let qualified_names = signals.map(|signal| format!("{}: {}", group.name, signal.name));
    qualified_names.collect()
}

/// Returns the signal of `group` with the same name, size and unit.
fn matching_signal<'g>(
    group: &'g SampledGroup,
    signal: &crate::Signal,
) -> Option<(&'g crate::Signal, core::ops::Range<usize>)> {
    let found = group.find(&signal.name);
    found.filter(|(other, _)| other.size == signal.size && other.unit == signal.unit)
}

fn compare_group(
    (a, in_a): (&Recording, &SampledGroup),
    (b, in_b): (&Recording, &SampledGroup),
    warps: &Warps,
    into: &mut EventComparison,
) {
    into.only_in_a.extend(qualified_names(in_a, |signal| {
        matching_signal(in_b, signal).is_none()
    }));
    into.only_in_b.extend(qualified_names(in_b, |signal| {
        matching_signal(in_a, signal).is_none()
    }));
    let (times_a, times_b) = (times(a, in_a), times(b, in_b));
    let mut start = 0;
    for signal in &in_a.signals {
        let range_a = start..start + signal.size;
        start = range_a.end;
        let Some((_, range_b)) = matching_signal(in_b, signal) else {
            continue;
        };
        let warp = warps.for_signal(&signal.name);
        for (component, (index_a, index_b)) in range_a.zip(range_b).enumerate() {
            let (values_a, values_b) = (values(a, in_a, index_a), values(b, in_b, index_b));
            let of_a = Samples {
                times_s: &times_a,
                values: &values_a,
            };
            let of_b = Samples {
                times_s: &times_b,
                values: &values_b,
            };
            let plain = drift(of_a, of_b, &Warp::none(), into.window_s);
            let aligned = warp.map(|(_, warp)| drift(of_a, of_b, warp, into.window_s));
            into.signals.push(SignalDrift {
                group: in_a.name.clone(),
                signal: signal.name.clone(),
                unit: signal.unit.clone(),
                component,
                components: signal.size,
                by_leg: warp.map(|(leg, _)| leg.clone()),
                aligned: aligned.unwrap_or_else(|| plain.clone()),
                plain,
                ends: ends(of_a, of_b, into.window_s),
            });
        }
    }
}

fn times(recording: &Recording, group: &SampledGroup) -> Vec<f64> {
    let samples = recording.samples(group);
    samples.map(|sample| sample.time.as_secs_f64()).collect()
}

fn values(recording: &Recording, group: &SampledGroup, index: usize) -> Vec<f64> {
    let samples = recording.samples(group);
    let values = samples.map(|sample| sample.values(index..index + 1).next());
    values.map(|value| value.unwrap_or(f64::NAN)).collect()
}
