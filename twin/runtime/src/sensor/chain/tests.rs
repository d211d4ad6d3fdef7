use twinrig_kernel::stream;

use super::*;
use crate::Timing;

const SEED: u64 = 1;

fn ms(millis: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(millis)
}

/// A chain of a signal of `size` elements whose initial results are zeros.
fn chain(size: usize, is_rotation: bool, model: SensorModel) -> SignalChain {
    let site = ChainSite {
        signal: "tank/level".into(),
        task: 0,
        from: 0..size,
        to: 0..size,
        is_rotation,
    };
    let interval = SimDuration::from_millis(1);
    let mut chain = SignalChain::new("gauge", site, model, (SEED, interval)).unwrap();
    chain.deliver(SimTime::ZERO, &mut vec![0.0; size]);
    chain
}

/// Returns the values that arrive with a transfer at `now`.
fn transfer(chain: &mut SignalChain, now: SimTime, values: &[f64]) -> Vec<f64> {
    chain.handle_results(now, values, true);
    let mut inputs = vec![0.0; values.len()];
    chain.deliver(now, &mut inputs);
    inputs
}

/// Samples of a constant, a millisecond apart.
fn samples(model: SensorModel, constant: f64, count: u64) -> Vec<f64> {
    let mut chain = chain(1, false, model);
    let times = (0..count).map(ms);
    times
        .map(|now| transfer(&mut chain, now, &[constant])[0])
        .collect()
}

fn mean(values: impl Iterator<Item = f64>, count: usize) -> f64 {
    values.sum::<f64>() / count as f64
}

/// Mean, variance and covariance of neighbours are those of independent normal numbers, each within
/// four of its standard errors.
#[test]
fn noise_is_white_around_the_bias() {
    let model = SensorModel {
        noise: 0.5,
        bias: 0.25,
        ..SensorModel::default()
    };
    let drawn = samples(model, 3.0, 20_000);
    let count = drawn.len();
    let root = (count as f64).sqrt();
    let average = mean(drawn.iter().copied(), count);
    assert!((average - 3.25).abs() < 4.0 * 0.5 / root, "{average}");
    let variance = mean(drawn.iter().map(|x| (x - 3.25) * (x - 3.25)), count);
    let error = 4.0 * 0.25 * 2.0_f64.sqrt() / root;
    assert!((variance - 0.25).abs() < error, "{variance}");
    let pairs = drawn.windows(2);
    let neighbours = mean(pairs.map(|x| (x[0] - 3.25) * (x[1] - 3.25)), count - 1);
    assert!(neighbours.abs() < 4.0 * 0.25 / root, "{neighbours}");
}

/// Covariance of a Wiener process: σ² · min(s, t), at whatever instants it is sampled.
#[test]
fn random_walk_has_the_covariance_of_a_wiener_process() {
    let model = SensorModel {
        random_walk: 0.2,
        ..SensorModel::default()
    };
    let count = 4000;
    let mut chain = chain(count, false, model);
    let truth = vec![1.0; count];
    let mut walks = Vec::new();
    for at_ms in [3, 40, 41, 250, 777, 1000] {
        let read = transfer(&mut chain, ms(at_ms), &truth);
        walks.push((at_ms as f64 * 1e-3, read));
    }
    for (s, one) in &walks {
        for (t, other) in &walks {
            let products = one.iter().zip(other).map(|(x, y)| (x - 1.0) * (y - 1.0));
            let expected = 0.04 * s.min(*t);
            // Variance of a product of two normal numbers: σ_s²σ_t² plus the squared covariance.
            let spread = (0.0016 * s * t + expected * expected).sqrt();
            let error = 4.0 * spread / (count as f64).sqrt();
            let found = mean(products, count);
            assert!((found - expected).abs() < error, "{s} {t}: {found}");
        }
    }
}

