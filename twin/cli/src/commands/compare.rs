//! Two recordings compared footstep by footstep: what is printed of it.

mod text;

use serde::Serialize;
use twinrig_kernel::SimTime;
use twinrig_record::{
    Drift, EventComparison, LegFootsteps, RecordedFootstep, Recording, SHARES, SignalDrift,
    compare_events,
};

use super::diff::cut_off;
use crate::error::TwinError;
use crate::report::seconds;

/// The share of its range by which a signal may differ where footsteps do not tell and nobody says otherwise.
const SHARE: f64 = SHARES[0];

/// By how much two runs may differ and still be taken for the same.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Bounds {
    /// Between touch-downs and between lift-offs.
    pub(super) time_s: f64,
    /// Between the places of a footstep.
    pub(super) place_m: f64,
    /// Of the range of a signal; none: signals count only where there are no footsteps.
    pub(super) share: Option<f64>,
}

/// The default of `twin diff --events`.
impl Default for Bounds {
    fn default() -> Self {
        Self {
            time_s: 5e-3,
            place_m: 5e-3,
            share: None,
        }
    }
}

/// What two runs differ by, as it is printed.
#[derive(Serialize)]
pub(super) struct EventDifference {
    /// Nothing differs by more than the bounds.
    pub(super) same: bool,
    bounds: Bounds,
    /// What both recordings cover.
    window_s: [f64; 2],
    /// Whether there was anything to compare.
    nothing: bool,
    /// Where a run ended; whether one ended by itself before the other.
    ended_a_s: f64,
    ended_b_s: f64,
    ended_early: bool,
    cut_off_a_s: Option<f64>,
    cut_off_b_s: Option<f64>,
    /// The first footstep that differs.
    first: Option<First>,
    footsteps: Footsteps,
    legs: Vec<OfLeg>,
    /// The signal that is first off by more than its share, where signals count.
    first_signal: Option<FirstSignal>,
    /// Those that differ most come first.
    signals: Vec<OfSignal>,
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
}

/// A footstep that differs.
#[derive(Clone, Serialize)]
struct First {
    leg: String,
    /// `moved`, `only in a`, `only in b`.
    what: &'static str,
    /// Which footstep of the leg it is, counted from 1.
    footstep_a: Option<usize>,
    footstep_b: Option<usize>,
    /// From when on they differ.
    at_s: f64,
    touch_down_a_s: Option<f64>,
    touch_down_b_s: Option<f64>,
    /// Of b, less that of a.
    touch_down_by_s: Option<f64>,
    lift_off_by_s: Option<f64>,
    place_by_m: Option<f64>,
}

/// How many footsteps are the same, and how much the pairs are apart.
#[derive(Default, Serialize)]
struct Footsteps {
    a: usize,
    b: usize,
    pairs: usize,
    same: usize,
    only_in_a: usize,
    only_in_b: usize,
    /// At the end of one, where the other had ended.
    beyond_b: usize,
    beyond_a: usize,
    touch_down: Spread,
    lift_off: Spread,
    place: Spread,
}

/// What pairs differ by, b less a: in seconds or metres.
#[derive(Default, Serialize)]
struct Spread {
    median: Option<f64>,
    rms: Option<f64>,
    /// The greatest magnitude, with its sign.
    max: Option<f64>,
}

#[derive(Serialize)]
struct OfLeg {
    leg: String,
    #[serde(flatten)]
    footsteps: Footsteps,
    /// Which footsteps the other has not, counted from 1.
    missing: Vec<First>,
}

#[derive(Serialize)]
struct FirstSignal {
    signal: String,
    component: usize,
    share: f64,
    at_s: Option<f64>,
}

#[derive(Serialize)]
struct OfSignal {
    group: String,
    signal: String,
    component: usize,
    components: usize,
    unit: String,
    by_leg: Option<String>,
    aligned: Drifted,
    plain: Drifted,
}

#[derive(Serialize)]
struct Drifted {
    max: f64,
    max_at_s: f64,
    rms: f64,
    share: Option<f64>,
    exceeds_1_percent_at_s: Option<f64>,
    exceeds_10_percent_at_s: Option<f64>,
    rms_of_tenths: Vec<f64>,
    growth_per_s: f64,
}

impl EventDifference {
    pub(super) fn of(a: &Recording, b: &Recording, bounds: Bounds) -> Result<Self, TwinError> {
        let cut = [cut_off(a), cut_off(b)];
        let ends = [(a, cut[0]), (b, cut[1])].map(|(recording, cut)| {
            let end = cut.or(recording.reached());
            end.unwrap_or(SimTime::ZERO)
        });
        let comparison =
            compare_events(a, b, ends).map_err(|source| TwinError::Compare { source })?;
        Ok(Self::within(comparison, bounds, ends, cut))
    }

