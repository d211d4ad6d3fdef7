//! Fit of the characteristic with saturation, as in appendix B: points from the curves of the
//! sixteen cells, and `scipy.optimize`.

use std::path::Path;

use proptest::prelude::*;
use serde_json::{Value, json};
use twinrig_kernel::stream;
use twinrig_sensor::SensorError;
use twinrig_sensor::design::{CELLS, SaturatingFit, TestedCell, fit_saturating};
use twinrig_testing::python;

/// Points of a characterisation, and its greatest load over the saturation load; ASSUMED.
const POINTS: u32 = 30;
const REACH: f64 = 1.4;

/// Characteristic of a cell without noise.
fn conductance(cell: &TestedCell, load: f64) -> f64 {
    let saturated = cell.base + cell.sensitivity * cell.saturation;
    (cell.base + cell.sensitivity * load).clamp(0.0, saturated)
}

/// Points of a cell with a noise for which R² is the printed one on average, and its deviation.
fn points(cell: &TestedCell, seed: u64) -> (Vec<(f64, f64)>, f64) {
    let step = REACH * cell.saturation / f64::from(POINTS - 1);
    let loads: Vec<f64> = (0..POINTS).map(|n| step * f64::from(n)).collect();
    let exact: Vec<f64> = loads.iter().map(|&load| conductance(cell, load)).collect();
    let count = f64::from(POINTS);
    let mean = exact.iter().sum::<f64>() / count;
    let variance = exact
        .iter()
        .map(|it| (it - mean) * (it - mean))
        .sum::<f64>()
        / count;
    // Three parameters take their share of the noise out of the residuals.
    let deviation = ((1.0 - cell.r_squared) * variance * count / (count - 3.0)).sqrt();
    let mut random = stream(seed, &format!("appendix-b/{:?}", cell.coded));
    let points = loads.into_iter().zip(exact);
    (
        points
            .map(|(load, exact)| (load, exact + deviation * random.normal()))
            .collect(),
        deviation,
    )
}

/// Standard errors of a₁, a₂ and a₃ by the closed form of a line and of a mean.
fn standard_errors(cell: &TestedCell, points: &[(f64, f64)], deviation: f64) -> [f64; 3] {
    let onset = -cell.base / cell.sensitivity;
    let line = points.iter().map(|point| point.0);
    let line: Vec<f64> = line
        .filter(|load| (onset..=cell.saturation).contains(load))
        .collect();
    let saturated = points
        .iter()
        .filter(|point| point.0 > cell.saturation)
        .count();
    let count = line.len() as f64;
    let mean = line.iter().sum::<f64>() / count;
    let squares: f64 = line.iter().map(|load| (load - mean) * (load - mean)).sum();
    let slope = deviation / squares.sqrt();
    let base = deviation * (1.0 / count + mean * mean / squares).sqrt();
    [slope, base, deviation / (saturated as f64).sqrt()]
}

#[test]
fn parameters_of_the_sixteen_cells_are_recovered_within_their_standard_errors() {
    let (mut squares, mut lost, mut count) = ([0.0; 3], 0.0, 0.0);
    for cell in &CELLS {
        for seed in 0..10 {
            let (points, deviation) = points(cell, seed);
            let fit = fit_saturating(&points).unwrap();
            let saturated = cell.base + cell.sensitivity * cell.saturation;
            let errors = [
                fit.sensitivity - cell.sensitivity,
                fit.base - cell.base,
                fit.saturated - saturated,
            ];
            let deviations = standard_errors(cell, &points, deviation);
            for ((square, error), deviation) in squares.iter_mut().zip(errors).zip(deviations) {
                let ratio = error / deviation;
                // 4.5 deviations: a chance of 3 in 1000 in 480 normal numbers.
                assert!(ratio.abs() < 4.5, "{ratio} {cell:?}");
                *square += ratio * ratio;
            }
            lost += (1.0 - fit.r_squared) / (1.0 - cell.r_squared);
            count += 1.0;
        }
    }
    // Means of 160 squares: 1 ± 0.11. Points near a bend belong to both of its sides.
    for square in squares {
        assert!((0.7..1.4).contains(&(square / count)), "{squares:?}");
    }
    // As good as the printed fits: the mean of 160 χ²(27)/27 is 1 ± 0.02.
    assert!((lost / count - 1.0).abs() < 0.06, "{}", lost / count);
}

