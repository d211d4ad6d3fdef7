//! Comparison of filters with filterpy and SciPy.

use crate::support::peer::{interpreter, numbers, rows, script};
use crate::support::{CELL, LINEAR, chi_squared_95, f1, f2, f3, measurements, settings};
use serde_json::json;
use twinrig_estimate::{
    Butterworth, Channel, ChargeAmplifier, ForceEstimator, ForceResponse, Measurement, Settings,
};
use twinrig_kernel::stream;

/// Greatest deviation of each column over its greatest value.
fn deviation(ours: &[Vec<f64>], theirs: &[Vec<f64>]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    let greatest = |column: usize, of: &dyn Fn(usize) -> f64| {
        assert_eq!(ours[0].len(), theirs[0].len(), "{column}");
        (0..ours.len()).map(|row| of(row).abs()).fold(0.0, f64::max)
    };
    let column = |column: usize| {
        let scale = greatest(column, &|row| theirs[row][column]);
        let error = greatest(column, &|row| ours[row][column] - theirs[row][column]);
        if scale > 0.0 { error / scale } else { error }
    };
    (0..ours[0].len()).map(column).fold(0.0, f64::max)
}

/// States and covariances after each time stamp.
fn estimates(settings: &Settings, measured: &[Measurement]) -> [Vec<Vec<f64>>; 2] {
    let mut estimator = ForceEstimator::new(settings).unwrap();
    let (mut states, mut covariances) = (Vec::new(), Vec::new());
    for same_time in measured.chunk_by(|one, other| one.at_ns == other.at_ns) {
        for &measurement in same_time {
            estimator.push(measurement);
        }
        states.push(estimator.state().to_vec());
        covariances.push(estimator.covariance().to_vec());
    }
    [states, covariances]
}

/// Compares filters on 600 steps of uneven length. Both compute in doubles; the covariances'
/// condition of up to 1e6 costs as many units of rounding: 1e-10, and a margin.
fn compare(filter: &str, all: &[Settings]) {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let measured = measurements(7, 600);
    let steps: Vec<_> = measured
        .chunk_by(|one, other| one.at_ns == other.at_ns)
        .collect();
    let task = |settings: &Settings| {
        let channels = if settings.frequency.is_some() { 3 } else { 2 };
        let values = |step: &&[Measurement]| -> Vec<f64> {
            step[..channels].iter().map(|it| it.value).collect()
        };
        json!({
            "filter": filter,
            "settings": settings,
            "times": steps.iter().map(|step| step[0].at_ns).collect::<Vec<_>>(),
            "channels": steps.iter().map(values).collect::<Vec<_>>(),
        })
    };
    let tasks = all.iter().map(task).collect();
    let theirs = script(&interpreter, "kalman.py", &tasks);
    for (settings, theirs) in all.iter().zip(theirs.as_array().unwrap()) {
        let theirs = ["states", "covariances"].map(|name| rows(&theirs[name]));
        let ours = estimates(settings, &measured);
        for (ours, theirs) in ours.iter().zip(&theirs) {
            let deviation = deviation(ours, theirs);
            assert!(deviation < 1e-9, "{deviation:e} {settings:?}");
        }
        // The comparison can fail: a millionth of a variance.
        let mut changed = *settings;
        changed.piezoelectric = changed.piezoelectric.map(|it| it * (1.0 + 1e-6));
        let changed = estimates(&changed, &measured);
        assert!(deviation(&changed[1], &theirs[1]) > 1e-9);
    }
}

#[test]
fn linear_filters_are_those_of_filterpy() {
    let [mut f1_white, mut f3_white] = [f1(), f3()].map(|model| settings(model, LINEAR));
    let [f1, f3] = [f1_white, f3_white];
    f1_white.white = 1e4;
    f3_white.white = 1e4;
    compare("linear", &[f1, f3, f1_white, f3_white]);
}

#[test]
fn extended_filters_are_those_of_filterpy() {
    let all = [f1(), f2(), f3()].map(|model| {
        let mut settings = settings(model, ForceResponse::Hysteresis(CELL));
        settings.white = 1e4;
        settings
    });
    compare("extended", &all);
}

#[test]
fn chi_squared_bands_are_those_of_scipy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let degrees = [30.0, 600.0, 1200.0, 10_000.0];
    let task = json!({"task": "quantiles", "degrees": degrees});
    let theirs = rows(&script(&interpreter, "signals.py", &task));
    for (&count, theirs) in degrees.iter().zip(&theirs) {
        for (ours, theirs) in chi_squared_95(count).iter().zip(theirs) {
            assert!(
                (ours / theirs - 1.0).abs() < 1e-3,
                "{count}: {ours} {theirs}"
            );
        }
    }
}

