//! Comparison of identifications with SciPy.

use std::path::Path;

use crate::support::peer::{interpreter, numbers, rows, script};
use crate::support::{AMPLIFIER, CELL};
use serde_json::json;
use twinrig_estimate::fit::{self, ForceSample, RateSample, Run};
use twinrig_estimate::{ChargeAmplifier, EstimateError, Hysteresis, Sigmoid};
use twinrig_kernel::stream;

/// Filtered, as in a bench: forces \[N\] and rates \[N/s\] at 1 kHz over 1.5 s.
fn bumps() -> Vec<[f64; 2]> {
    (0..1500)
        .map(|ms| crate::support::bump(1e-3 * f64::from(ms)))
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

#[test]
fn data_without_information_are_errors() {
    let force = |force, rate, voltage| ForceSample {
        force,
        rate,
        voltage,
    };
    let constant = vec![force(1.0, 0.0, 1.0); 20];
    let rising: Vec<_> = (0..20)
        .map(|i| force(f64::from(i), 1.0, f64::from(i)))
        .collect();
    let mut invalid: Vec<_> = (0..20)
        .map(|i| force(f64::from(i), f64::from(i) - 10.0, f64::from(i)))
        .collect();
    invalid[7].voltage = f64::NAN;
    for samples in [&[], constant.as_slice(), &rising, &invalid] {
        let error = fit::hysteresis(samples, None).unwrap_err();
        assert!(
            matches!(error, EstimateError::Undetermined { .. }),
            "{error}"
        );
    }
    assert!(matches!(
        fit::hysteresis(&constant[..8], Some(&CELL)),
        Err(EstimateError::Length { .. })
    ));
    let rate = |i: u32, voltage: f64| RateSample {
        rate: f64::from(i),
        acceleration: 2.0 * f64::from(i), // a multiple of the rate: no plane
        voltage,
    };
    let line: Vec<_> = (0..20).map(|i| rate(i, f64::from(i))).collect();
    for samples in [&[], line.as_slice()] {
        let run = Run { hz: 1.0, samples };
        assert!(fit::coefficients(&[run, run]).is_err());
    }
    assert!(fit::coefficients(&[]).is_err());
    let flat = fit::amplifier(1e-3, &[1.0; 50], &[0.5; 50], &AMPLIFIER);
    assert!(flat.is_err(), "{flat:?}");
    assert!(fit::amplifier(1e-3, &[1.0; 50], &[0.5; 49], &AMPLIFIER).is_err());
    assert!(fit::amplifier(0.0, &[1.0; 50], &[0.5; 50], &AMPLIFIER).is_err());
    assert!(fit::amplifier(1e-3, &[1.0; 3], &[0.5; 3], &AMPLIFIER).is_err());
}
