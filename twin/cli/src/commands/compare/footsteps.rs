//! Differences between the footsteps of two runs.

use serde::Serialize;
use twinrig_record::{LegFootsteps, RecordedFootstep, median};

use super::Bounds;

/// Median difference of touch-downs, in strides, above which pairs are suspect: the footsteps may
/// belong to different strides.
const SUSPECT: f64 = 0.35;

/// Footstep that differs.
#[derive(Clone, Serialize)]
pub(super) struct First {
    pub(super) leg: String,
    /// `moved`, `only in a`, `only in b`.
    pub(super) what: &'static str,
    /// Number of the footstep of the leg, counted from 1.
    pub(super) footstep_a: Option<usize>,
    pub(super) footstep_b: Option<usize>,
    /// Time of the first difference.
    pub(super) at_s: f64,
    pub(super) touch_down_a_s: Option<f64>,
    pub(super) touch_down_b_s: Option<f64>,
    /// Difference b − a.
    pub(super) touch_down_by_s: Option<f64>,
    pub(super) lift_off_by_s: Option<f64>,
    pub(super) place_by_m: Option<f64>,
}

/// Numbers of equal and unpaired footsteps, and differences of the pairs.
#[derive(Default, Serialize)]
pub(super) struct Footsteps {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) pairs: usize,
    pub(super) same: usize,
    pub(super) only_in_a: usize,
    pub(super) only_in_b: usize,
    /// Footsteps of one run after the end of the other.
    pub(super) beyond_b: usize,
    pub(super) beyond_a: usize,
    pub(super) touch_down: Spread,
    pub(super) lift_off: Spread,
    pub(super) place: Spread,
    /// The median difference of the touch-downs of a leg is so large that pairs may belong to
    /// different strides.
    pub(super) suspect: bool,
}

/// Statistics of the differences b − a of pairs, in seconds or metres.
#[derive(Default, Serialize)]
pub(super) struct Spread {
    pub(super) median: Option<f64>,
    pub(super) rms: Option<f64>,
    /// Difference of the greatest magnitude, with its sign.
    pub(super) max: Option<f64>,
}

#[derive(Serialize)]
pub(super) struct OfLeg {
    pub(super) leg: String,
    #[serde(flatten)]
    pub(super) footsteps: Footsteps,
    /// Footsteps without a partner.
    pub(super) missing: Vec<First>,
}

/// Returns the pairs of footsteps with their differences: touch-down and lift-off \[s\], position
/// \[m\].
fn pairs(leg: &LegFootsteps) -> impl Iterator<Item = ((usize, usize), [Option<f64>; 3])> {
    leg.pairing.pairs.iter().map(|&(i, j)| {
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

/// Returns which of touch-down, lift-off and position exceed the bounds.
fn beyond(by: [Option<f64>; 3], bounds: Bounds) -> [bool; 3] {
    let most = [bounds.time_s, bounds.time_s, bounds.place_m];
    std::array::from_fn(|k| by[k].is_some_and(|by| by.abs() > most[k]))
}

/// Returns the differing footsteps of a leg.
pub(super) fn differing(leg: &LegFootsteps, bounds: Bounds) -> impl Iterator<Item = First> {
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

/// Returns the footsteps of a leg without a partner.
pub(super) fn missing(leg: &LegFootsteps) -> impl Iterator<Item = First> {
    let unpaired = |what, number: usize, step: &RecordedFootstep| {
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
    let only_in_a = leg.pairing.only_in_a.iter();
    let only_in_b = leg.pairing.only_in_b.iter();
    let only_in_a = only_in_a.map(move |&i| unpaired("only in a", i + 1, &leg.a[i]));
    only_in_a.chain(only_in_b.map(move |&j| unpaired("only in b", j + 1, &leg.b[j])))
}

impl First {
    /// Sets number and time of a footstep without a partner.
    fn numbered(mut self, number: usize, step: &RecordedFootstep) -> Self {
        if self.what == "only in a" {
            (self.footstep_a, self.touch_down_a_s) = (Some(number), Some(step.touch_down_s));
        } else {
            (self.footstep_b, self.touch_down_b_s) = (Some(number), Some(step.touch_down_s));
        }
        self
    }
}

impl Footsteps {
    /// Evaluates the footsteps of legs with the common stride period `stride_s` \[s\].
    pub(super) fn of(legs: &[&LegFootsteps], stride_s: Option<f64>, bounds: Bounds) -> Self {
        let count = |of: fn(&LegFootsteps) -> usize| legs.iter().map(|leg| of(leg)).sum();
        let by: Vec<[Option<f64>; 3]> = legs
            .iter()
            .flat_map(|leg| pairs(leg).map(|(_, by)| by))
            .collect();
        let same = by.iter().filter(|by| beyond(**by, bounds) == [false; 3]);
        let [touch_down, lift_off, place] =
            [0, 1, 2].map(|k| Spread::of(&by.iter().filter_map(|by| by[k]).collect::<Vec<_>>()));
        let suspect = |leg: &LegFootsteps| {
            let touch_downs: Vec<f64> = pairs(leg).filter_map(|(_, by)| by[0]).collect();
            let median = median(&touch_downs).zip(stride_s);
            median.is_some_and(|(median, stride)| median.abs() > SUSPECT * stride)
        };
        Self {
            a: count(|leg| leg.a.len()),
            b: count(|leg| leg.b.len()),
            pairs: by.len(),
            same: same.count(),
            only_in_a: count(|leg| leg.pairing.only_in_a.len()),
            only_in_b: count(|leg| leg.pairing.only_in_b.len()),
            beyond_b: count(|leg| leg.pairing.beyond_b),
            beyond_a: count(|leg| leg.pairing.beyond_a),
            touch_down,
            lift_off,
            place,
            suspect: legs.iter().any(|leg| suspect(leg)),
        }
    }
}

impl Spread {
    pub(super) fn of(values: &[f64]) -> Self {
        let square: f64 = values.iter().map(|value| value * value).sum();
        let most = values.iter().copied();
        Self {
            median: median(values),
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
    pub(super) fn of(leg: &LegFootsteps, stride_s: Option<f64>, bounds: Bounds) -> Self {
        Self {
            leg: leg.leg.clone(),
            footsteps: Footsteps::of(&[leg], stride_s, bounds),
            missing: missing(leg).collect(),
        }
    }
}
