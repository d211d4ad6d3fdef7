//! Footstep-aligned comparison of synthetic runs whose differences are known in closed form.

use proptest::prelude::*;
use twinrig_kernel::{Direction, Layout, Port, SimTime, Unit};
use twinrig_record::{
    Cadence, EventComparison, Fingerprint, FootstepMessage, RecordedGroup, Recorder, Recording,
    RunInfo, Skeleton, compare_events,
};
use twinrig_runtime::Group;

/// Time between samples \[s\].
const PERIOD: f64 = 2e-3;

#[derive(Clone, Debug)]
struct Footstep {
    leg: &'static str,
    touch_down_s: f64,
    lift_off_s: f64,
    position_m: [f64; 3],
}

impl Footstep {
    fn message(&self) -> FootstepMessage {
        FootstepMessage {
            leg: self.leg.to_owned(),
            touch_down_s: self.touch_down_s,
            lift_off_s: self.lift_off_s,
            position_m: Some(self.position_m),
            slip_m: 0.0,
            impulse_ns: 1.0,
            peak_load_n: 10.0,
        }
    }

    fn shifted(&self, by: f64) -> Self {
        Self {
            touch_down_s: self.touch_down_s + by,
            lift_off_s: self.lift_off_s + by,
            ..self.clone()
        }
    }
}

/// A run over `span` \[s\] with one signal of a leg and one of the body, both functions of time.
fn run(span: [f64; 2], footsteps: &[Footstep], signals: impl Fn(f64) -> [f64; 2]) -> Recording {
    sampled(PERIOD, span, footsteps, signals)
}

/// A run with footsteps and constant signals.
fn steps_only(end: f64, footsteps: &[Footstep]) -> Recording {
    sampled(0.1, [0.0, end], footsteps, |_| [0.0; 2])
}

fn sampled(
    period: f64,
    [begin, end]: [f64; 2],
    footsteps: &[Footstep],
    signals: impl Fn(f64) -> [f64; 2],
) -> Recording {
    let ports = [
        Port::output("leg/LF/swing", Unit::Radian, 1),
        Port::output("body/bob", Unit::Meter, 1),
    ];
    let layout = Layout::of(&ports, Direction::Output);
    let group = RecordedGroup {
        group: Group::Plant,
        layout: &layout,
        keep: &|_| true,
    };
    let info = RunInfo::default();
    let mut recorder = Recorder::new(
        Vec::new(),
        &info,
        &[group],
        &Skeleton::default(),
        Cadence::default(),
    )
    .unwrap();
    let at = |seconds: f64| {
        SimTime::ZERO + twinrig_kernel::SimDuration::try_from_secs_f64(seconds).unwrap()
    };
    let mut n = 0.0;
    while begin + n * period <= end {
        let now = begin + n * period;
        recorder.sample(at(now), Group::Plant, &signals(now));
        n += 1.0;
    }
    for footstep in footsteps {
        recorder.message(at(end), &footstep.message());
    }
    let file = recorder
        .finish(Fingerprint::new().digest(), at(end))
        .unwrap();
    Recording::from_bytes(file).unwrap()
}

fn compare(a: &Recording, b: &Recording) -> EventComparison {
    compare_events(a, b, [a, b].map(|run| run.reached().unwrap())).unwrap()
}

/// Footsteps of a leg with the given stride durations and duty factors.
fn footsteps_of(leg: &'static str, begin: f64, strides: &[(f64, f64)]) -> Vec<Footstep> {
    let mut at = begin;
    let step = |(n, &(stride, share)): (usize, &(f64, f64))| {
        let footstep = Footstep {
            leg,
            touch_down_s: at,
            lift_off_s: at + share * stride,
            position_m: [0.1 * n as f64, 0.05, 0.0],
        };
        at += stride;
        footstep
    };
    strides.iter().enumerate().map(step).collect()
}

