//! Comparison with filterpy and SciPy.

mod support;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use support::{AMPLIFIER, CELL, LINEAR, chi_squared_95, f1, f2, f3, measurements, settings};
use twinrig_estimate::fit::{self, ForceSample, RateSample, Run};
use twinrig_estimate::{
    Butterworth, Channel, ChargeAmplifier, ForceEstimator, ForceResponse, Hysteresis, Measurement,
    Settings, Sigmoid,
};
use twinrig_kernel::stream;
use twinrig_testing::python;

fn script(interpreter: &Path, name: &str, input: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference")
        .join(name);
    python::run(interpreter, &script, &[], input)
}

fn interpreter() -> Option<PathBuf> {
    python::python_of_peers("filterpy.kalman, scipy.signal, scipy.optimize")
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|it| it.as_f64().unwrap()).collect()
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

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

/// Compares a filter on 600 steps of uneven length. Both compute in doubles; the covariances'
/// condition of up to 1e6 costs as many units of rounding: 1e-10, and a margin.
fn compare(interpreter: &Path, filter: &str, settings: &Settings) {
    let measured = measurements(7, 600);
    let channels = if settings.frequency.is_some() { 3 } else { 2 };
    let steps: Vec<_> = measured
        .chunk_by(|one, other| one.at_ns == other.at_ns)
        .collect();
    let values = |step: &&[Measurement]| -> Vec<f64> {
        step[..channels].iter().map(|it| it.value).collect()
    };
    let task = json!({
        "filter": filter,
        "settings": settings,
        "times": steps.iter().map(|step| step[0].at_ns).collect::<Vec<_>>(),
        "channels": steps.iter().map(values).collect::<Vec<_>>(),
        "degrees": [],
    });
    let theirs = script(interpreter, "kalman.py", &task);
    let theirs = ["states", "covariances"].map(|name| rows(&theirs[name]));
    let ours = estimates(settings, &measured);
    for (ours, theirs) in ours.iter().zip(&theirs) {
        let deviation = deviation(ours, theirs);
        assert!(deviation < 1e-9, "{filter}: {deviation:e}");
    }
    // The comparison can fail: a millionth of a variance.
    let mut changed = *settings;
    changed.piezoelectric = changed.piezoelectric.map(|it| it * (1.0 + 1e-6));
    let changed = estimates(&changed, &measured);
    assert!(deviation(&changed[1], &theirs[1]) > 1e-9);
}

#[test]
fn linear_filters_are_those_of_filterpy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    for model in [f1(), f3()] {
        for white in [0.0, 1e4] {
            let mut settings = settings(model, LINEAR);
            settings.white = white;
            compare(&interpreter, "linear", &settings);
        }
    }
}

#[test]
fn extended_filters_are_those_of_filterpy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    for model in [f1(), f2(), f3()] {
        let mut settings = settings(model, ForceResponse::Hysteresis(CELL));
        settings.white = 1e4;
        compare(&interpreter, "extended", &settings);
    }
}

#[test]
fn chi_squared_bands_are_those_of_scipy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let degrees = [30.0, 600.0, 1200.0, 10_000.0];
    let task = json!({
        "filter": "linear",
        "settings": settings(f1(), LINEAR),
        "times": [0],
        "channels": [[0.0, 0.0]],
        "degrees": degrees,
    });
    let theirs = rows(&script(&interpreter, "kalman.py", &task)["quantiles"]);
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
        // Poles at 1 − 0.02 amplify rounding of the coefficients by their distances from 1, squared.
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

/// Filtered, as in a bench: forces \[N\] and rates \[N/s\] at 1 kHz over 1.5 s.
fn bumps() -> Vec<[f64; 2]> {
    (0..1500)
        .map(|ms| support::bump(1e-3 * f64::from(ms)))
        .collect()
}

/// Deviation of parameters, relative.
fn relative(ours: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    let errors = ours
        .iter()
        .zip(theirs)
        .map(|(ours, theirs)| (ours / theirs - 1.0).abs());
    errors.fold(0.0, f64::max)
}

#[test]
fn hysteresis_is_identified_as_by_scipy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let mut noise = stream(3, "tests/identification");
    let sample = |[force, rate]: [f64; 2]| ForceSample {
        force,
        rate,
        voltage: CELL.at(force, rate).voltage + 0.03 * noise.normal(),
    };
    let samples: Vec<_> = bumps().into_iter().map(sample).collect();
    let ours = fit::hysteresis(&samples, None).unwrap();
    let sigmoid = |it: &Sigmoid| [it.a, it.b, it.c, it.d];
    let pack = |it: &Hysteresis| {
        let [loading, unloading] = [sigmoid(&it.loading), sigmoid(&it.unloading)];
        [loading.as_slice(), &unloading, &[it.switch]].concat()
    };
    let column = |of: fn(&ForceSample) -> f64| samples.iter().map(of).collect::<Vec<_>>();
    let task = json!({
        "task": "hysteresis",
        "forces": column(|it| it.force),
        "rates": column(|it| it.rate),
        "voltages": column(|it| it.voltage),
        "start": pack(&CELL),
    });
    let theirs = script(&interpreter, "signals.py", &task);
    let deviation = relative(&pack(&ours.model), &numbers(&theirs["parameters"]));
    assert!(deviation < 1e-5, "{deviation:e} {:?} {CELL:?}", ours.model);
    let r_squared = theirs["r_squared"].as_f64().unwrap();
    assert!((ours.r_squared - r_squared).abs() < 1e-9, "{r_squared}");
    // The noise of 0.03 V, to its own error of 2 %.
    assert!(
        (ours.residual / 0.03 - 1.0).abs() < 0.06,
        "{}",
        ours.residual
    );
}

