//! First difference of two recordings.

use super::common::*;
use proptest::prelude::*;
use twinrig_kernel::SimTime;
use twinrig_record::{
    Divergence, Fingerprint, Recorder, Recording, RunInfo, divergence_within, first_divergence,
};
use twinrig_runtime::Group;

fn with_change(change: &dyn Fn(Group, u64, &mut [f64])) -> Recording {
    read(&record(Vec::new(), 100, &|_| true, change).expect("writing to memory"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn first_changed_bit_is_located(step in 0..100_u64, index in 0..11_usize) {
        let next = |values: &mut [f64]| values[index] = f64::from_bits(values[index].to_bits() ^ 1);
        let a = read(&recorded(100));
        // All later samples differ as well; the first one is reported.
        let b = with_change(&|group, now, values| if group == Group::Plant && now >= step { next(values) });
        let comparison = first_divergence(&a, &b);
        let (signal, component) = match index {
            0..3 => ("body/position", index),
            3..7 => ("body/orientation", index - 3),
            7..10 => ("leg/LF/angles", index - 7),
            _ => ("leg/LF/foot/load", 0),
        };
        let before = plant_values(step)[index];
        let after = f64::from_bits(before.to_bits() ^ 1);
        let expected = Divergence {
            time: SimTime::from_nanos(step * PERIOD_NS),
            group: "plant".to_owned(),
            signal: signal.to_owned(),
            component,
            a: Some(before),
            b: Some(after),
        };
        prop_assert_eq!(comparison.first, Some(expected));
        prop_assert_eq!(comparison.equal_samples, step + 100);
        prop_assert!(comparison.only_in_a.is_empty() && comparison.only_in_b.is_empty());
    }
}

#[test]
fn equal_recordings_have_no_divergence() {
    let comparison = first_divergence(&read(&recorded(100)), &read(&recorded(100)));
    assert_eq!(comparison.first, None);
    assert_eq!((comparison.signals, comparison.equal_samples), (9, 200));
}

#[test]
fn end_of_a_recording_is_a_difference_unless_truncated() {
    let (short, long) = (read(&recorded(60)), read(&recorded(100)));
    assert!(short.last_sample() < long.last_sample());
    for (a, b, cut_off) in [
        (&short, &long, [true, false]),
        (&long, &short, [false, true]),
    ] {
        let comparison = divergence_within(a, b, cut_off);
        assert_eq!((comparison.first, comparison.equal_samples), (None, 120));
        // Truncation of the longer recording does not explain the end of the shorter one.
        let [of_a, of_b] = cut_off;
        assert!(divergence_within(a, b, [of_b, of_a]).first.is_some());
        assert!(first_divergence(a, b).first.is_some());
    }
}

#[test]
fn zero_and_minus_zero_differ() {
    let b = with_change(&|group, step, values| {
        if group == Group::Plant && step == 3 {
            values[5] = 0.0;
        }
    });
    let first = first_divergence(&read(&recorded(100)), &b).first.unwrap();
    assert_eq!(
        (first.signal.as_str(), first.component),
        ("body/orientation", 2)
    );
}

#[test]
fn signal_in_one_recording_only_is_listed_without_being_a_difference() {
    let b = read(
        &record(
            Vec::new(),
            100,
            &|name| name != "body/orientation",
            &|_, _, _| (),
        )
        .unwrap(),
    );
    let comparison = first_divergence(&read(&recorded(100)), &b);
    assert_eq!(comparison.first, None);
    assert_eq!(comparison.only_in_a, ["plant: body/orientation"]);
    assert!(comparison.only_in_b.is_empty());
    let back = first_divergence(&b, &read(&recorded(100)));
    assert_eq!(back.only_in_b, ["plant: body/orientation"]);
}

#[test]
fn shorter_run_differs_at_its_first_missing_sample() {
    let first = first_divergence(&read(&recorded(100)), &read(&recorded(60)))
        .first
        .unwrap();
    assert_eq!(first.time, SimTime::from_nanos(60 * PERIOD_NS));
    assert_eq!((first.a, first.b), (Some(plant_values(60)[0]), None));
}

#[test]
fn earliest_difference_of_all_groups_is_reported() {
    for (plant, outputs) in [(70, 40), (40, 70), (40, 40)] {
        let b = with_change(&|group, step, values| {
            if step
                == if group == Group::Plant {
                    plant
                } else {
                    outputs
                }
            {
                values[0] += 1.0;
            }
        });
        let first = first_divergence(&read(&recorded(100)), &b).first.unwrap();
        assert_eq!(first.time, SimTime::from_nanos(40 * PERIOD_NS));
        assert_eq!(
            first.group,
            if plant <= outputs {
                "plant"
            } else {
                "process-outputs"
            }
        );
    }
}

#[test]
fn wire_bytes_are_compared_if_recorded_in_both() {
    let recorded = |traces: &[&str], bytes: &[u8]| {
        let info = RunInfo {
            traces: traces.iter().map(|trace| (*trace).to_owned()).collect(),
            ..info()
        };
        let mut recorder = Recorder::new(Vec::new(), &info, &[], &skeleton(), cadence()).unwrap();
        for step in 0..3 {
            recorder.bytes(SimTime::from_nanos(step), 0, b"ping");
        }
        recorder.bytes(SimTime::from_nanos(3), 0, bytes);
        let end = SimTime::from_nanos(4);
        read(&recorder.finish(Fingerprint::new().digest(), end).unwrap())
    };
    let difference = |a: &[u8], b: &[u8]| {
        first_divergence(&recorded(&["bus/out"], a), &recorded(&["bus/out"], b)).first
    };
    assert_eq!(difference(b"pong", b"pong"), None);
    let first = difference(b"pong", b"pang").unwrap();
    assert_eq!(
        (first.group.as_str(), first.signal.as_str()),
        ("wire", "bus/out")
    );
    assert_eq!((first.time, first.component), (SimTime::from_nanos(3), 1));
    assert_eq!(
        (first.a, first.b),
        (Some(f64::from(b'o')), Some(f64::from(b'a')))
    );
    let longer = difference(b"pong", b"ponger").unwrap();
    assert_eq!((longer.component, longer.a), (4, None));
    let one = first_divergence(&recorded(&["bus/out"], b""), &recorded(&["bus/in"], b""));
    assert_eq!(
        (one.first, one.only_in_a.as_slice()),
        (None, &["wire: bus/out".to_owned()][..])
    );
    assert_eq!(one.only_in_b, ["wire: bus/in"]);
}
