//! The cells: printed figures of the thesis, closed forms, and `scipy.signal`.

use std::f64::consts::TAU;
use std::path::Path;

use proptest::prelude::*;
use serde_json::json;
use twinrig_sensor::{
    Characteristic, Creep, Hysteretic, PiezoelectricCell, PiezoresistiveCell, ResistanceAmplifier,
    Saturating, SensorError, SensorFile, TactileParameters, TactileSensor,
};
use twinrig_testing::python;

fn parameters() -> TactileParameters {
    let file = SensorFile::find("tactile", Path::new("")).unwrap().unwrap();
    file.sensor().unwrap()
}

/// The sensor with a piezoelectric cell of these parameters, without rails.
fn sensor(gain: f64, amplifier_time: f64, silicone_time: f64) -> TactileSensor {
    let piezoelectric = PiezoelectricCell {
        gain,
        amplifier_time,
        silicone_time,
        rail: f64::INFINITY,
        offset: 0.0,
    };
    let parameters = TactileParameters {
        piezoelectric,
        ..parameters()
    };
    TactileSensor::new(parameters, 0.0).unwrap()
}

/// The foot cell of the thesis (section 4.2.3), under a load that changes slowly.
const FOOT: Characteristic = Characteristic::Saturating(Saturating {
    sensitivity: 1.01e-5,
    base: 4.14e-5,
    saturation: 31.5,
});

#[test]
fn amplifier_of_the_foot_cell_spans_its_printed_range() {
    let amplifier = parameters().amplifier;
    let volts = |force| amplifier.volts(FOOT.conductance(force, 0.0));
    // By eq. 4.2; the thesis prints 0.75 V and 4.7 V, which is the formula without its `1 +`.
    for (force, expected) in [(0.0, 1.03), (20.0, 4.81), (31.5, 6.99), (50.0, 6.99)] {
        assert!(
            (volts(force) - expected).abs() < 0.006,
            "{force} N: {} V",
            volts(force)
        );
    }
    let rail = ResistanceAmplifier {
        rail: 5.0,
        ..amplifier
    };
    assert_eq!(rail.volts(FOOT.conductance(31.5, 0.0)), 5.0);
}

#[test]
fn cell_with_a_negative_base_conducts_from_a_certain_load_on() {
    let cell = Characteristic::Saturating(Saturating {
        sensitivity: 3.4456e-6,
        base: -3.8753e-5,
        saturation: 25.433,
    });
    assert_eq!(cell.conductance(11.0, 0.0), 0.0);
    assert!(cell.conductance(11.5, 0.0) > 0.0);
}

#[test]
fn dynamic_response_saturates_near_10_newtons_with_a_loop_of_7_per_cent() {
    let cell = parameters().piezoresistive;
    let (rising, falling) = (1e3, -1e3);
    let at = |force, rate| cell.conductance(force, rate, 0.0);
    let range = at(28.0, rising) - at(0.0, rising);
    assert!((at(10.0, rising) - at(0.0, rising)) / range > 0.9);
    assert!((at(28.0, rising) - at(15.0, rising)) / range < 0.01);
    let loads = (0..=280).map(|n| 0.1 * f64::from(n));
    let widths = loads.map(|force| (at(force, falling) - at(force, rising)) / range);
    let widest = widths
        .inspect(|width| assert!(*width > 0.0))
        .fold(0.0, f64::max);
    assert!((0.05..=0.10).contains(&widest), "{widest}");
}

#[test]
fn creep_rises_to_its_share_with_its_time_constant() {
    let cell = PiezoresistiveCell {
        characteristic: FOOT,
        creep: Creep {
            share: 0.15,
            load: 14.0,
            time: 90.0,
        },
    };
    let parameters = TactileParameters {
        piezoresistive: cell,
        ..parameters()
    };
    let mut sensor = TactileSensor::new(parameters, 14.0).unwrap();
    let fresh = sensor.conductance();
    for second in 1..=200 {
        sensor.advance(1.0, 14.0);
        let expected = 0.15 * -libm::expm1(-f64::from(second) / 90.0);
        assert!((sensor.conductance() / fresh - 1.0 - expected).abs() < 1e-12);
    }
}