/// Strides of 0.25 to 0.35 s.
fn strides() -> impl Strategy<Value = Vec<(f64, f64)>> {
    prop::collection::vec((0.25..0.35_f64, 0.3..0.7_f64), 4..20)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Shifts of up to two thirds of a stride; beyond that a footstep is closer to its neighbour.
    #[test]
    fn common_shift_of_all_footsteps_is_recovered(
        fore in strides(), hind in strides(), shift in -0.2..0.2_f64,
    ) {
        let mut footsteps = footsteps_of("LF", 0.5, &fore);
        footsteps.extend(footsteps_of("RH", 0.62, &hind));
        let shifted: Vec<_> = footsteps.iter().map(|step| step.shifted(shift)).collect();
        let comparison = compare(&steps_only(9.0, &footsteps), &steps_only(9.0, &shifted));
        prop_assert_eq!(comparison.legs.len(), 2);
        for (leg, strides) in comparison.legs.iter().zip([&fore, &hind]) {
            let in_order: Vec<_> = (0..strides.len()).map(|n| (n, n)).collect();
            prop_assert_eq!(&leg.pairing.pairs, &in_order);
            for &(i, j) in &leg.pairing.pairs {
                let offset = leg.b[j].touch_down_s - leg.a[i].touch_down_s;
                // Tolerance for adding and subtracting times of a few seconds.
                prop_assert!((offset - shift).abs() < 1e-14, "{offset} and not {shift}");
            }
            prop_assert_eq!(leg.pairing.only_in_a.len() + leg.pairing.only_in_b.len() + leg.pairing.beyond_a + leg.pairing.beyond_b, 0);
        }
    }

    /// Exactly the removed footsteps are reported as missing, although all others are slightly
    /// early or late.
    #[test]
    fn removed_footsteps_are_reported_as_missing(
        strides in prop::collection::vec((0.28..0.32_f64, 0.4..0.6_f64), 6..24),
        out in prop::collection::vec(any::<bool>(), 24),
        late in prop::collection::vec(-0.02..0.02_f64, 24),
    ) {
        let all = footsteps_of("LF", 0.5, &strides);
        // Two successive missing footsteps cannot be distinguished from a pause.
        let removed: Vec<usize> = (0..all.len()).filter(|&n| n % 3 == 1 && out[n]).collect();
        let kept = all.iter().enumerate().filter(|(n, _)| !removed.contains(n));
        let kept: Vec<_> = kept.map(|(n, step)| step.shifted(late[n])).collect();
        let [complete, reduced] = [&all, &kept].map(|steps| steps_only(9.5, steps));
        let forth = compare(&complete, &reduced);
        prop_assert_eq!(&forth.legs[0].pairing.only_in_a, &removed);
        prop_assert!(forth.legs[0].pairing.only_in_b.is_empty());
        let back = compare(&reduced, &complete);
        prop_assert_eq!(&back.legs[0].pairing.only_in_b, &removed);
        prop_assert!(back.legs[0].pairing.only_in_a.is_empty());
    }

    /// A run slower by some per cent falls behind by several strides, and the pairing is
    /// unaffected.
    #[test]
    fn pairing_follows_a_slower_run(strides in strides(), slower in 1.0..1.1_f64) {
        let many: Vec<_> = strides.iter().cycle().take(60).copied().collect();
        let slow: Vec<_> = many.iter().map(|(stride, share)| (stride * slower, *share)).collect();
        let [a, b] = [many, slow].map(|strides| steps_only(25.0, &footsteps_of("LF", 0.5, &strides)));
        let comparison = compare(&a, &b);
        prop_assert_eq!(&comparison.legs[0].pairing.pairs, &(0..60).map(|n| (n, n)).collect::<Vec<_>>());
    }
}

/// A sinusoid delayed by `late` \[s\], with strides of its period.
fn oscillating(period: f64, late: f64) -> Recording {
    let strides = vec![(period, 0.5); 30];
    let footsteps = footsteps_of("LF", 0.2 + late, &strides);
    let omega = 2.0 * std::f64::consts::PI / period;
    run([0.0, 9.0], &footsteps, |t| {
        [
            libm::sin(omega * (t - late)),
            2.0 * libm::sin(omega * (t - late)),
        ]
    })
}

#[test]
fn delayed_signal_differs_at_equal_times_but_not_after_alignment() {
    let (period, late) = (0.3, 0.0123);
    let comparison = compare(&oscillating(period, 0.0), &oscillating(period, late));
    let omega = 2.0 * std::f64::consts::PI / period;
    for (drift, amplitude) in comparison.signals.iter().zip([1.0, 2.0]) {
        assert_eq!(drift.by_leg.as_deref(), Some("LF"));
        // sin ωt − sin ω(t − τ) = 2 sin(ωτ/2) cos(ωt − ωτ/2)
        let expected_max = 2.0 * amplitude * libm::sin(0.5 * omega * late);
        let plain = &drift.plain;
        // The nearest sample is at most half a sampling period off the maximum.
        assert!(
            (expected_max - plain.max).abs()
                < expected_max * (0.5 * omega * PERIOD) * (0.5 * omega * PERIOD)
        );
        // Nine seconds are thirty periods plus one sample.
        assert!((plain.rms - expected_max / libm::sqrt(2.0)).abs() < 1e-3 * expected_max);
        assert!((plain.share.unwrap() - plain.max / (2.0 * amplitude)).abs() < 1e-3);
        // The remaining difference is that of linear interpolation between samples: (ωh)²/8 of
        // the amplitude.
        let interpolation_error = omega * omega * PERIOD * PERIOD / 8.0 * amplitude;
        // Before the first footstep, in the first of the ten segments, the time map of the second
        // run is stretched.
        for rms in &drift.aligned.rms_of_parts[1..] {
            assert!(
                *rms > 0.0 && *rms < interpolation_error,
                "{rms} over {interpolation_error}"
            );
        }
    }
}

