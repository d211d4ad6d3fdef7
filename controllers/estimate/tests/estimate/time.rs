//! Order of arrival, missing and invalid measurements, saved state.

use crate::support::{CELL, MS, f1, f2, f3, measurements, settings};
use proptest::prelude::*;
use twinrig_estimate::{
    Channel, Counters, Estimate, ForceEstimator, ForceResponse, Measurement, Model, Outcome,
};
use twinrig_kernel::{Snapshot, stream};

fn models() -> [Model; 3] {
    [f1(), f2(), f3()]
}

fn estimator(model: Model) -> ForceEstimator {
    let mut settings = settings(model, ForceResponse::Hysteresis(CELL));
    settings.white = 1e3;
    settings.recovery = Some(twinrig_estimate::RECOVERY);
    ForceEstimator::new(&settings).unwrap()
}

/// State, covariance and estimate to the last bit, without counters and history.
fn bits(estimator: &ForceEstimator) -> (Vec<u64>, Estimate) {
    let numbers = estimator.state().iter().chain(estimator.covariance());
    (
        numbers.map(|it| it.to_bits()).collect(),
        estimator.estimate(),
    )
}

/// Delays each measurement by up to `reach` places.
fn shuffle(mut all: Vec<Measurement>, reach: u64, seed: u64) -> Vec<Measurement> {
    let mut random = stream(seed, "tests/shuffle");
    let mut arrival: Vec<_> = (0..all.len() as u64)
        .map(|i| (i + random.between(0, reach), i))
        .collect();
    arrival.sort_unstable();
    let order: Vec<_> = arrival
        .iter()
        .map(|&(_, i)| usize::try_from(i).unwrap())
        .collect();
    let sorted = all.clone();
    for (place, &from) in all.iter_mut().zip(&order) {
        *place = sorted[from];
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn order_of_arrival_has_no_effect(seed: u64, reach in 1_u64..60, missing in 0_u64..10) {
        let mut random = stream(seed, "tests/missing");
        let mut sorted = measurements(seed, 150);
        sorted.retain(|_| random.between(0, 9) >= missing / 2);
        prop_assume!(!sorted.is_empty());
        let arrived = shuffle(sorted.clone(), reach, seed);
        for model in models() {
            let (mut in_order, mut as_arrived) = (estimator(model), estimator(model));
            for &measurement in &sorted {
                in_order.push(measurement);
            }
            for &measurement in &arrived {
                let outcome = as_arrived.push(measurement);
                let kept = [Outcome::Applied, Outcome::Late, Outcome::Ignored];
                prop_assert!(kept.contains(&outcome), "{outcome:?}");
            }
            prop_assert_eq!(bits(&in_order), bits(&as_arrived));
        }
    }

    #[test]
    fn restored_state_continues_bit_for_bit(seed: u64, place in 1_usize..300) {
        let arrived = shuffle(measurements(seed, 120), 20, seed);
        for model in models() {
            let mut whole = estimator(model);
            let mut restored = None;
            for (i, &measurement) in arrived.iter().enumerate() {
                if i == place {
                    restored = Some(Snapshot::of(&whole).read::<ForceEstimator>().unwrap());
                }
                whole.push(measurement);
                restored.as_mut().map(|it| it.push(measurement));
            }
            let restored = restored.unwrap();
            prop_assert_eq!(bits(&whole), bits(&restored));
            prop_assert_eq!(Snapshot::of(&whole), Snapshot::of(&restored));
        }
    }
}

proptest! {
    /// Arbitrary bits as time stamps and values.
    #[test]
    fn no_measurement_breaks_a_filter(all in prop::collection::vec(any::<(u64, u8, u64, bool)>(), 1..200)) {
        for model in models() {
            let mut estimator = estimator(model);
            for &(at_ns, channel, bits, usual) in &all {
                let channels = [Channel::Piezoresistive, Channel::Piezoelectric, Channel::Frequency];
                let value = f64::from_bits(bits);
                estimator.push(Measurement {
                    at_ns: if usual { at_ns % (500 * MS) } else { at_ns },
                    channel: channels[usize::from(channel) % 3],
                    value: if usual { value % 10.0 } else { value },
                });
            }
            let estimate = estimator.estimate();
            prop_assert!(estimator.state().iter().all(|it| it.is_finite()), "{estimate:?}");
            prop_assert!(estimator.covariance().iter().all(|it| it.is_finite()), "{estimate:?}");
        }
    }
}

#[test]
fn old_and_duplicate_measurements_are_dropped_and_counted() {
    let all = measurements(3, 60);
    for model in models() {
        let mut estimator = estimator(model);
        for &measurement in &all {
            estimator.push(measurement);
        }
        let before = bits(&estimator);
        let newest = *all
            .iter()
            .rfind(|it| it.channel == Channel::Piezoelectric)
            .unwrap();
        assert_eq!(estimator.push(newest), Outcome::Duplicate);
        let next_value = Measurement {
            value: newest.value + 1.0,
            ..newest
        };
        assert_eq!(estimator.push(next_value), Outcome::Duplicate);
        assert_eq!(estimator.push(all[0]), Outcome::TooOld);
        for value in [f64::NAN, f64::INFINITY, -2e9] {
            let at_ns = newest.at_ns + MS;
            let invalid = Measurement {
                at_ns,
                value,
                ..newest
            };
            assert_eq!(estimator.push(invalid), Outcome::Invalid);
        }
        assert_eq!(bits(&estimator), before);
        let channels = if matches!(model, Model::F2 { .. }) {
            3
        } else {
            2
        };
        let expected = Counters {
            applied: 60 * channels,
            ignored: 60 * (3 - channels),
            duplicate: 2,
            too_old: 1,
            invalid: 3,
            late: 0,
        };
        assert_eq!(estimator.counters(), expected);
    }
}

#[test]
fn history_reaches_back_as_far_as_documented() {
    let step = |at_ns| Measurement {
        at_ns,
        channel: Channel::Piezoelectric,
        value: 0.1,
    };
    let mut estimator = estimator(f1());
    for i in 1..=ForceEstimator::HISTORY as u64 + 1 {
        estimator.push(step(2 * i * MS));
    }
    // The measurement at 2 ms has left the history.
    assert_eq!(estimator.push(step(MS)), Outcome::TooOld);
    assert_eq!(estimator.push(step(2 * MS)), Outcome::TooOld);
    assert_eq!(estimator.push(step(3 * MS)), Outcome::Late);
    assert_eq!(estimator.estimate_at(2 * MS - 1), None);
}

#[test]
fn estimates_between_measurements_are_predictions() {
    let all = measurements(4, 100);
    for model in models() {
        let mut whole = estimator(model);
        let mut past = estimator(model);
        let middle = all[240].at_ns;
        for &measurement in &all {
            whole.push(measurement);
            if measurement.at_ns <= middle {
                past.push(measurement);
            }
        }
        let before = bits(&whole);
        // What the filter knew then, not what it has learnt since.
        assert_eq!(whole.estimate_at(middle), past.estimate_at(middle));
        let between = whole.estimate_at(middle + 100_000);
        assert_eq!(between, past.estimate_at(middle + 100_000));
        // Force grows by the rate, deviation by the process.
        let now = whole.estimate();
        let later = whole.estimate_at(now.at_ns.unwrap() + 10).unwrap();
        assert!((later.force - now.force - 1e-8 * now.rate).abs() < 1e-12);
        let later = whole.estimate_at(now.at_ns.unwrap() + 1000 * MS).unwrap();
        assert!(later.deviation > 2.0 * now.deviation);
        assert_eq!(bits(&whole), before);
    }
}

#[test]
fn a_step_allocates_nothing() {
    for model in models() {
        let mut estimator = estimator(model);
        let all = shuffle(measurements(5, 200), 10, 5);
        let (start, rest) = all.split_at(300);
        for &measurement in start {
            estimator.push(measurement);
        }
        let info = allocation_counter::measure(|| {
            for &measurement in rest {
                estimator.push(measurement);
                std::hint::black_box(estimator.estimate_at(measurement.at_ns + MS));
            }
        });
        assert_eq!(info.count_total, 0);
    }
}