/// Coefficients of V = a Ḟ + b F̈ by least squares over a period of a sinusoidal load, in the
/// steady state.
fn regression(sensor: &mut TactileSensor, hertz: f64, step: f64) -> [f64; 2] {
    let omega = TAU * hertz;
    let (mut gram, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
    #[expect(clippy::cast_possible_truncation, reason = "thousands")]
    let (settling, period) = ((6.0 / step) as i32, (1.0 / (hertz * step)).round() as i32);
    for n in 1..=settling + period {
        let phase = omega * step * f64::from(n);
        sensor.advance(step, libm::sin(phase));
        if n > settling {
            let basis = [omega * libm::cos(phase), -omega * omega * libm::sin(phase)];
            for i in 0..2 {
                right[i] += basis[i] * sensor.piezoelectric_volts();
                for j in 0..2 {
                    gram[i][j] += basis[i] * basis[j];
                }
            }
        }
    }
    let determinant = gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0];
    [
        (right[0] * gram[1][1] - right[1] * gram[0][1]) / determinant,
        (right[1] * gram[0][0] - right[0] * gram[1][0]) / determinant,
    ]
}

/// Frequencies of the thesis' measurement \[Hz\].
const FREQUENCIES: [f64; 8] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0];

/// Share of the variance that A e^(−f/f₀) explains, fitted to the logarithms, and f₀ \[Hz\].
fn exponential(values: &[f64]) -> (f64, f64) {
    let logs: Vec<f64> = values.iter().map(|value| libm::log(value.abs())).collect();
    let count = logs.len() as f64;
    let mean = |of: &dyn Fn(usize) -> f64| (0..logs.len()).map(of).sum::<f64>() / count;
    let (f, log) = (mean(&|n| FREQUENCIES[n]), mean(&|n| logs[n]));
    let variance = mean(&|n| (FREQUENCIES[n] - f) * (FREQUENCIES[n] - f));
    let slope = mean(&|n| (FREQUENCIES[n] - f) * (logs[n] - log)) / variance;
    let at = |n: usize| libm::exp(log + slope * (FREQUENCIES[n] - f));
    let average = mean(&|n| values[n].abs());
    let square = |x: f64| x * x;
    let residual = mean(&|n| square(values[n].abs() - at(n)));
    let total = mean(&|n| square(values[n].abs() - average));
    (1.0 - residual / total, -1.0 / slope)
}

