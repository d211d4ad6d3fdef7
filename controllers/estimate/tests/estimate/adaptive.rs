//! F4 and the identification of creep, on cells with closed forms.

use twinrig_estimate::fit::{self, ForceSample};
use twinrig_estimate::{
    Channel, ChargeAmplifier, EstimateError, ForceEstimator, ForceResponse, Model, Piezoresistive,
    Settings,
};
use twinrig_kernel::stream;

use crate::support::{AMPLIFIER, CELL, MS, push, state};

/// Voltage that does not creep \[V\], final creep \[1/N\] and its time constant \[s\].
const FLOOR: f64 = 0.2;
const PER_NEWTON: f64 = 0.01;
const TIME: f64 = 60.0;

/// Force \[N\] and rate \[N/s\] at a time \[s\]: 1 to 25 N at 2 Hz.
fn load(seconds: f64) -> [f64; 2] {
    let omega = 2.0 * std::f64::consts::TAU;
    [
        13.0 - 12.0 * libm::cos(omega * seconds),
        12.0 * omega * libm::sin(omega * seconds),
    ]
}

/// Samples of a cell at 1 kHz that creeps from the first one on, with 1 mV of noise.
fn creeping(seconds: u32) -> Vec<ForceSample> {
    let mut noise = stream(5, "tests/creep");
    let mut creep = 0.0;
    let sample = |ms: u32| {
        let [force, rate] = load(1e-3 * f64::from(ms));
        let fresh = CELL.at(force, rate).voltage;
        let voltage = FLOOR + (1.0 + creep) * (fresh - FLOOR) + 1e-3 * noise.normal();
        creep += 1e-3 * (PER_NEWTON * force - creep) / TIME;
        ForceSample {
            force,
            rate,
            voltage,
        }
    };
    (0..1000 * seconds).map(sample).collect()
}

#[test]
fn creep_is_identified_with_the_response() {
    let samples = creeping(60);
    let found = fit::creep(1e-3, &samples, &vec![true; samples.len()]).unwrap();
    let near = |value: f64, expected: f64, share: f64| {
        assert!((value / expected - 1.0).abs() < share, "{value} {expected}");
    };
    near(found.model.floor, FLOOR, 0.05);
    near(found.model.per_newton, PER_NEWTON, 0.02);
    near(found.model.time_s, TIME, 0.02);
    near(found.model.hysteresis.loading.a, CELL.loading.a, 0.01);
    near(found.residual, 1e-3, 0.02);
    // Without creep the response explains the same samples a hundred times worse.
    let still = fit::hysteresis(&samples, None).unwrap();
    assert!(still.residual > 50.0 * found.residual, "{}", still.residual);
}

#[test]
fn creep_requires_a_mark_for_each_sample() {
    let samples = creeping(1);
    let error = fit::creep(1e-3, &samples, &[true; 3]).unwrap_err();
    assert!(
        matches!(error, EstimateError::Length { found: 3, .. }),
        "{error}"
    );
}

/// Root mean square of the error over the last two of ten seconds, of a filter that knows gain and
/// response of the cell before they changed by these shares \[N\].
fn error(model: Model, gain: f64, creep: f64) -> f64 {
    let mut filter = ForceEstimator::new(&Settings {
        model,
        piezoresistive: Some(Piezoresistive {
            response: ForceResponse::Hysteresis(CELL),
            variance: 4e-4,
        }),
        piezoelectric: Some(2.5e-5),
        frequency: None,
        period_s: 1e-3,
        white: 1e8,
        recovery: Some(twinrig_estimate::RECOVERY),
    })
    .unwrap();
    let mut noise = stream(6, "tests/adaptive");
    let real = ChargeAmplifier {
        sensitivity: AMPLIFIER.sensitivity * (1.0 + gain),
        ..AMPLIFIER
    };
    let (transition, _) = real.transition(1e-3);
    let (mut crystal, mut voltage, mut square) = (0.0, 0.0, 0.0);
    for ms in 0..10_000_u32 {
        let [force, rate] = load(1e-3 * f64::from(ms));
        let fresh = CELL.at(force, rate).voltage;
        let crept = FLOOR + (1.0 + creep) * (fresh - FLOOR);
        let at_ns = u64::from(ms) * MS;
        push(
            &mut filter,
            at_ns,
            Channel::Piezoresistive,
            crept + 3e-4 * noise.normal(),
        );
        push(
            &mut filter,
            at_ns,
            Channel::Piezoelectric,
            voltage + 3e-4 * noise.normal(),
        );
        if ms >= 8000 {
            let error = filter.estimate().force - force;
            square += error * error;
        }
        let [next, _] = load(1e-3 * f64::from(ms + 1));
        let mean = 1e3 * (next - force);
        voltage =
            transition[(4, 1)] * mean + transition[(4, 3)] * crystal + transition[(4, 4)] * voltage;
        crystal = transition[(3, 1)] * mean + transition[(3, 3)] * crystal;
    }
    (square / 2000.0).sqrt()
}

fn f4() -> Model {
    Model::F4 {
        amplifier: AMPLIFIER,
        floor: FLOOR,
        states: [
            state(0.0, 1.0, 0.0),
            state(0.0, 100.0, 0.0),
            state(0.0, 1e4, 0.0),
            state(0.0, 100.0, 0.0),
            state(0.0, 0.01, 0.0),
            state(0.0, 0.01, 1e-10),
            state(0.0, 0.01, 1e-8),
            state(0.0, 0.01, 0.0),
        ],
    }
}

fn f3() -> Model {
    let Model::F4 { states: s, .. } = f4() else {
        unreachable!()
    };
    Model::F3 {
        amplifier: AMPLIFIER,
        states: [s[0], s[1], s[2], s[3], s[4], s[7]],
    }
}

#[test]
fn gain_and_creep_are_followed_by_f4_only() {
    for (gain, creep) in [(0.05, 0.0), (0.0, 0.06), (-0.05, 0.04)] {
        let (with, without) = (error(f4(), gain, creep), error(f3(), gain, creep));
        assert!(with < 0.1, "F4 {gain} {creep}: {with} N");
        assert!(without > 0.2, "F3 {gain} {creep}: {without} N");
    }
    // As calibrated, both are right.
    assert!(error(f4(), 0.0, 0.0) < 0.1 && error(f3(), 0.0, 0.0) < 0.1);
}

#[test]
fn invalid_floor_is_refused() {
    let mut model = f4();
    if let Model::F4 { floor, .. } = &mut model {
        *floor = f64::NAN;
    }
    let settings = Settings {
        model,
        piezoresistive: None,
        piezoelectric: Some(1e-5),
        frequency: None,
        period_s: 1e-3,
        white: 0.0,
        recovery: None,
    };
    let error = ForceEstimator::new(&settings).unwrap_err().to_string();
    assert!(
        error.contains("floor of the piezoresistive voltage"),
        "{error}"
    );
}
