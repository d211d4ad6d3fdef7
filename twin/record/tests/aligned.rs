//! Two runs compared footstep by footstep, on made-up runs whose differences are known in closed form.

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

/// A run from `begin` to `end` \[s\], with a signal of a leg and one of the body, which are functions of time.
fn run(span: [f64; 2], footsteps: &[Footstep], signals: impl Fn(f64) -> [f64; 2]) -> Recording {
    sampled(PERIOD, span, footsteps, signals)
}

/// A run of which the footsteps alone matter.
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

fn compared(a: &Recording, b: &Recording) -> EventComparison {
    compare_events(a, b, [a, b].map(|run| run.reached().unwrap())).unwrap()
}

/// Footsteps of a leg from the durations of its strides and how much of each it stands.
fn walked(leg: &'static str, begin: f64, strides: &[(f64, f64)]) -> Vec<Footstep> {
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

    /// A shift of up to two thirds of a stride; beyond that a footstep is nearer to being the one before or behind it.
    #[test]
    fn a_shift_of_all_footsteps_is_found_as_that_shift(
        fore in strides(), hind in strides(), shift in -0.2..0.2_f64,
    ) {
        let mut footsteps = walked("LF", 0.5, &fore);
        footsteps.extend(walked("RH", 0.62, &hind));
        let shifted: Vec<_> = footsteps.iter().map(|step| step.shifted(shift)).collect();
        let comparison = compared(&steps_only(9.0, &footsteps), &steps_only(9.0, &shifted));
        prop_assert_eq!(comparison.legs.len(), 2);
        for (leg, strides) in comparison.legs.iter().zip([&fore, &hind]) {
            let in_order: Vec<_> = (0..strides.len()).map(|n| (n, n)).collect();
            prop_assert_eq!(&leg.pairing.pairs, &in_order);
            for &(i, j) in &leg.pairing.pairs {
                let offset = leg.b[j].touch_down_s - leg.a[i].touch_down_s;
                // Times of a few seconds, added and taken away again.
                prop_assert!((offset - shift).abs() < 1e-14, "{offset} and not {shift}");
            }
            prop_assert_eq!(leg.pairing.only_in_a.len() + leg.pairing.only_in_b.len() + leg.pairing.beyond_a + leg.pairing.beyond_b, 0);
        }
    }

    /// Whichever footsteps are taken out, those and no others are found to be missing, though all the others come a little
    /// early or late.
    #[test]
    fn footsteps_that_are_taken_out_are_those_that_are_missed(
        strides in prop::collection::vec((0.28..0.32_f64, 0.4..0.6_f64), 6..24),
        out in prop::collection::vec(any::<bool>(), 24),
        late in prop::collection::vec(-0.02..0.02_f64, 24),
    ) {
        let all = walked("LF", 0.5, &strides);
        // Two in a row are not to be told from a pause.
        let gone: Vec<usize> = (0..all.len()).filter(|&n| n % 3 == 1 && out[n]).collect();
        let kept = all.iter().enumerate().filter(|(n, _)| !gone.contains(n));
        let kept: Vec<_> = kept.map(|(n, step)| step.shifted(late[n])).collect();
        let [whole, rest] = [&all, &kept].map(|steps| steps_only(9.5, steps));
        let forth = compared(&whole, &rest);
        prop_assert_eq!(&forth.legs[0].pairing.only_in_a, &gone);
        prop_assert!(forth.legs[0].pairing.only_in_b.is_empty());
        let back = compared(&rest, &whole);
        prop_assert_eq!(&back.legs[0].pairing.only_in_b, &gone);
        prop_assert!(back.legs[0].pairing.only_in_a.is_empty());
    }

    /// A run that is slower by some per cent falls behind by strides in the end, and every footstep is still the same one.
    #[test]
    fn a_run_that_falls_behind_by_strides_keeps_its_footsteps(strides in strides(), slower in 1.0..1.1_f64) {
        let many: Vec<_> = strides.iter().cycle().take(60).copied().collect();
        let slow: Vec<_> = many.iter().map(|(stride, share)| (stride * slower, *share)).collect();
        let [a, b] = [many, slow].map(|strides| steps_only(25.0, &walked("LF", 0.5, &strides)));
        let comparison = compared(&a, &b);
        prop_assert_eq!(&comparison.legs[0].pairing.pairs, &(0..60).map(|n| (n, n)).collect::<Vec<_>>());
    }
}

/// An oscillation that comes late by `late`, and strides of its period.
fn oscillating(period: f64, late: f64) -> Recording {
    let strides = vec![(period, 0.5); 30];
    let footsteps = walked("LF", 0.2 + late, &strides);
    let omega = 2.0 * std::f64::consts::PI / period;
    run([0.0, 9.0], &footsteps, |t| {
        [
            libm::sin(omega * (t - late)),
            2.0 * libm::sin(omega * (t - late)),
        ]
    })
}

