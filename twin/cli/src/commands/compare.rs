//! Comparison of two recordings footstep by footstep, and its output.

mod footsteps;
mod signals;
mod text;

use footsteps::{First, Footsteps, OfLeg, differing};
use serde::Serialize;
use signals::{FirstSignal, OfSignal, first_beyond};
use twinrig_kernel::SimTime;
use twinrig_record::{
    EventComparison, LegFootsteps, Recording, SHARES, SignalDrift, compare_events,
};

use super::diff::{Difference, cut_off};
use crate::error::TwinError;
use twinrig_report::number::percent;
use twinrig_rig::report::seconds;

/// Returns the footsteps of a leg that are beyond the bounds, in words; `a` is a baseline.
pub(super) fn differing_footsteps(
    leg: &LegFootsteps,
    bounds: Bounds,
) -> impl Iterator<Item = String> {
    differing(leg, bounds).map(|first| {
        let text = first.description();
        let text = text.replace(" only in a", " is missing");
        text.replace(" only in b", " is new")
    })
}

/// Default tolerance of signals as a share of their range, for recordings without footsteps.
const SHARE: f64 = SHARES[0];

/// Tolerances within which two runs are considered equal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Bounds {
    /// Tolerance of touch-down and lift-off times \[s\].
    pub(super) time_s: f64,
    /// Tolerance of footstep positions \[m\].
    pub(super) place_m: f64,
    /// Tolerance of signals as a share of their range; none: signals are judged only if there are
    /// no footsteps.
    pub(super) share: Option<f64>,
}

/// Defaults of `twin diff --events`.
impl Default for Bounds {
    fn default() -> Self {
        Self {
            time_s: 5e-3,
            place_m: 5e-3,
            share: None,
        }
    }
}

/// Differences between two runs, in their serialised form.
#[derive(Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each field is a JSON key")]
pub(super) struct EventDifference {
    /// All differences are within the bounds.
    pub(super) same: bool,
    /// The recordings are identical.
    bit_for_bit: bool,
    bounds: Bounds,
    /// Time interval covered by both recordings.
    window_s: [f64; 2],
    /// The recordings have no common sample.
    pub(super) nothing: bool,
    /// Ends of the runs.
    ended_a_s: f64,
    ended_b_s: f64,
    /// One run ended before the other without being interrupted.
    ended_early: bool,
    cut_off_a_s: Option<f64>,
    cut_off_b_s: Option<f64>,
    /// First differing footstep.
    first: Option<First>,
    /// Stride period of the legs; none if no leg touches down twice.
    stride_s: Option<f64>,
    footsteps: Footsteps,
    legs: Vec<OfLeg>,
    /// First signal that exceeds its tolerance, if signals are judged.
    first_signal: Option<FirstSignal>,
    /// Signals in the order of decreasing difference.
    signals: Vec<OfSignal>,
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
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
        let mut difference = Self::within(comparison, bounds, ends, cut);
        let is_complete = cut == [None; 2] && ends[0] == ends[1];
        difference.bit_for_bit = is_complete && difference.same && Difference::of(a, b).identical;
        Ok(difference)
    }

    /// Returns the first signal that is beyond its tolerance, in words, if signals are judged.
    pub(super) fn first_signal_beyond(&self) -> Option<String> {
        let first = self.first_signal.as_ref()?;
        let share = percent(first.share);
        Some(format!("{} differs by {share} of its range", first.name()))
    }

    pub(super) fn within(
        comparison: EventComparison,
        bounds: Bounds,
        ends: [SimTime; 2],
        cut: [Option<SimTime>; 2],
    ) -> Self {
        let EventComparison {
            window_s,
            stride_s,
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
        // By decreasing share; the sort is stable.
        signals.sort_by(|a, b| {
            let share = |drift: &SignalDrift| drift.aligned.share.unwrap_or(0.0);
            share(b).total_cmp(&share(a))
        });
        let all: Vec<&LegFootsteps> = legs.iter().collect();
        let in_seconds = |at: SimTime| seconds(at.as_nanos());
        Self {
            same: first.is_none() && first_signal.is_none() && !ended_early && !nothing,
            bit_for_bit: false,
            bounds: Bounds { share, ..bounds },
            window_s,
            nothing,
            ended_a_s: in_seconds(ends[0]),
            ended_b_s: in_seconds(ends[1]),
            ended_early,
            cut_off_a_s: cut[0].map(in_seconds),
            cut_off_b_s: cut[1].map(in_seconds),
            first,
            stride_s,
            footsteps: Footsteps::of(&all, stride_s, bounds),
            legs: legs
                .iter()
                .map(|leg| OfLeg::of(leg, stride_s, bounds))
                .collect(),
            first_signal,
            signals: signals.into_iter().map(OfSignal::of).collect(),
            only_in_a,
            only_in_b,
        }
    }
}

#[cfg(test)]
mod tests {
    use anstream::adapter::strip_str;
    use twinrig_record::{Pairing, RecordedFootstep};

    use super::*;

    /// Returns a leg with twenty strides of 0.3 s whose footsteps are later by `later_s` in the
    /// second run.
    fn leg(leg: &str, later_s: f64) -> LegFootsteps {
        let steps = |later: f64| {
            let begins = (0..20).map(|n| 0.3 * f64::from(n) + later);
            let steps = begins.map(|touch_down_s| RecordedFootstep {
                touch_down_s,
                lift_off_s: touch_down_s + 0.15,
                position_m: None,
            });
            steps.collect()
        };
        LegFootsteps {
            leg: leg.to_owned(),
            a: steps(0.0),
            b: steps(later_s),
            pairing: Pairing {
                pairs: (0..20).map(|n| (n, n)).collect(),
                ..Pairing::default()
            },
        }
    }

    #[test]
    fn leg_with_median_difference_above_a_third_of_a_stride_is_suspect() {
        let comparison = EventComparison {
            window_s: [0.0, 7.0],
            stride_s: Some(0.3),
            legs: vec![leg("LF", 0.1), leg("RF", -0.28)],
            ..EventComparison::default()
        };
        let end = SimTime::from_nanos(7_000_000_000);
        let difference =
            EventDifference::within(comparison, Bounds::default(), [end; 2], [None; 2]);
        let json = serde_json::to_value(&difference).unwrap();
        assert_eq!(json["stride_s"], 0.3);
        assert_eq!(json["footsteps"]["suspect"], true);
        assert_eq!(json["legs"][0]["suspect"], false);
        assert_eq!(json["legs"][1]["suspect"], true);
        let text = strip_str(&difference.text()).to_string();
        assert!(
            text.contains("suspect: the median touch-down differs by RF -0.933 strides of 300 ms"),
            "{text}"
        );
    }
}