#[test]
fn linear_drift_has_its_slope_as_growth() {
    let slope = 0.02;
    let a = run([0.0, 10.0], &[], |t| [libm::sin(t), 1.0]);
    let b = run([0.0, 10.0], &[], |t| [libm::sin(t) + slope * t, 1.0]);
    let comparison = compare(&a, &b);
    let drift = &comparison.signals[0];
    assert_eq!(drift.by_leg, None, "there are no footsteps");
    assert_eq!(drift.aligned, drift.plain);
    assert!((drift.plain.max - 0.2).abs() < 1e-12 && (drift.plain.max_at_s - 10.0).abs() < 1e-9);
    // The mean square of a straight line through zero is a third of its last value squared.
    assert!((drift.plain.rms - 0.2 / libm::sqrt(3.0)).abs() < 1e-4);
    // The mean square of a segment is that of its midpoint plus a twelfth of its length squared:
    // the first is off by 15 %, which reduces the slope by 2 %.
    assert!((drift.plain.growth_per_s - slope).abs() < 0.03 * slope);
    // The range of the sine is 2; the thresholds are exceeded at the first sample after 1 s, and
    // after 10 s, the last sample.
    let [first, second] = drift.plain.exceeds_at_s;
    assert!((first.unwrap() - 1.0).abs() < 1.5 * PERIOD, "{first:?}");
    assert!(second.is_none() || (second.unwrap() - 10.0).abs() < 1.5 * PERIOD);
    // The other signal is constant and equal in both runs.
    let constant = &comparison.signals[1].plain;
    assert_eq!(
        (constant.max, constant.share, constant.exceeds_at_s),
        (0.0, Some(0.0), [None; 2])
    );
}

#[test]
fn constant_signal_is_normalised_by_its_magnitude() {
    let [a, b] = [[1.0, 0.0], [2.0, 1e-12]].map(|values| run([0.0, 1.0], &[], |_| values));
    let comparison = compare(&a, &b);
    let [size, nothing] = [0, 1].map(|i| &comparison.signals[i].plain);
    assert_eq!((size.max, size.share), (1.0, Some(1.0)));
    assert_eq!(size.exceeds_at_s, [Some(0.0); 2]);
    assert_eq!((nothing.share, nothing.exceeds_at_s), (None, [None; 2]));
}

#[test]
fn comparison_starts_with_the_later_recording() {
    let strides = vec![(0.3, 0.5); 20];
    let footsteps = footsteps_of("LF", 0.2, &strides);
    let a = run([0.0, 7.0], &footsteps, |t| [t, t]);
    // The foot is on the ground at the start of the recording, which therefore shows a touch-down
    // then.
    let mut later: Vec<_> = footsteps
        .iter()
        .filter(|step| step.lift_off_s > 3.0)
        .cloned()
        .collect();
    assert!(later[0].touch_down_s < 3.0);
    later[0].touch_down_s = 3.0;
    let b = run([3.0, 7.0], &later, |t| [t + 1e-3, t]);
    let comparison = compare(&a, &b);
    assert_eq!(comparison.window_s, [3.0, 7.0]);
    let leg = &comparison.legs[0];
    assert_eq!(
        (leg.a.len(), leg.b.len(), leg.pairing.pairs.len()),
        (10, 10, 10)
    );
    assert!(leg.pairing.pairs.iter().all(|&(i, j)| leg.a[i] == leg.b[j]));
    let drift = &comparison.signals[0].plain;
    let ends = comparison.signals[0].ends.unwrap();
    for (at, [a, b]) in [(3.0, [ends.a[0], ends.b[0]]), (7.0, [ends.a[1], ends.b[1]])] {
        // Samples need not coincide with the ends of the window.
        assert!((a - at).abs() < 1.5 * PERIOD && (b - a - 1e-3).abs() < 1e-14);
    }
    assert_eq!(ends.at_s, ends.a, "the signal is the time");
    // Tolerance for the difference of two numbers below 8.
    assert!((drift.max - 1e-3).abs() < 1e-14 && (drift.rms - 1e-3).abs() < 1e-14);
}

#[test]
fn nan_in_one_run_is_an_infinite_difference() {
    let a = run([0.0, 1.0], &[], |t| [t, t]);
    let b = run([0.0, 1.0], &[], |t| [if t > 0.5 { f64::NAN } else { t }, t]);
    let comparison = compare(&a, &b);
    let plain = &comparison.signals[0].plain;
    assert_eq!(plain.max, f64::INFINITY);
    assert!((plain.exceeds_at_s[0].unwrap() - 0.5).abs() < 1.5 * PERIOD);
    assert_eq!(comparison.signals[1].plain.max, 0.0);
}