    fn within(
        comparison: EventComparison,
        bounds: Bounds,
        ends: [SimTime; 2],
        cut: [Option<SimTime>; 2],
    ) -> Self {
        let EventComparison {
            window_s,
            legs,
            mut signals,
            only_in_a,
            only_in_b,
        } = comparison;
        let ended_early =
            (ends[0] < ends[1] && cut[0].is_none()) || (ends[1] < ends[0] && cut[1].is_none());
        let differing = legs.iter().flat_map(|leg| differing(leg, bounds));
        let first =
            differing.reduce(|first, next| if next.at_s < first.at_s { next } else { first });
        let stepped = legs
            .iter()
            .any(|leg| !leg.a.is_empty() || !leg.b.is_empty());
        let share = bounds.share.or((!stepped).then_some(SHARE));
        let first_signal = share.and_then(|share| first_beyond(&signals, share));
        let nothing = window_s[1] <= window_s[0] || (!stepped && signals.is_empty());
        // Most telling first; of two that are alike the one that is first in the recording.
        signals.sort_by(|a, b| {
            let share = |drift: &SignalDrift| drift.aligned.share.unwrap_or(0.0);
            share(b).total_cmp(&share(a))
        });
        let all: Vec<&LegFootsteps> = legs.iter().collect();
        let in_seconds = |at: SimTime| seconds(at.as_nanos());
        Self {
            same: first.is_none() && first_signal.is_none() && !ended_early && !nothing,
            bounds: Bounds { share, ..bounds },
            window_s,
            nothing,
            ended_a_s: in_seconds(ends[0]),
            ended_b_s: in_seconds(ends[1]),
            ended_early,
            cut_off_a_s: cut[0].map(in_seconds),
            cut_off_b_s: cut[1].map(in_seconds),
            first,
            footsteps: Footsteps::of(&all, bounds),
            legs: legs.iter().map(|leg| OfLeg::of(leg, bounds)).collect(),
            first_signal,
            signals: signals.into_iter().map(OfSignal::of).collect(),
            only_in_a,
            only_in_b,
        }
    }
}

/// A pair of footsteps, and what they differ by: touch-down, lift-off \[s\], place \[m\].
fn pairs(leg: &LegFootsteps) -> impl Iterator<Item = ((usize, usize), [Option<f64>; 3])> {
    leg.pairs.iter().map(|&(i, j)| {
        let (a, b) = (&leg.a[i], &leg.b[j]);
        let place = a.position_m.zip(b.position_m).map(|(a, b)| {
            let square = a.iter().zip(&b).map(|(a, b)| (b - a) * (b - a));
            square.sum::<f64>().sqrt()
        });
        let by = [
            Some(b.touch_down_s - a.touch_down_s),
            Some(b.lift_off_s - a.lift_off_s),
            place,
        ];
        ((i, j), by)
    })
}

/// Which of touch-down, lift-off and place are beyond the bounds.
fn beyond(by: [Option<f64>; 3], bounds: Bounds) -> [bool; 3] {
    let most = [bounds.time_s, bounds.time_s, bounds.place_m];
    std::array::from_fn(|k| by[k].is_some_and(|by| by.abs() > most[k]))
}

/// The footsteps of a leg that differ.
fn differing(leg: &LegFootsteps, bounds: Bounds) -> impl Iterator<Item = First> {
    let moved = pairs(leg).filter_map(move |((i, j), by)| {
        let (a, b) = (&leg.a[i], &leg.b[j]);
        let [touch_down, lift_off, place] = beyond(by, bounds);
        let at_s = if touch_down || place {
            a.touch_down_s.min(b.touch_down_s)
        } else {
            a.lift_off_s.min(b.lift_off_s)
        };
        (touch_down || lift_off || place).then(|| First {
            leg: leg.leg.clone(),
            what: "moved",
            footstep_a: Some(i + 1),
            footstep_b: Some(j + 1),
            at_s,
            touch_down_a_s: Some(a.touch_down_s),
            touch_down_b_s: Some(b.touch_down_s),
            touch_down_by_s: by[0],
            lift_off_by_s: by[1],
            place_by_m: by[2],
        })
    });
    moved.chain(missing(leg))
}

