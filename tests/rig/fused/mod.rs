//! The fused estimate of a leg's load against those of the single sensors, over drawn loads, noises
//! and biases. The sensor is that of the tactile bench, simulated; the filters know what a clean
//! calibration run has told about it, and have one set of covariances for all draws.
//!
//! Every filter starts at 0 N, which is right, with a wide deviation: it does not know that the
//! load is at rest. If it did, the first samples would tell the bias of the piezoelectric voltage:
//! that sensor alone would then err by 0.5 N instead of 4.6 N, and fusion would halve the error in
//! 88 of 100 draws ([`table`]).

mod draws;
mod filters;

use draws::{
    Draw, FULL_SCALE, Ranges, RateSensor, Samples, crept, load, sensor, simulate, voltages,
};
use filters::{Calibration, Contest, Errors, Tuning, Uses, calibrate, f1, f3, restricted, rmse};
use twinrig_estimate::Settings;

/// Seeds of the draws that are judged, and of those by which the covariances were tuned.
const SEED: u64 = 1;
const TUNING_SEED: u64 = 2;

/// Gain of the ideal rate sensor of F1, as of the bench's cell at low frequencies \[V·s/N\].
const GAIN: f64 = 0.05;

/// Results of [`tune`]: with both sensors, and with each one alone.
struct Tunings {
    fused: Tuning,
    resistive: Tuning,
    electric: Tuning,
}

const fn tuning(white: f64, resistive: f64, electric: f64) -> Tuning {
    Tuning {
        white,
        variances: [resistive, electric],
    }
}

/// The variance of the piezoresistive voltage is far above that of its noise: it stands for the
/// error of the identified response, which lasts a tenth of a second and is not white.
const F3: Tunings = Tunings {
    fused: tuning(1e10, 3e-2, 1e-2),
    resistive: tuning(1e5, 1e-5, 1e-5),
    electric: tuning(1e8, 1e-5, 1e-2),
};
const F1: Tunings = Tunings {
    fused: tuning(1e3, 1e-2, 1e-4),
    resistive: tuning(1e2, 1e-5, 1e-5),
    electric: tuning(1e3, 1e-5, 1e-2),
};

/// Bias below which the piezoelectric voltage counts as unbiased \[V\]: 0.01 % of full scale.
const UNBIASED: f64 = 1e-3;

/// Where the fused error has to be below half of each single sensor's.
const CLAIM: Ranges = Ranges {
    peak: [12.0, 28.0],
    hz: [0.5, 4.0],
    noise: [10e-3, 50e-3],
    bias: [2e-3, 10e-3],
};

/// Neighbours of that, where it may not be above 1.1 times that of the better one.
const ELSEWHERE: [(&str, Ranges); 6] = [
    (
        "peak 2 to 12 N",
        Ranges {
            peak: [2.0, 12.0],
            ..CLAIM
        },
    ),
    (
        "noise 1 to 10 mV",
        Ranges {
            peak: [2.0, 28.0],
            noise: [1e-3, 10e-3],
            ..CLAIM
        },
    ),
    (
        "noise 50 to 100 mV",
        Ranges {
            peak: [2.0, 28.0],
            noise: [50e-3, 100e-3],
            ..CLAIM
        },
    ),
    (
        "bias 0 to 0.2 %",
        Ranges {
            peak: [2.0, 28.0],
            bias: [0.0, 2e-3],
            ..CLAIM
        },
    ),
    (
        "bias 1 to 3 %",
        Ranges {
            peak: [2.0, 28.0],
            bias: [10e-3, 30e-3],
            ..CLAIM
        },
    ),
    (
        "4 to 6 Hz",
        Ranges {
            peak: [2.0, 28.0],
            hz: [4.0, 6.0],
            ..CLAIM
        },
    ),
];

/// Model of a filter, with the sensor that it is for.
#[derive(Clone, Copy)]
enum Kind {
    F1,
    F3,
}

impl Kind {
    fn settings(self, calibration: &Calibration, tuning: &Tuning) -> Settings {
        match self {
            Self::F1 => f1(calibration, tuning, GAIN),
            Self::F3 => f3(calibration, tuning),
        }
    }

    fn rate_sensor(self) -> RateSensor {
        match self {
            Self::F1 => RateSensor::Ideal(GAIN),
            Self::F3 => RateSensor::ChargeAmplifier,
        }
    }