proptest! {
    /// Points of a characteristic are fitted exactly, in any order.
    #[test]
    fn exact_points_return_their_parameters(
        a1 in 0.1..10.0_f64,
        onset in -5.0..5.0_f64,
        rise in 2.0..10.0_f64,
        seed in any::<u64>(),
    ) {
        let end = onset.max(0.0) + rise;
        let value = |load: f64| a1 * (load.min(end) - onset).max(0.0);
        let mut random = stream(seed, "order");
        let mut points: Vec<(f64, f64)> = (0..40)
            .map(|n| 0.5 * f64::from(n))
            .map(|load| (load, value(load)))
            .collect();
        points.sort_by_cached_key(|_| random.bits());
        let fit = fit_saturating(&points).unwrap();
        prop_assert!((fit.sensitivity - a1).abs() < 1e-9 * a1);
        prop_assert!((fit.base + a1 * onset).abs() < 1e-9 * a1 * 10.0);
        prop_assert!((fit.saturation() - end).abs() < 1e-9 * 10.0);
    }

    /// No neighbouring parameters have a smaller sum of squares.
    #[test]
    fn fit_is_a_minimum(
        values in proptest::collection::vec(-0.3..0.3_f64, 20),
        moves in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0_f64), 50),
        scale in 1e-6..1.0_f64,
    ) {
        let loads = (0..20).map(f64::from);
        let points: Vec<(f64, f64)> = loads
            .zip(values)
            .map(|(load, noise)| (load, (0.1 * load - 0.4).clamp(0.0, 1.0) + noise))
            .collect();
        let fit = fit_saturating(&points).unwrap();
        let sum = |fit: &SaturatingFit| {
            let errors = points.iter().map(|point| point.1 - fit.conductance(point.0));
            errors.map(|error| error * error).sum::<f64>()
        };
        prop_assert!((sum(&fit) - fit.residual).abs() < 1e-12);
        for [one, two, three] in moves {
            let moved = SaturatingFit {
                sensitivity: fit.sensitivity + 0.1 * scale * one,
                base: fit.base + scale * two,
                saturated: fit.saturated + scale * three,
                ..fit
            };
            prop_assert!(sum(&moved) >= fit.residual - 1e-12);
        }
    }
}

#[test]
fn points_that_determine_no_characteristic_are_rejected() {
    let error = fit_saturating(&[(0.0, 0.0), (1.0, 1.0), (2.0, 1.0)]).unwrap_err();
    assert_eq!(error, SensorError::Points { found: 3 });
    let error = fit_saturating(&[(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 1.0)]);
    assert_eq!(error.unwrap_err(), SensorError::Points { found: 4 });
    let falling: Vec<_> = (0..9).map(|n| (f64::from(n), -f64::from(n))).collect();
    assert_eq!(fit_saturating(&falling).unwrap_err(), SensorError::NoRise);
}

#[test]
fn fits_are_no_worse_than_those_of_scipy() {
    let Some(python) = python::python_of_peers("scipy.optimize") else {
        return;
    };
    // In microsiemens, in which all parameters are of order 1 to 100.
    let cases: Vec<(Vec<(f64, f64)>, Value)> = CELLS
        .iter()
        .map(|cell| {
            let (points, _) = points(cell, 7);
            let points: Vec<(f64, f64)> = points.iter().map(|it| (it.0, 1e6 * it.1)).collect();
            let (loads, conductances): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
            let saturated = cell.base + cell.sensitivity * cell.saturation;
            let start = [cell.sensitivity, cell.base, saturated].map(|it| 1e6 * it);
            let case = json!({ "loads": loads, "conductances": conductances, "start": start });
            (points, case)
        })
        .collect();
    let input: Vec<&Value> = cases.iter().map(|case| &case.1).collect();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/saturating_fit.py");
    let answers = python::run(&python, &script, &[], &json!(input));
    let mut same = 0;
    for ((points, _), answer) in cases.iter().zip(answers.as_array().unwrap()) {
        let fit = fit_saturating(points).unwrap();
        let residual = answer["residual"].as_f64().unwrap();
        assert!(
            fit.residual <= residual * (1.0 + 1e-12),
            "{} {residual}",
            fit.residual
        );
        let ours = [fit.sensitivity, fit.base, fit.saturated];
        let theirs = answer["parameters"].as_array().unwrap().iter();
        let mut pairs = ours.into_iter().zip(theirs.map(|it| it.as_f64().unwrap()));
        // The peer's steps end at half the digits of the parameters.
        same += i32::from(pairs.all(|(ours, theirs)| (ours - theirs).abs() < 1e-6 * theirs.abs()));
    }
    // From the true parameters the peer finds another minimum only where noise has made one.
    assert!(same >= 12, "{same}");
}