#[test]
fn what_comes_late_differs_at_equal_times_and_not_at_equal_footsteps() {
    let (period, late) = (0.3, 0.0123);
    let comparison = compared(&oscillating(period, 0.0), &oscillating(period, late));
    let omega = 2.0 * std::f64::consts::PI / period;
    for (drift, amplitude) in comparison.signals.iter().zip([1.0, 2.0]) {
        assert_eq!(drift.by_leg.as_deref(), Some("LF"));
        // sin ωt − sin ω(t − τ) = 2 sin(ωτ/2) cos(ωt − ωτ/2)
        let most = 2.0 * amplitude * libm::sin(0.5 * omega * late);
        let plain = &drift.plain;
        // The nearest sample is at most half a period of sampling off the crest.
        assert!((most - plain.max).abs() < most * (0.5 * omega * PERIOD) * (0.5 * omega * PERIOD));
        // Nine seconds are thirty periods, and one sample more than that.
        assert!((plain.rms - most / libm::sqrt(2.0)).abs() < 1e-3 * most);
        assert!((plain.share.unwrap() - plain.max / (2.0 * amplitude)).abs() < 1e-3);
        // What is left is what straight lines between samples miss: (ωh)²/8 of the amplitude.
        let straight = omega * omega * PERIOD * PERIOD / 8.0 * amplitude;
        // Before the first footstep, in the first part of ten, the second run is stretched.
        for rms in &drift.aligned.rms_of_parts[1..] {
            assert!(*rms > 0.0 && *rms < straight, "{rms} over {straight}");
        }
    }
}

#[test]
fn a_difference_that_grows_evenly_is_told_by_how_much() {
    let slope = 0.02;
    let a = run([0.0, 10.0], &[], |t| [libm::sin(t), 1.0]);
    let b = run([0.0, 10.0], &[], |t| [libm::sin(t) + slope * t, 1.0]);
    let comparison = compared(&a, &b);
    let drift = &comparison.signals[0];
    assert_eq!(drift.by_leg, None, "there are no footsteps");
    assert_eq!(drift.aligned, drift.plain);
    assert!((drift.plain.max - 0.2).abs() < 1e-12 && (drift.plain.max_at_s - 10.0).abs() < 1e-9);
    // Of a straight line through nothing the mean square is a third of the last one.
    assert!((drift.plain.rms - 0.2 / libm::sqrt(3.0)).abs() < 1e-4);
    // A part's mean square is that of its middle and a twelfth of its length: the first is off by 15 %, which takes 2 % from
    // the slope.
    assert!((drift.plain.growth_per_s - slope).abs() < 0.03 * slope);
    // The range of the sine is 2; the first sample behind 1 s and 10 s, which is the last.
    let [first, second] = drift.plain.exceeds_at_s;
    assert!((first.unwrap() - 1.0).abs() < 1.5 * PERIOD, "{first:?}");
    assert!(second.is_none() || (second.unwrap() - 10.0).abs() < 1.5 * PERIOD);
    // The other signal stands still in both, and differs in neither.
    let still = &comparison.signals[1].plain;
    assert_eq!(
        (still.max, still.share, still.exceeds_at_s),
        (0.0, Some(0.0), [None; 2])
    );
}

#[test]
fn what_stands_still_is_measured_by_its_size_and_nothing_by_nothing() {
    let [a, b] = [[1.0, 0.0], [2.0, 1e-12]].map(|still| run([0.0, 1.0], &[], |_| still));
    let comparison = compared(&a, &b);
    let [size, nothing] = [0, 1].map(|i| &comparison.signals[i].plain);
    assert_eq!((size.max, size.share), (1.0, Some(1.0)));
    assert_eq!(size.exceeds_at_s, [Some(0.0); 2]);
    assert_eq!((nothing.share, nothing.exceeds_at_s), (None, [None; 2]));
}

#[test]
fn a_recording_that_begins_later_is_compared_from_there_on() {
    let strides = vec![(0.3, 0.5); 20];
    let footsteps = walked("LF", 0.2, &strides);
    let a = run([0.0, 7.0], &footsteps, |t| [t, t]);
    // The foot stands when it begins, and seems to come down then.
    let mut later: Vec<_> = footsteps
        .iter()
        .filter(|step| step.lift_off_s > 3.0)
        .cloned()
        .collect();
    assert!(later[0].touch_down_s < 3.0);
    later[0].touch_down_s = 3.0;
    let b = run([3.0, 7.0], &later, |t| [t + 1e-3, t]);
    let comparison = compared(&a, &b);
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
        // Samples need not fall on the ends of the window.
        assert!((a - at).abs() < 1.5 * PERIOD && (b - a - 1e-3).abs() < 1e-14);
    }
    assert_eq!(ends.at_s, ends.a, "the signal is the time");
    // One number less another, both below 8.
    assert!((drift.max - 1e-3).abs() < 1e-14 && (drift.rms - 1e-3).abs() < 1e-14);
}

#[test]
fn a_number_against_none_is_infinitely_far() {
    let a = run([0.0, 1.0], &[], |t| [t, t]);
    let b = run([0.0, 1.0], &[], |t| [if t > 0.5 { f64::NAN } else { t }, t]);
    let comparison = compared(&a, &b);
    let plain = &comparison.signals[0].plain;
    assert_eq!(plain.max, f64::INFINITY);
    assert!((plain.exceeds_at_s[0].unwrap() - 0.5).abs() < 1.5 * PERIOD);
    assert_eq!(comparison.signals[1].plain.max, 0.0);
}
