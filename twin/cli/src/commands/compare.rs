//! Two recordings compared footstep by footstep: what is printed of it.

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
#[expect(
    clippy::struct_excessive_bools,
    reason = "scripts read each of them by its name"
)]
pub(super) struct EventDifference {
    /// Nothing differs by more than the bounds.
    pub(super) same: bool,
    /// Nothing differs at all.
    bit_for_bit: bool,
    bounds: Bounds,
    /// What both recordings cover.
    window_s: [f64; 2],
    /// Whether there was nothing to compare.
    pub(super) nothing: bool,
    /// Where a run ended; whether one ended by itself before the other.
    ended_a_s: f64,
    ended_b_s: f64,
    ended_early: bool,
    cut_off_a_s: Option<f64>,
    cut_off_b_s: Option<f64>,
    /// The first footstep that differs.
    first: Option<First>,
    /// The stride of the legs; none where no leg comes down twice.
    stride_s: Option<f64>,
    footsteps: Footsteps,
    legs: Vec<OfLeg>,
    /// The signal that is first off by more than its share, where signals count.
    first_signal: Option<FirstSignal>,
    /// Those that differ most come first.
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
        let whole = cut == [None; 2] && ends[0] == ends[1];
        difference.bit_for_bit = whole && difference.same && Difference::of(a, b).identical;
        Ok(difference)
    }

    fn within(
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
        // Most telling first; of two that are alike the one that is first in the recording.
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
    use twinrig_record::{Pairing, RecordedFootstep};

    use super::*;
    use crate::report::paint::Paint;

    /// A leg of twenty strides of 0.3 s, of which the second run comes down so much later.
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
    fn a_leg_whose_median_is_above_a_third_of_a_stride_is_suspect() {
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
        let text = difference.text(Paint::PLAIN);
        assert!(
            text.contains("suspect: the median touch-down is off by RF -0.933 strides of 300 ms"),
            "{text}"
        );
    }
}