    fn contest(self) -> Contest {
        let calibration = calibrate();
        let tunings = match self {
            Self::F1 => F1,
            Self::F3 => F3,
        };
        let fused = self.settings(&calibration, &tunings.fused);
        let single = |own, uses| {
            let own = self.settings(&calibration, own);
            [restricted(&fused, uses), restricted(&own, uses)]
        };
        Contest {
            single: [
                single(&tunings.resistive, Uses::Piezoresistive),
                single(&tunings.electric, Uses::Piezoelectric),
            ],
            fused,
        }
    }

    fn ensemble(self, seed: u64, count: u64, ranges: &Ranges) -> Vec<(Draw, Samples)> {
        let draw = |index| {
            let draw = Draw::new(seed, index, ranges);
            (draw, simulate(&draw, self.rate_sensor(), 0.0, seed))
        };
        (0..count).map(draw).collect()
    }
}

/// Errors in each draw of an ensemble, with a line for the reader.
fn contest(name: &str, contest: &Contest, ensemble: &[(Draw, Samples)]) -> Vec<Errors> {
    let all: Vec<_> = ensemble
        .iter()
        .map(|(_, samples)| contest.errors(samples))
        .collect();
    let mean = |error: &dyn Fn(&Errors) -> f64| {
        libm::exp(all.iter().map(|it| libm::log(error(it))).sum::<f64>() / all.len() as f64)
    };
    let greatest = |ratio: fn(&Errors) -> f64| all.iter().map(ratio).fold(0.0, f64::max);
    let above =
        |ratio: fn(&Errors) -> f64, bound: f64| all.iter().filter(|it| ratio(it) > bound).count();
    eprintln!(
        "{name}: fused {:.3} N, piezoresistive {:.3} ({:.3}) N, piezoelectric {:.3} ({:.3}) N; \
         ratio at most {:.2} ({:.2}), above 0.5 in {} ({}), above 1.1 in {} ({}) of {}",
        mean(&|it| it.fused),
        mean(&|it| it.single[0][0]),
        mean(&|it| it.single[0][1]),
        mean(&|it| it.single[1][0]),
        mean(&|it| it.single[1][1]),
        greatest(Errors::ratio),
        greatest(Errors::strict_ratio),
        above(Errors::ratio, 0.5),
        above(Errors::strict_ratio, 0.5),
        above(Errors::ratio, 1.1),
        above(Errors::strict_ratio, 1.1),
        all.len(),
    );
    for ((draw, _), errors) in ensemble.iter().zip(&all) {
        if errors.strict_ratio() > 1.1 {
            eprintln!("  {draw:.3?}: {errors:.3?}");
        }
    }
    all
}

/// In at least 95 of 100 draws, even if each single sensor has covariances of its own.
fn halves_the_error(kind: Kind) {
    let all = contest("claim", &kind.contest(), &kind.ensemble(SEED, 100, &CLAIM));
    let halved = all.iter().filter(|it| it.strict_ratio() < 0.5).count();
    assert!(halved >= 95, "{halved} of 100");
}

/// In every draw, with one exception: below 1 mV the piezoelectric voltage has by chance no bias,
/// and its integral from the right start no error. (Of 200 draws of that ensemble one in F3, five
/// in F1.)
///
/// Filters with covariances for the piezoresistive cell alone, which are too slow for the peaks of
/// greater loads, follow a few small and slow ones better: at most in 5 % of all draws. Most of
/// these have a small bias, too; with one seed they are 12 % of that ensemble.
fn is_not_worse(kind: Kind) {
    let filters = kind.contest();
    let mut worse = 0;
    for (name, ranges) in &ELSEWHERE {
        let ensemble = kind.ensemble(SEED, 40, ranges);
        let all = contest(name, &filters, &ensemble);
        for ((draw, _), errors) in ensemble.iter().zip(&all) {
            let holds = errors.ratio() <= 1.1 || draw.bias.abs() < UNBIASED;
            assert!(holds, "{name}: {draw:?} {errors:?}");
        }
        worse += all.iter().filter(|it| it.strict_ratio() > 1.1).count();
    }
    assert!(worse <= 12, "{worse} of 240");
}

#[test]
fn fusion_halves_the_error_of_each_sensor() {
    halves_the_error(Kind::F3);
}

#[test]
fn fusion_is_nowhere_worse_than_the_better_sensor() {
    is_not_worse(Kind::F3);
}

#[test]
fn fusion_with_an_ideal_rate_sensor_halves_the_error() {
    halves_the_error(Kind::F1);
}

#[test]
fn fusion_with_an_ideal_rate_sensor_is_nowhere_worse() {
    is_not_worse(Kind::F1);
}