/// Voltages of the transfer function by SciPy, for a force that is a straight line between samples.
fn voltages(interpreter: &Path, amplifier: &ChargeAmplifier, forces: &[f64]) -> Vec<f64> {
    let task = json!({
        "task": "voltages",
        "amplifier": [amplifier.sensitivity, amplifier.feedback_s, amplifier.lag_s],
        "times": times(forces.len()),
        "forces": forces,
    });
    numbers(&script(interpreter, "signals.py", &task))
}

fn times(count: usize) -> Vec<f64> {
    (0..count).map(|i| 1e-3 * i as f64).collect()
}

#[test]
fn amplifier_is_identified_as_by_scipy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let forces: Vec<f64> = bumps().iter().map(|it| it[0]).collect();
    let exact = voltages(&interpreter, &AMPLIFIER, &forces);
    let start = ChargeAmplifier {
        sensitivity: 0.03,
        feedback_s: 0.2,
        lag_s: 0.01,
    };
    // Without noise: the parameters of the transfer function.
    let ours = fit::amplifier(1e-3, &forces, &exact, &start).unwrap().model;
    let pack = |it: &ChargeAmplifier| [it.sensitivity, it.feedback_s, it.lag_s];
    let deviation = relative(&pack(&ours.amplifier), &pack(&AMPLIFIER));
    assert!(deviation < 1e-6, "{deviation:e}");
    // From the middle of a motion: the state at the first sample is fitted, too.
    let ours = fit::amplifier(1e-3, &forces[700..], &exact[700..], &start)
        .unwrap()
        .model;
    let deviation = relative(&pack(&ours.amplifier), &pack(&AMPLIFIER));
    assert!(deviation < 1e-6, "{deviation:e}");
    // With noise and in the middle of a motion: those of curve_fit.
    let mut noise = stream(4, "tests/identification");
    let noisy = exact[700..]
        .iter()
        .map(|it| it + 0.01 + 1e-3 * noise.normal());
    let (forces, noisy) = (&forces[700..], noisy.collect::<Vec<_>>());
    let ours = fit::amplifier(1e-3, forces, &noisy, &start).unwrap();
    let task = json!({
        "task": "amplifier",
        "times": times(forces.len()),
        "forces": forces,
        "voltages": noisy,
        "start": [0.03, 0.2, 0.01, 0.0],
    });
    let theirs = numbers(&script(&interpreter, "signals.py", &task));
    let [k, t1, t2] = pack(&ours.model.amplifier);
    let deviation = relative(&[k, t1, t2, ours.model.bias], &theirs);
    assert!(deviation < 1e-5, "{deviation:e}");
    assert!(ours.r_squared > 0.999);
}

#[test]
fn coefficients_are_identified_as_by_scipy() {
    let Some(interpreter) = interpreter() else {
        return;
    };
    let mut noise = stream(5, "tests/identification");
    let frequencies = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0];
    // V = a Ḟ + b F̈ with coefficients next to exponentials, and noise.
    let runs: Vec<(f64, Vec<RateSample>)> = frequencies
        .iter()
        .map(|&hz| {
            let fall = libm::exp(-hz / 1.7) + 0.01 * noise.normal();
            let mut sample = |i: u32| {
                let phase = 0.01 * f64::from(i);
                let (rate, acceleration) = (50.0 * libm::sin(phase), 300.0 * libm::cos(phase));
                let voltage = fall * (0.05 * rate - 5e-3 * acceleration);
                RateSample {
                    rate,
                    acceleration,
                    voltage: voltage + 0.02 + 0.01 * noise.normal(),
                }
            };
            (hz, (0..700).map(&mut sample).collect())
        })
        .collect();
    let view: Vec<_> = runs
        .iter()
        .map(|(hz, samples)| Run { hz: *hz, samples })
        .collect();
    let ours = fit::coefficients(&view).unwrap();
    let column = |samples: &[RateSample], of: fn(&RateSample) -> f64| {
        samples.iter().map(of).collect::<Vec<_>>()
    };
    let run = |(hz, samples): &(f64, Vec<RateSample>)| {
        json!({
            "hz": hz,
            "rates": column(samples, |it| it.rate),
            "accelerations": column(samples, |it| it.acceleration),
            "voltages": column(samples, |it| it.voltage),
        })
    };
    let task = json!({
        "task": "coefficients",
        "runs": runs.iter().map(run).collect::<Vec<_>>(),
    });
    let theirs = script(&interpreter, "signals.py", &task);
    for (ours, theirs) in ours.runs.iter().zip(rows(&theirs["planes"])) {
        let deviation = relative(&ours.model, &theirs);
        assert!(deviation < 1e-10, "{deviation:e}");
    }
    let decays = [ours.rate, ours.acceleration];
    for (ours, theirs) in decays.iter().zip(rows(&theirs["decays"])) {
        let deviation = relative(&[ours.model.value, ours.model.scale_hz], &theirs);
        assert!(deviation < 1e-5, "{deviation:e}");
        assert!(ours.r_squared > 0.99, "{}", ours.r_squared);
    }
    assert!(ours.acceleration.model.value < 0.0 && ours.rate.model.value > 0.0);
}
