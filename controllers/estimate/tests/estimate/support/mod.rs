//! Settings, signals and statistics of the tests.
#![allow(dead_code, reason = "each test program uses a part")]

pub mod peer;

use twinrig_estimate::{
    Channel, ChargeAmplifier, Decay, ForceEstimator, ForceResponse, Hysteresis, Measurement, Model,
    Piezoresistive, Settings, Sigmoid, StateSettings,
};
use twinrig_kernel::stream;

pub const MS: u64 = 1_000_000;

/// Response with a saturation above 12 N and a loop of 1 N.
pub const CELL: Hysteresis = Hysteresis {
    loading: Sigmoid {
        a: 4.0,
        b: -0.6,
        c: -5.0,
        d: 0.5,
    },
    unloading: Sigmoid {
        a: 3.9,
        b: -0.55,
        c: -4.0,
        d: 0.6,
    },
    switch: 0.05,
};

pub const LINEAR: ForceResponse = ForceResponse::Linear {
    gain: 0.2,
    offset: 1.0,
};

/// Amplifier of the facts: T1 = 0.1 s, T2 = 5 ms, k = 0.05.
pub const AMPLIFIER: ChargeAmplifier = ChargeAmplifier {
    sensitivity: 0.05,
    feedback_s: 0.1,
    lag_s: 0.005,
};

pub const fn state(initial: f64, variance: f64, noise: f64) -> StateSettings {
    StateSettings {
        initial,
        variance,
        noise,
    }
}

/// Model F1 with the process covariance of eq. 4.18.
pub fn f1() -> Model {
    Model::F1 {
        gain: 0.02,
        states: [
            state(0.0, 1.0, 1e-4),
            state(0.0, 100.0, 1e-1),
            state(0.0, 0.01, 1e-4),
        ],
    }
}

pub fn f2() -> Model {
    Model::F2 {
        rate: Decay {
            value: -0.05,
            scale_hz: 1.7,
        },
        acceleration: Decay {
            value: 5e-3,
            scale_hz: 1.7,
        },
        states: [
            state(0.0, 1.0, 1e-4),
            state(0.0, 100.0, 1e-1),
            state(0.0, 1e4, 1.0),
            state(12.0, 1.0, 1e-3),
            state(0.0, 0.01, 1e-8),
        ],
    }
}

pub fn f3() -> Model {
    Model::F3 {
        amplifier: AMPLIFIER,
        states: [
            state(0.0, 1.0, 1e-4),
            state(0.0, 100.0, 1e-1),
            state(0.0, 1e4, 1.0),
            state(0.0, 100.0, 1e-4),
            state(0.0, 0.01, 1e-8),
            state(0.0, 0.01, 1e-8),
        ],
    }
}

pub fn settings(model: Model, response: ForceResponse) -> Settings {
    Settings {
        model,
        piezoresistive: Some(Piezoresistive {
            response,
            variance: 1e-3,
        }),
        piezoelectric: Some(1e-3),
        frequency: matches!(model, Model::F2 { .. }).then_some(0.04),
        period_s: 1e-3,
        white: 0.0,
        recovery: None,
    }
}

pub fn push(estimator: &mut ForceEstimator, at_ns: u64, channel: Channel, value: f64) {
    estimator.push(Measurement {
        at_ns,
        channel,
        value,
    });
}

/// Bump of eq. 4.17 with the sign corrected: force [N] and rate [N/s] at a time [s]; 20 N, 2 Hz.
pub fn bump(seconds: f64) -> [f64; 2] {
    const HZ: f64 = 2.0;
    let x = 2.0 * (seconds * HZ).rem_euclid(1.0) - 1.0;
    let rest = 1.0 - x * x;
    if rest <= 0.0 {
        return [0.0, 0.0];
    }
    let force = 20.0 * libm::exp(1.0 - 1.0 / rest);
    [force, force * -2.0 * x / (rest * rest) * 2.0 * HZ]
}

/// Measurements of both cells and the frequency, every 0.9 to 1.1 ms, with noise. The piezoelectric
/// cell is a rate sensor: all that matters here is that signals vary.
pub fn measurements(seed: u64, count: u64) -> Vec<Measurement> {
    let mut noise = stream(seed, "tests/measurements");
    let mut all = Vec::new();
    let mut at_ns = 0;
    for _ in 0..count {
        at_ns += noise.between(900_000, 1_100_000);
        let [force, rate] = bump(at_ns as f64 * 1e-9);
        let values = [
            CELL.at(force, rate).voltage + 0.03 * noise.normal(),
            0.02 * rate + 0.03 * noise.normal() + 0.05,
            12.6 + 0.2 * noise.normal(),
        ];
        let channels = [
            Channel::Piezoresistive,
            Channel::Piezoelectric,
            Channel::Frequency,
        ];
        for (channel, value) in channels.into_iter().zip(values) {
            all.push(Measurement {
                at_ns,
                channel,
                value,
            });
        }
    }
    all
}

/// Two-sided 95 % interval of chi-squared with `count` degrees of freedom, by the cube root of
/// Wilson and Hilferty, which from 30 degrees is right to 1e-3 (compared with SciPy in `peers.rs`).
pub fn chi_squared_95(count: f64) -> [f64; 2] {
    let spread = (2.0 / (9.0 * count)).sqrt();
    [-1.959_964, 1.959_964].map(|z| {
        let root = 1.0 - 2.0 / (9.0 * count) + z * spread;
        count * root * root * root
    })
}