/// The error of rounding is uniform over the resolution q: its variance is q²/12.
#[test]
fn resolution_rounds_to_the_nearest_step() {
    let model = SensorModel {
        resolution: 0.1,
        ..SensorModel::default()
    };
    let mut chain = chain(1, false, model);
    let (mut values, count) = (stream(7, "levels"), 20_000);
    let errors: Vec<f64> = (0..count)
        .map(|n| {
            let value = 20.0 * values.unit() - 10.0;
            let read = transfer(&mut chain, ms(n), &[value])[0];
            let steps = read / 0.1;
            assert!((steps - steps.round()).abs() < 1e-9, "{read}");
            read - value
        })
        .collect();
    assert!(errors.iter().all(|error| error.abs() < 0.05 + 1e-12));
    let variance = mean(errors.iter().map(|error| error * error), errors.len());
    // Variance of the square of a uniform number: q⁴/180.
    let error = 4.0 * 0.01 / (180.0 * errors.len() as f64).sqrt();
    assert!((variance - 0.01 / 12.0).abs() < error, "{variance}");
}

#[test]
fn range_limits_the_noise_too() {
    let model = SensorModel {
        noise: 1.0,
        range: Some((-0.5, 0.25)),
        ..SensorModel::default()
    };
    let drawn = samples(model, 0.0, 1000);
    assert!(drawn.iter().all(|value| (-0.5..=0.25).contains(value)));
    assert!(drawn.contains(&-0.5) && drawn.contains(&0.25));
}

/// The score test, whose inversion is Wilson's interval, at 4 standard errors.
#[test]
fn lost_samples_leave_the_value_before() {
    let model = SensorModel {
        drop_out: 0.3,
        ..SensorModel::default()
    };
    let mut chain = chain(1, false, model);
    let (mut lost, mut last, count) = (0, 0.0, 10_000_u32);
    for n in 1..=count {
        let value = f64::from(n);
        let read = transfer(&mut chain, ms(n.into()), &[value])[0];
        assert!(read == value || read == last, "{n}: {read} after {last}");
        lost += u32::from(read == last);
        last = read;
    }
    let share = f64::from(lost) / f64::from(count);
    let error = 4.0 * (0.3 * 0.7 / f64::from(count)).sqrt();
    assert!((share - 0.3).abs() < error, "{share}");
}

/// An effect more draws from its own stream: the noise of the samples that remain is the same.
#[test]
fn losses_and_delays_change_no_noise() {
    let noisy = SensorModel {
        noise: 1.0,
        ..SensorModel::default()
    };
    let lossy = SensorModel {
        drop_out: 0.5,
        delay: Timing::Uniform {
            min: SimDuration::ZERO,
            max: SimDuration::from_micros(900),
        },
        ..noisy.clone()
    };
    let all: Vec<u64> = samples(noisy, 0.0, 200)
        .into_iter()
        .map(f64::to_bits)
        .collect();
    let rest = samples(lossy, 0.0, 200);
    assert!(
        rest.iter()
            .all(|value| *value == 0.0 || all.contains(&value.to_bits()))
    );
    assert!(rest.iter().any(|value| *value != 0.0));
}

/// A sample arrives at its instant, not a nanosecond earlier; a faster one waits for it.
#[test]
fn samples_arrive_after_their_delay_in_their_order() {
    let delays = [3_000_001, 500_000, 4_000_000].map(SimDuration::from_nanos);
    let model = SensorModel {
        delay: Timing::Trace(delays.to_vec()),
        ..SensorModel::default()
    };
    let mut chain = chain(1, false, model);
    let (mut arrivals, mut latest) = (Vec::new(), SimTime::ZERO);
    for (n, delay) in (0..30).zip(delays.iter().cycle()) {
        chain.handle_results(ms(n), &[(n + 1) as f64], true);
        latest = latest.max(ms(n) + *delay);
        arrivals.push(latest);
    }
    let nanos = arrivals.iter().map(|at| at.as_nanos());
    let mut probes: Vec<u64> = nanos.flat_map(|at| [at - 1, at]).collect();
    probes.sort_unstable();
    for now in probes.into_iter().map(SimTime::from_nanos) {
        let mut inputs = [0.0];
        chain.deliver(now, &mut inputs);
        let arrived = arrivals.iter().filter(|at| **at <= now).count();
        assert_eq!(inputs, [arrived as f64], "at {now}");
    }
}