/// Steps and time constants over four decades.
fn cases() -> Vec<[f64; 4]> {
    let mut random = stream(5, "tests/transitions");
    let mut decades = |low: f64, high: f64| libm::pow(10.0, low + (high - low) * random.unit());
    let mut cases = vec![[0.05, 0.1, 0.005, 1e-3], [0.05, 0.02, 0.02, 1e-3]];
    for _ in 0..30 {
        let k = decades(-3.0, 1.0);
        cases.push([
            k,
            decades(-3.0, 1.0),
            decades(-3.5, 0.0),
            decades(-4.0, 0.0),
        ]);
    }
    cases
}

#[test]
fn amplifier_transition_is_the_matrix_exponential() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let task = json!({"task": "transitions", "cases": cases()});
    let theirs = script(&interpreter, "signals.py", &task);
    for ([k, t1, t2, dt], theirs) in cases().into_iter().zip(theirs.as_array().unwrap()) {
        let amplifier = ChargeAmplifier {
            sensitivity: k,
            feedback_s: t1,
            lag_s: t2,
        };
        let (transition, noise) = amplifier.transition(dt);
        let expected = numbers(&theirs["transition"]);
        let (scale, case) = (transition.abs().max(), [k, t1, t2, dt]);
        for (i, &expected) in expected.iter().enumerate() {
            let ours = transition[(i / 5, i % 5)];
            // Up to 2¹⁰ doublings of rounding, of entries next to the greatest one.
            assert!(
                (ours - expected).abs() < 1e-12 * scale,
                "{case:?} {i}: {ours} {expected}"
            );
        }
        // Entries over the deviations, as correlations; Van Loan's exponential loses digits where
        // the step is ten times the shortest time constant, and a quadrature is as good.
        let expected = numbers(&theirs["noise"]);
        for (i, &expected) in expected.iter().enumerate() {
            let (row, column) = (i / 5, i % 5);
            let unit = (noise[(row, row)] * noise[(column, column)]).sqrt();
            let error = (noise[(row, column)] - expected).abs() / unit;
            assert!(error < 1e-9, "{case:?} {i}: {error:e}");
        }
    }
}

/// Samples of a bump with noise.
fn samples(count: u64) -> Vec<f64> {
    let all = measurements(9, count);
    let cell = all
        .iter()
        .filter(|it| it.channel == Channel::Piezoresistive);
    cell.map(|it| it.value).collect()
}

#[test]
fn butterworth_filters_are_those_of_scipy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    for (order, cutoff_hz, rate_hz) in [(4, 10.0, 1e3), (2, 40.0, 1e3), (8, 90.0, 500.0)] {
        let samples = samples(700);
        let task = json!({
            "task": "butterworth",
            "order": order,
            "cutoff_hz": cutoff_hz,
            "rate_hz": rate_hz,
            "samples": samples,
        });
        let theirs = script(&interpreter, "signals.py", &task);
        let design = Butterworth::new(order, cutoff_hz, rate_hz).unwrap();
        for (ours, theirs) in design.sections().iter().zip(rows(&theirs["sos"])) {
            let [b0, b1, b2] = ours.b;
            let [a1, a2] = ours.a;
            for (ours, theirs) in [b0, b1, b2, 1.0, a1, a2].iter().zip(theirs) {
                assert!((ours / theirs - 1.0).abs() < 1e-12, "{ours} {theirs}");
            }
        }
        let stream = |settled: bool| -> Vec<f64> {
            let mut filter = design.clone();
            if settled {
                filter.settle(samples[0]);
            }
            samples.iter().map(|&sample| filter.step(sample)).collect()
        };
        let close = |ours: &[f64], name: &str, tolerance: f64| {
            for (ours, theirs) in ours.iter().zip(numbers(&theirs[name])) {
                assert!((ours - theirs).abs() < tolerance, "{name}: {ours} {theirs}");
            }
        };
        // Poles at 1 − 0.02 amplify rounding of the coefficients by their distances from 1,
        // squared.
        close(&stream(false), "causal", 1e-11);
        close(&stream(true), "settled", 1e-11);
        close(&design.zero_phase(&samples).unwrap(), "zero_phase", 1e-9);
        // A phase at 1e-4 of the cut-off frequency: the group delay to 1e-8.
        let delay = theirs["delay_s"].as_f64().unwrap();
        assert!(
            (design.group_delay_s() / delay - 1.0).abs() < 1e-7,
            "{delay}"
        );
    }
}
