//! Cost of one step of 1 ms: prediction and all channels.

use divan::Bencher;
use twinrig_estimate::{
    Butterworth, Channel, ChargeAmplifier, Decay, ForceEstimator, ForceResponse, Hysteresis,
    Measurement, Model, Piezoresistive, RECOVERY, Settings, Sigmoid, StateSettings,
};

fn main() {
    divan::main();
}

const STATE: StateSettings = StateSettings {
    initial: 0.0,
    variance: 1.0,
    noise: 1e-4,
};

const CELL: Sigmoid = Sigmoid {
    a: 4.0,
    b: -0.4,
    c: -5.0,
    d: 0.5,
};

fn settings(model: Model) -> Settings {
    Settings {
        model,
        piezoresistive: Some(Piezoresistive {
            response: ForceResponse::Hysteresis(Hysteresis {
                loading: CELL,
                unloading: Sigmoid { c: -4.0, ..CELL },
                switch: 0.05,
            }),
            variance: 1e-4,
        }),
        piezoelectric: Some(1e-4),
        frequency: Some(1e-2),
        period_s: 1e-3,
        white: 1e6,
        recovery: Some(RECOVERY),
    }
}

/// A period of a millisecond, with jitter of the time stamps if `jitter` is not zero.
fn step(bencher: Bencher, model: Model, jitter: u64) {
    let mut estimator = ForceEstimator::new(&settings(model)).expect("the settings are valid");
    let (mut at_ns, mut turn) = (0, 0_u64);
    bencher.bench_local(|| {
        turn += 1;
        at_ns += 1_000_000 + jitter * (turn % 7);
        for (channel, value) in [
            (Channel::Piezoresistive, 2.0),
            (Channel::Piezoelectric, 0.1),
            (Channel::Frequency, 12.0),
        ] {
            estimator.push(divan::black_box(Measurement {
                at_ns,
                channel,
                value,
            }));
        }
    });
}

const AMPLIFIER: ChargeAmplifier = ChargeAmplifier {
    sensitivity: 0.05,
    feedback_s: 0.1,
    lag_s: 0.005,
};

#[divan::bench]
fn f1(bencher: Bencher) {
    let model = Model::F1 {
        gain: -0.05,
        states: [STATE; 3],
    };
    step(bencher, model, 0);
}

#[divan::bench]
fn f2(bencher: Bencher) {
    let decay = |value| Decay {
        value,
        scale_hz: 1.7,
    };
    let model = Model::F2 {
        rate: decay(-0.05),
        acceleration: decay(5e-3),
        states: [STATE; 5],
    };
    step(bencher, model, 0);
}

#[divan::bench]
fn f3(bencher: Bencher) {
    let model = Model::F3 {
        amplifier: AMPLIFIER,
        states: [STATE; 6],
    };
    step(bencher, model, 0);
}

#[divan::bench]
fn f3_with_jitter(bencher: Bencher) {
    let model = Model::F3 {
        amplifier: AMPLIFIER,
        states: [STATE; 6],
    };
    step(bencher, model, 1000);
}

#[divan::bench]
fn transition_of_f3(bencher: Bencher) {
    bencher.bench_local(|| AMPLIFIER.transition(divan::black_box(1e-3)));
}

#[divan::bench]
fn low_pass(bencher: Bencher) {
    let mut filter = Butterworth::new(4, 10.0, 1000.0).expect("the design is valid");
    bencher.bench_local(|| filter.step(divan::black_box(1.0)));
}