#[test]
fn coefficients_of_rate_and_acceleration_fall_exponentially_with_the_frequency() {
    let file = parameters().piezoelectric;
    let measured = FREQUENCIES.map(|hertz| {
        let mut sensor = sensor(file.gain, file.amplifier_time, file.silicone_time);
        regression(&mut sensor, hertz, 1e-3)
    });
    let rate = measured.map(|[a, _]| a);
    let acceleration = measured.map(|[_, b]| b);
    assert!(rate.iter().all(|a| *a > 0.0) && acceleration.iter().all(|b| *b < 0.0));
    // About −5e-3 V·s²/N at 0.5 Hz; both decay over 1.6 to 1.8 Hz.
    assert!((acceleration[0] + 4.8e-3).abs() < 1e-4, "{acceleration:?}");
    for (values, decay) in [(rate, 1.50), (acceleration, 1.78)] {
        let (determination, over) = exponential(&values);
        assert!(determination >= 0.99, "{determination}");
        assert!((over - decay).abs() < 0.02, "{over} Hz");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn coefficients_are_those_of_the_closed_form(
        gain in -0.2..0.2_f64,
        amplifier_time in 0.02..0.3_f64,
        silicone_time in 0.001..0.018_f64,
        hertz in 0.5..4.0_f64,
    ) {
        prop_assume!(gain.abs() > 1e-3);
        // A whole number of steps in a period.
        let hertz = 1.0 / ((1e4 / hertz).round() * 1e-4);
        let mut sensor = sensor(gain, amplifier_time, silicone_time);
        let cell = PiezoelectricCell { gain, amplifier_time, silicone_time, rail: 1.0, offset: 0.0 };
        let found = regression(&mut sensor, hertz, 1e-4);
        let expected = cell.coefficients(TAU * hertz);
        // The load is linear within a step: relative error (ω h)²/12, and its quadrature part
        // beside a coefficient that is small at this frequency.
        for (found, expected) in found.into_iter().zip(expected) {
            prop_assert!((found - expected).abs() < 1e-6 * gain.abs(), "{found} for {expected}");
        }
    }

    /// A ramp is exact at any division into steps.
    #[test]
    fn division_of_a_ramp_into_steps_has_no_effect(
        shares in proptest::collection::vec(0.01..1.0_f64, 1..20),
        slope in -1e3..1e3_f64,
    ) {
        let file = parameters().piezoelectric;
        let new = || sensor(file.gain, file.amplifier_time, file.silicone_time);
        let (mut whole, mut divided) = (new(), new());
        let total: f64 = shares.iter().sum();
        whole.advance(total * 1e-2, slope * total * 1e-2);
        let mut now = 0.0;
        for share in shares {
            now += share * 1e-2;
            divided.advance(share * 1e-2, slope * now);
        }
        let scale = 1.0 + slope.abs();
        let difference = whole.piezoelectric_volts() - divided.piezoelectric_volts();
        prop_assert!(difference.abs() < 1e-12 * scale);
        prop_assert!((whole.conductance() - divided.conductance()).abs() < 1e-15 * scale);
    }
}

#[test]
fn charge_amplifier_agrees_with_scipy() {
    let Some(python) = python::python_of_peers("scipy") else {
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/charge_amplifier.py");
    let cell = parameters().piezoelectric;
    let force = |n: i32| {
        let time = 1e-3 * f64::from(n);
        14.04 * (1.0 - libm::cos(TAU * 2.0 * time)) + 0.3 * libm::sin(TAU * 31.0 * time)
    };
    let forces: Vec<f64> = (0..2_000).map(force).collect();
    let case = json!({
        "gain": cell.gain, "amplifier_time": cell.amplifier_time,
        "silicone_time": cell.silicone_time, "period": 1e-3, "force": forces,
    });
    let answer = python::run(&python, &script, &[], &case);
    let volts = answer["volts"].as_array().unwrap();
    let mut sensor = sensor(cell.gain, cell.amplifier_time, cell.silicone_time);
    for (n, expected) in volts.iter().enumerate().skip(1) {
        sensor.advance(1e-3, forces[n]);
        let difference = sensor.piezoelectric_volts() - expected.as_f64().unwrap();
        // Rounding of the peer's matrix exponential over 2000 steps.
        assert!(difference.abs() < 1e-9, "{difference} V at {n} ms");
    }
}

#[test]
fn equal_time_constants_are_rejected() {
    let piezoelectric = PiezoelectricCell {
        silicone_time: 0.1,
        ..parameters().piezoelectric
    };
    let parameters = TactileParameters {
        piezoelectric,
        ..parameters()
    };
    let error = TactileSensor::new(parameters, 0.0).unwrap_err();
    assert!(matches!(error, SensorError::EqualTimes { .. }));
}

#[test]
fn constants_of_a_drawn_cell_are_within_the_spread_and_its_loop_keeps_its_sign() {
    let design = parameters();
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for number in 0..200 {
        let cell = design.drawn(0.1, number);
        assert_eq!(cell, design.drawn(0.1, number));
        let ratios = [
            cell.piezoelectric.gain / design.piezoelectric.gain,
            cell.piezoelectric.amplifier_time / design.piezoelectric.amplifier_time,
            cell.piezoelectric.silicone_time / design.piezoelectric.silicone_time,
            cell.amplifier.feedback / design.amplifier.feedback,
            cell.amplifier.reference / design.amplifier.reference,
            cell.piezoresistive.creep.share / design.piezoresistive.creep.share,
            cell.piezoresistive.creep.time / design.piezoresistive.creep.time,
        ];
        for ratio in ratios {
            assert!((ratio - 1.0).abs() <= 0.1, "{number}: {ratio}");
            (least, most) = (least.min(ratio), most.max(ratio));
        }
        let Characteristic::Hysteretic(Hysteretic {
            loading, unloading, ..
        }) = cell.piezoresistive.characteristic
        else {
            panic!("the sensor has hysteresis")
        };
        assert!(loading.mid > unloading.mid, "{number}");
    }
    // 1400 uniform numbers come within a hundredth of both ends.
    assert!(least < 0.901 && most > 1.099, "{least} {most}");
    assert_eq!(design.drawn(0.0, 3), design);
}