/// The footsteps of a leg that have no partner.
fn missing(leg: &LegFootsteps) -> impl Iterator<Item = First> {
    let alone = |what, number: usize, step: &RecordedFootstep| {
        First {
            leg: leg.leg.clone(),
            what,
            footstep_a: None,
            footstep_b: None,
            at_s: step.touch_down_s,
            touch_down_a_s: None,
            touch_down_b_s: None,
            touch_down_by_s: None,
            lift_off_by_s: None,
            place_by_m: None,
        }
        .numbered(number, step)
    };
    let only_in_a = leg.only_in_a.iter();
    let only_in_b = leg.only_in_b.iter();
    let only_in_a = only_in_a.map(move |&i| alone("only in a", i + 1, &leg.a[i]));
    only_in_a.chain(only_in_b.map(move |&j| alone("only in b", j + 1, &leg.b[j])))
}

impl First {
    /// With the number and the time of a footstep that only one of them has.
    fn numbered(mut self, number: usize, step: &RecordedFootstep) -> Self {
        if self.what == "only in a" {
            (self.footstep_a, self.touch_down_a_s) = (Some(number), Some(step.touch_down_s));
        } else {
            (self.footstep_b, self.touch_down_b_s) = (Some(number), Some(step.touch_down_s));
        }
        self
    }
}

/// The signal that is first off by more than a share of its range.
fn first_beyond(signals: &[SignalDrift], share: f64) -> Option<FirstSignal> {
    let off = signals.iter();
    let off = off.filter(|drift| drift.aligned.share.is_some_and(|most| most > share));
    let found = off.map(|drift| {
        // The time is known for the shares that are looked for; of others, that of the greatest difference.
        let known = SHARES.iter().position(|known| *known == share);
        let at_s = known.and_then(|known| drift.aligned.exceeds_at_s[known]);
        FirstSignal {
            signal: drift.signal.clone(),
            component: drift.component,
            share: drift.aligned.share.unwrap_or(0.0),
            at_s: at_s.or(Some(drift.aligned.max_at_s)),
        }
    });
    found.reduce(|first, next| if next.at_s < first.at_s { next } else { first })
}

impl Footsteps {
    fn of(legs: &[&LegFootsteps], bounds: Bounds) -> Self {
        let count = |of: fn(&LegFootsteps) -> usize| legs.iter().map(|leg| of(leg)).sum();
        let by: Vec<[Option<f64>; 3]> = legs
            .iter()
            .flat_map(|leg| pairs(leg).map(|(_, by)| by))
            .collect();
        let same = by.iter().filter(|by| beyond(**by, bounds) == [false; 3]);
        let [touch_down, lift_off, place] =
            [0, 1, 2].map(|k| Spread::of(by.iter().filter_map(|by| by[k]).collect()));
        Self {
            a: count(|leg| leg.a.len()),
            b: count(|leg| leg.b.len()),
            pairs: by.len(),
            same: same.count(),
            only_in_a: count(|leg| leg.only_in_a.len()),
            only_in_b: count(|leg| leg.only_in_b.len()),
            beyond_b: count(|leg| leg.beyond_b),
            beyond_a: count(|leg| leg.beyond_a),
            touch_down,
            lift_off,
            place,
        }
    }
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let square: f64 = values.iter().map(|value| value * value).sum();
        let most = values.iter().copied();
        Self {
            median: values.get(values.len() / 2).copied(),
            rms: (!values.is_empty()).then(|| (square / values.len() as f64).sqrt()),
            max: most.reduce(|most, value| {
                if value.abs() > most.abs() {
                    value
                } else {
                    most
                }
            }),
        }
    }
}

impl OfLeg {
    fn of(leg: &LegFootsteps, bounds: Bounds) -> Self {
        Self {
            leg: leg.leg.clone(),
            footsteps: Footsteps::of(&[leg], bounds),
            missing: missing(leg).collect(),
        }
    }
}

impl OfSignal {
    fn of(drift: SignalDrift) -> Self {
        Self {
            group: drift.group,
            signal: drift.signal,
            component: drift.component,
            components: drift.components,
            unit: drift.unit,
            by_leg: drift.by_leg,
            aligned: drift.aligned.into(),
            plain: drift.plain.into(),
        }
    }

    /// As it is called: with its component, if it has several.
    fn name(&self) -> String {
        match self.components {
            1 => self.signal.clone(),
            _ => format!("{}[{}]", self.signal, self.component),
        }
    }
}

impl From<Drift> for Drifted {
    fn from(drift: Drift) -> Self {
        let [first, second] = drift.exceeds_at_s;
        Self {
            max: drift.max,
            max_at_s: drift.max_at_s,
            rms: drift.rms,
            share: drift.share,
            exceeds_1_percent_at_s: first,
            exceeds_10_percent_at_s: second,
            rms_of_tenths: drift.rms_of_parts.to_vec(),
            growth_per_s: drift.growth_per_s,
        }
    }
}