/// The filters know the sensor from the calibration run alone; the thesis' fits have R² of 0.995
/// and 0.9997 (figures 4.11 and 4.13).
#[test]
fn calibration_identifies_the_sensor() {
    let calibration = calibrate();
    assert!(calibration.response.r_squared > 0.995);
    assert!(calibration.amplifier.r_squared > 0.9997);
    let truth = sensor().piezoelectric;
    let found = calibration.amplifier.model.amplifier;
    // The sensor and the fit are exact for a load that is linear between samples.
    for (found, truth) in [
        (found.sensitivity, truth.gain),
        (found.feedback_s, truth.amplifier_time),
        (found.lag_s, truth.silicone_time),
    ] {
        assert!((found / truth - 1.0).abs() < 1e-9, "{found} {truth}");
    }
}

/// Covariances with the least mean logarithm of the error, for both sensors and for each one alone,
/// over ensembles of another seed, in and outside of the claim. The errors of single sensors do not
/// enter those of both: making them worse would help.
#[test]
#[ignore = "a search, whose results are constants of this file"]
fn tune() {
    let calibration = calibrate();
    for (kind, whites) in [
        (Kind::F3, [1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11]),
        (Kind::F1, [1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8]),
    ] {
        let mut training = kind.ensemble(TUNING_SEED, 12, &CLAIM);
        for (_, ranges) in &ELSEWHERE {
            training.extend(kind.ensemble(TUNING_SEED, 3, ranges));
        }
        let resistive = [1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 1e-1];
        let electric = [1e-5, 1e-4, 1e-3, 3e-3, 1e-2];
        for (uses, resistive, electric) in [
            (Uses::Both, &resistive[2..], &electric[1..]),
            (Uses::Piezoresistive, &resistive[..], &electric[..1]),
            (Uses::Piezoelectric, &resistive[..1], &electric[..]),
        ] {
            let mut rows = Vec::new();
            for white in whites {
                for &resistive in resistive {
                    for &electric in electric {
                        let tuning = tuning(white, resistive, electric);
                        let settings = kind.settings(&calibration, &tuning);
                        let settings = restricted(&settings, uses);
                        let cost = |it: &(Draw, Samples)| libm::log(rmse(&settings, &it.1));
                        let mean = training.iter().map(cost).sum::<f64>() / training.len() as f64;
                        rows.push((libm::exp(mean), tuning));
                    }
                }
            }
            rows.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (error, tuning) in &rows[..5] {
                eprintln!("{uses:?} {error:.4} N: {tuning:?}");
            }
        }
    }
}

/// Draws beside the claim: biases that are shares of the greatest clean voltage of the draw, the
/// other reading of the thesis' "0.5 %"; a cell that has crept since its calibration; filters that
/// know that the load starts at rest.
#[test]
#[ignore = "a table"]
fn table() {
    let filters = Kind::F3.contest();
    let draws = || (0..100).map(|index| Draw::new(SEED, index, &CLAIM));
    let of_signal = |mut draw: Draw| {
        let clean = load(draw.shape, draw.peak, draw.hz, 1.0 / draw.hz);
        let volts = voltages(crept(0.0), &clean);
        let greatest = volts.iter().map(|it| it[1].abs()).fold(0.0, f64::max);
        draw.bias *= greatest / FULL_SCALE;
        (
            draw,
            simulate(&draw, RateSensor::ChargeAmplifier, 0.0, SEED),
        )
    };
    let ensemble: Vec<_> = draws().map(of_signal).collect();
    contest("bias of the signal", &filters, &ensemble);
    for crept_s in [10.0, 30.0, 60.0, 120.0] {
        let crept = |draw| {
            let samples = simulate(&draw, RateSensor::ChargeAmplifier, crept_s, SEED);
            (draw, samples)
        };
        let ensemble: Vec<_> = draws().map(crept).collect();
        contest(&format!("crept for {crept_s} s"), &filters, &ensemble);
    }
    let mut filters = filters;
    let single = filters.single.as_flattened_mut().iter_mut();
    for settings in single.chain([&mut filters.fused]) {
        // Deviations: 10 mN, 0.1 N/s, 1 N/s², 0.1 N/s, 10 mV; that of the bias remains.
        let variances = [1e-4, 1e-2, 1.0, 1e-2, 1e-4];
        for (state, variance) in settings.model.states_mut().iter_mut().zip(variances) {
            state.variance = variance;
        }
    }
    for (name, ranges) in [("known start", CLAIM), ("known start, low", ELSEWHERE[0].1)] {
        contest(name, &filters, &Kind::F3.ensemble(SEED, 100, &ranges));
    }
}
