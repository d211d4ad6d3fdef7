//! Two runs that are not meant to be the same bit for bit, compared footstep by footstep: two plants, two builds, before and
//! after a change.
//!
//! Footsteps are paired ([`pair_footsteps`], [`EventComparison::legs`]); between pairs, the second run is stretched onto the
//! first, and what signals differ by then is not that the same thing happens a little later. A signal of a leg goes by the
//! touch-downs and lift-offs of that leg, every other one by the touch-downs of the leg that has most pairs.

mod drift;
mod footstep;
mod lag;
mod median;
mod pairing;
mod warp;

pub use drift::{Drift, Ends, PARTS, SHARES};
pub use footstep::RecordedFootstep;
pub use median::median;
pub use pairing::{Pairing, Pairings, pair_footsteps};

use drift::{Samples, drift, ends};
use footstep::footsteps;
use twinrig_kernel::SimTime;
use warp::Warp;

use crate::{RecordError, Recording, SampledGroup};

/// What two runs have in common and what not, by their footsteps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventComparison {
    /// From when to when both runs are recorded \[s\]; nothing outside is compared.
    pub window_s: [f64; 2],
    /// The stride of the legs \[s\]; none where no leg comes down twice.
    pub stride_s: Option<f64>,
    /// The legs that have footsteps in either.
    pub legs: Vec<LegFootsteps>,
    /// Every number that both have sampled.
    pub signals: Vec<SignalDrift>,
    /// Signals, as `group: name`, that only the first recording has, or that differ in size or unit.
    pub only_in_a: Vec<String>,
    /// The same of the second.
    pub only_in_b: Vec<String>,
}

/// The footsteps of a leg in both runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LegFootsteps {
    /// The leg.
    pub leg: String,
    /// Its footsteps, in order of time. Those under way when the later recording began are left out.
    pub a: Vec<RecordedFootstep>,
    /// The same of the second run.
    pub b: Vec<RecordedFootstep>,
    /// Which are the same, as indices into both.
    pub pairing: Pairing,
}

/// How far apart two runs are in one number.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalDrift {
    /// The group of the signal.
    pub group: String,
    /// The signal.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Which component of it, counted from 0.
    pub component: usize,
    /// How many it has.
    pub components: usize,
    /// The leg by whose footsteps it is aligned; none if there are no pairs.
    pub by_leg: Option<String>,
    /// The differences of what happens at the same footstep, and as far from the next.
    pub aligned: Drift,
    /// The differences of what happens at the same time.
    pub plain: Drift,
    /// What it is in both when they begin and when they end; none if they share no time.
    pub ends: Option<Ends>,
}

/// Compares two recordings by their footsteps. `ends` is when either run ended: no footstep is missed behind it.
///
/// # Errors
/// [`RecordError::Decode`] if the footsteps of a recording do not read.
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
            None => comparison.only_in_a.extend(named(group, |_| true)),
        }
    }
    for group in b.groups() {
        if a.group(&group.name).is_none() {
            comparison.only_in_b.extend(named(group, |_| true));
        }
    }
    Ok(comparison)
}

/// The stride, and the legs' footsteps in pairs.
fn legs(
    a: Vec<(String, Vec<RecordedFootstep>)>,
    mut b: Vec<(String, Vec<RecordedFootstep>)>,
    begins: [f64; 2],
    ends: [f64; 2],
) -> (Option<f64>, Vec<LegFootsteps>) {
    // The touch-down of a footstep that was under way when a recording began is not known.
    let whole = |footsteps: Vec<RecordedFootstep>| {
        let from = begins[0].max(begins[1]);
        let known = |step: &RecordedFootstep| begins[0] == begins[1] || step.touch_down_s > from;
        footsteps.into_iter().filter(known).collect::<Vec<_>>()
    };
    let mut both = Vec::new();
    for (leg, of_a) in a {
        let twin = b.iter().position(|(other, _)| *other == leg);
        let of_b = twin.map_or_else(Vec::new, |twin| b.remove(twin).1);
        both.push((leg, whole(of_a), whole(of_b)));
    }
    both.extend(
        b.into_iter()
            .map(|(leg, of_b)| (leg, Vec::new(), whole(of_b))),
    );
    let footsteps: Vec<_> = both.iter().map(|(_, a, b)| [&a[..], &b[..]]).collect();
    let pairings = pair_footsteps(&footsteps, ends);
    let legs = both.into_iter().zip(pairings.legs);
    let legs = legs.map(|((leg, a, b), pairing)| LegFootsteps { leg, a, b, pairing });
    (pairings.stride_s, legs.collect())
}

/// How time is stretched: for each leg, and for what belongs to none.
struct Warps {
    legs: Vec<(String, Warp)>,
    /// The leg whose touch-downs all else goes by.
    body: Option<(String, Warp)>,
}

impl Warps {
    /// Both runs begin together at `from`.
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
        // Of several the first, since only more is better.
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

    /// How the time of a signal is stretched, and by which leg.
    fn for_signal(&self, signal: &str) -> Option<&(String, Warp)> {
        let own = signal.strip_prefix("leg/").and_then(|rest| {
            let (leg, _) = rest.split_once('/')?;
            self.legs.iter().find(|(name, _)| name == leg)
        });
        own.or(self.body.as_ref())
    }
}

fn named(group: &SampledGroup, wanted: impl Fn(&crate::Signal) -> bool) -> Vec<String> {
    let signals = group.signals.iter().filter(|signal| wanted(signal));
    let named = signals.map(|signal| format!("{}: {}", group.name, signal.name));
    named.collect()
}

/// A signal that is the same kind of thing in a group.
fn twin<'g>(
    group: &'g SampledGroup,
    signal: &crate::Signal,
) -> Option<(&'g crate::Signal, core::ops::Range<usize>)> {
    let found = group.find(&signal.name);
    found.filter(|(twin, _)| twin.size == signal.size && twin.unit == signal.unit)
}

fn compare_group(
    (a, in_a): (&Recording, &SampledGroup),
    (b, in_b): (&Recording, &SampledGroup),
    warps: &Warps,
    into: &mut EventComparison,
) {
    into.only_in_a
        .extend(named(in_a, |signal| twin(in_b, signal).is_none()));
    into.only_in_b
        .extend(named(in_b, |signal| twin(in_a, signal).is_none()));
    let (times_a, times_b) = (times(a, in_a), times(b, in_b));
    let mut start = 0;
    for signal in &in_a.signals {
        let own = start..start + signal.size;
        start = own.end;
        let Some((_, theirs)) = twin(in_b, signal) else {
            continue;
        };
        let warp = warps.for_signal(&signal.name);
        for (component, (place_a, place_b)) in own.zip(theirs).enumerate() {
            let (values_a, values_b) = (values(a, in_a, place_a), values(b, in_b, place_b));
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

fn values(recording: &Recording, group: &SampledGroup, place: usize) -> Vec<f64> {
    let samples = recording.samples(group);
    let values = samples.map(|sample| sample.values(place..place + 1).next());
    values.map(|value| value.unwrap_or(f64::NAN)).collect()
}
