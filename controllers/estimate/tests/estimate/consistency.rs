//! Consistency on data of the filter's own model: NIS along a run, NEES over an ensemble. The same
//! tests fail for a process covariance wrong by a factor of ten.

use crate::support::{AMPLIFIER, LINEAR, MS, chi_squared_95, f1, f3, push, settings};
use nalgebra::{SMatrix, SVector};
use twinrig_estimate::{Channel, ForceEstimator, ForceResponse, Model, Settings};
use twinrig_kernel::{Stream, stream};

/// The process of a model, with the piezoelectric voltage as a row of the state.
struct Process<const N: usize> {
    transition: SMatrix<f64, N, N>,
    piezoelectric: SVector<f64, N>,
}

fn rate_process() -> Process<3> {
    let mut transition = SMatrix::identity();
    transition[(0, 1)] = 1e-3;
    Process {
        transition,
        piezoelectric: SVector::from([0.0, 0.02, 1.0]),
    }
}

fn amplifier_process() -> Process<6> {
    let mut transition = SMatrix::<f64, 6, 6>::identity();
    let (chain, _) = AMPLIFIER.transition(1e-3);
    transition.fixed_view_mut::<5, 5>(0, 0).copy_from(&chain);
    Process {
        transition,
        piezoelectric: SVector::from([0.0, 0.0, 0.0, 0.0, 1.0, 1.0]),
    }
}

/// Sums of a run: NIS with its degrees of freedom, and NEES of all states at the end.
struct Sums {
    nis: f64,
    count: f64,
    nees: f64,
}

/// Runs the process of `truth` and the filter of `filter` on its noisy measurements.
fn run<const N: usize>(
    process: &Process<N>,
    truth: &Settings,
    filter: &Settings,
    steps: u64,
    random: &mut Stream,
) -> Sums {
    let mut estimator = ForceEstimator::new(filter).unwrap();
    let states = truth.model.states();
    let mut state = SVector::<f64, N>::from_fn(|i, _| {
        states[i].initial + states[i].variance.sqrt() * random.normal()
    });
    let cell = truth.piezoresistive.unwrap();
    let ForceResponse::Linear { gain, offset } = cell.response else {
        panic!("the measurement has to be linear");
    };
    let mut sums = Sums {
        nis: 0.0,
        count: 0.0,
        nees: 0.0,
    };
    for step in 0..steps {
        if step > 0 {
            state = process.transition * state;
            for (value, settings) in state.iter_mut().zip(states) {
                *value += settings.noise.sqrt() * random.normal();
            }
        }
        let noise = [cell.variance, truth.piezoelectric.unwrap()].map(f64::sqrt);
        let force = gain * state[0] + offset + noise[0] * random.normal();
        let rate = process.piezoelectric.dot(&state) + noise[1] * random.normal();
        push(&mut estimator, step * MS, Channel::Piezoresistive, force);
        push(&mut estimator, step * MS, Channel::Piezoelectric, rate);
        let estimate = estimator.estimate();
        sums.nis += estimate.nis;
        sums.count += f64::from(estimate.nis_count);
    }
    sums.nees = estimator.nees(state.as_slice()).unwrap();
    sums
}

/// Settings with all process variances multiplied.
fn scaled(settings: &Settings, factor: f64) -> Settings {
    let mut scaled = *settings;
    for state in scaled.model.states_mut() {
        state.noise *= factor;
    }
    scaled
}

fn is_within(value: f64, [low, high]: [f64; 2]) -> bool {
    (low..high).contains(&value)
}

/// Whether NIS over a run of 5 s, and NEES over 200 runs of 0.2 s, are within their 95 % bands.
/// With 10 000 innovations the band of the mean NIS is 1 ± 0.028, with 600 or 1200 degrees of
/// freedom that of the mean NEES per state is 1 ± 0.11 or 1 ± 0.08.
fn consistency<const N: usize>(process: &Process<N>, model: Model, factor: f64) -> [bool; 2] {
    let truth = settings(model, LINEAR);
    let filter = scaled(&truth, factor);
    let mut random = stream(11, "tests/consistency");
    let long = run(process, &truth, &filter, 5000, &mut random);
    let mut nees = 0.0;
    for _ in 0..200 {
        nees += run(process, &truth, &filter, 200, &mut random).nees;
    }
    let degrees = 200.0 * N as f64;
    eprintln!(
        "factor {factor}: NIS {:.4}, NEES {:.4}",
        long.nis / long.count,
        nees / degrees
    );
    [
        is_within(long.nis, chi_squared_95(long.count)),
        is_within(nees, chi_squared_95(degrees)),
    ]
}

#[test]
fn f1_is_consistent_with_its_own_model_only() {
    let process = rate_process();
    assert_eq!(consistency(&process, f1(), 1.0), [true; 2]);
    assert_eq!(consistency(&process, f1(), 10.0), [false; 2]);
    assert_eq!(consistency(&process, f1(), 0.1), [false; 2]);
}

#[test]
fn f3_is_consistent_with_its_own_model_only() {
    let process = amplifier_process();
    assert_eq!(consistency(&process, f3(), 1.0), [true; 2]);
    assert_eq!(consistency(&process, f3(), 10.0), [false; 2]);
    assert_eq!(consistency(&process, f3(), 0.1), [false; 2]);
}