/// The first transfer at or after each multiple of the period is sampled.
#[test]
fn samples_follow_the_grid_of_the_period() {
    let model = SensorModel {
        period: Some(SimDuration::from_millis(5)),
        ..SensorModel::default()
    };
    let mut chain = chain(1, false, model);
    let read: Vec<f64> = (0..9)
        .map(|n| transfer(&mut chain, ms(2 * n + 1), &[(2 * n + 1) as f64])[0])
        .collect();
    assert_eq!(read, [1.0, 1.0, 5.0, 5.0, 5.0, 11.0, 11.0, 15.0, 15.0]);
}

/// Without a transfer, only a value that has changed is a new one.
#[test]
fn unchanged_results_between_transfers_are_no_sample() {
    let model = SensorModel {
        noise: 1.0,
        ..SensorModel::default()
    };
    let mut chain = chain(1, false, model);
    let first = transfer(&mut chain, ms(1), &[2.0])[0];
    let mut read_after = |results: &[f64]| {
        let mut inputs = [0.0];
        chain.handle_results(ms(2), results, false);
        chain.deliver(ms(2), &mut inputs);
        inputs[0].to_bits()
    };
    assert_eq!(read_after(&[2.0]), first.to_bits());
    assert_ne!(read_after(&[3.0]), first.to_bits());
}

/// The error of an attitude is a rotation vector in the axes of the body, with the standard
/// deviation of the noise about each of them.
#[test]
fn noise_turns_a_rotation() {
    let deviation = 0.01;
    let model = SensorModel {
        noise: deviation,
        ..SensorModel::default()
    };
    let mut chain = chain(4, true, model);
    let truth = [0.5, -0.5, 0.5, 0.5];
    let (mut squares, count) = ([0.0; 3], 10_000_u32);
    for n in 1..=count {
        let [w, x, y, z] = transfer(&mut chain, ms(n.into()), &truth)[..] else {
            panic!("a quaternion")
        };
        let norm = w * w + x * x + y * y + z * z;
        assert!((norm - 1.0).abs() < 1e-14, "{norm}");
        // Vector part of truth* ⊗ read, which is half the rotation vector.
        let [a, b, c, d] = truth;
        let half = [
            a * x - b * w - c * z + d * y,
            a * y + b * z - c * w - d * x,
            a * z - b * y + c * x - d * w,
        ];
        for (square, half) in squares.iter_mut().zip(half) {
            *square += 4.0 * half * half / f64::from(count);
        }
    }
    for variance in squares {
        let relative = variance / (deviation * deviation) - 1.0;
        assert!(
            relative.abs() < 4.0 * (2.0 / f64::from(count)).sqrt() + 1e-3,
            "{relative}"
        );
    }
}

#[test]
fn impossible_parameters_are_refused() {
    let refused = |is_rotation, model: SensorModel| model.check(is_rotation).unwrap_err();
    let plain = SensorModel::default();
    let limited = SensorModel {
        range: Some((0.0, 1.0)),
        ..plain.clone()
    };
    assert_eq!(limited.check(false), Ok(()));
    let of_rotation = SensorModelError::OfRotation { key: "range" };
    assert_eq!(refused(true, limited), of_rotation);
    for model in [
        SensorModel {
            noise: f64::NAN,
            ..plain.clone()
        },
        SensorModel {
            range: Some((1.0, 1.0)),
            ..plain.clone()
        },
        SensorModel {
            drop_out: 1.1,
            ..plain.clone()
        },
        SensorModel {
            period: Some(SimDuration::ZERO),
            ..plain
        },
    ] {
        assert!(matches!(
            refused(false, model),
            SensorModelError::OutOfRange { .. }
        ));
    }
}
