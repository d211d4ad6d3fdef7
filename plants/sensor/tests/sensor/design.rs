//! Design of cells: printed tables, statsmodels, and properties of the design.

use std::path::Path;

use proptest::prelude::*;
use serde_json::{Value, json};
use twinrig_sensor::design::{
    Anova, CELLS, CellDesign, CellFactor, CellPrediction, CellResponse, Departure, Effect,
    Electrode, Elimination, LinearModel, PRINTED_MODELS, THRESHOLD, TestedCell,
};
use twinrig_sensor::{Characteristic, ResistanceAmplifier, Saturating, SensorError};
use twinrig_testing::python;

use CellFactor::{Glue, Layer, Length, Shape, Width};

const FOOT: CellDesign = CellDesign {
    electrode: Electrode::B,
    layers: 2,
    glue: true,
    length: 20e-3,
    width: 25e-3,
};

const AMPLIFIER: ResistanceAmplifier = ResistanceAmplifier {
    feedback: 75e3,
    reference: 0.25,
    rail: f64::INFINITY,
};

/// Half a unit of the last of `digits` significant digits.
fn rounding(value: f64, digits: i32) -> f64 {
    let exponent = format!("{value:e}");
    let exponent: i32 = exponent.split_once('e').unwrap().1.parse().unwrap();
    0.5 * libm::pow(10.0, f64::from(exponent - digits + 1))
}

fn close(ours: f64, printed: f64, relative: f64) -> bool {
    (ours - printed).abs() <= relative * printed.abs()
}

#[test]
fn printed_models_follow_from_the_printed_cells() {
    for printed in &PRINTED_MODELS {
        let model = printed.refit().unwrap();
        let values = printed.response.values();
        // A coefficient is a mean of the responses with signs, each rounded to five digits.
        let of_cells = values.map(|value| rounding(value, 5)).iter().sum::<f64>() / 16.0;
        let coefficients = model.effects.iter().zip(printed.effects);
        let coefficients = coefficients.map(|(ours, row)| (ours.coefficient, row.coefficient));
        for (ours, row) in coefficients.chain([(model.constant, printed.constant)]) {
            assert!(close(ours, row, 5e-4), "{ours} {row}");
            assert!(
                (ours - row).abs() <= of_cells + rounding(row, 4),
                "{ours} {row}"
            );
        }
        for (ours, row) in model.effects.iter().zip(printed.effects) {
            assert!(close(ours.sum_of_squares, row.sum_of_squares, 1e-3));
            assert!(close(ours.f, row.f, 1e-3), "{} {}", ours.f, row.f);
            assert!(close(ours.p, row.p, 1e-3), "{} {}", ours.p, row.p);
        }
        assert_eq!(model.freedom, printed.freedom);
        assert!(close(model.residual, printed.residual, 1e-3));
        assert!(close(model.variance(), printed.variance, 1e-3));
        assert!(close(model.p, printed.p, 1e-3));
    }
}

#[test]
fn rows_of_the_cells_are_the_generated_design() {
    for cell in &CELLS {
        let [glue, layer, shape, length, width] = cell.coded;
        // E = ABC and F = BCD with A glue, B layer, C temperature, D shape: the temperature that
        // gives the length gives the width.
        let temperature = length * glue * layer;
        assert_eq!(width, layer * temperature * shape);
        assert_eq!(cell.design().coded(), cell.coded);
        assert!(cell.design().departures().is_empty());
    }
    let count = |of: &dyn Fn(&TestedCell) -> [f64; 5]| {
        let mut all: Vec<String> = CELLS.iter().map(|cell| format!("{:?}", of(cell))).collect();
        all.sort();
        all.dedup();
        all.len()
    };
    assert_eq!(count(&|cell| cell.coded), 16);
    let without_layers = |cell: &TestedCell| {
        let mut coded = cell.coded;
        coded[Layer as usize] = 0.0;
        coded
    };
    assert_eq!(count(&without_layers), 8);
}

#[test]
fn aliases_follow_from_the_defining_relation() {
    let words = |effect: Effect| {
        let aliases = effect.aliases();
        let words: Vec<String> = aliases.iter().map(|it| it.0.to_string()).collect();
        assert!(aliases.iter().all(|(_, sign)| *sign == 1.0));
        words
    };
    assert_eq!(words(Effect::CONSTANT), ["Glue·Shape·Length·Width"]);
    assert_eq!(words(Effect::interaction(Length, Width)), ["Glue·Shape"]);
    assert_eq!(words(Effect::interaction(Glue, Length)), ["Shape·Width"]);
    assert_eq!(words(Effect::interaction(Glue, Width)), ["Shape·Length"]);
    for factor in CellFactor::ALL {
        // Resolution IV: no main effect is aliased with one of less than three factors.
        assert!(Effect::main(factor).aliases()[0].0.order() >= 3);
    }
    let estimable = Effect::estimable();
    assert_eq!(estimable.len(), 12);
    let both = [
        Effect::interaction(Length, Width),
        Effect::interaction(Glue, Shape),
    ];
    let error = LinearModel::fit(&CellResponse::Base.values(), &both).unwrap_err();
    assert!(matches!(error, SensorError::Aliased { .. }));
}

#[test]
fn residuals_of_a_cell_with_two_and_six_layers_are_not_positively_correlated() {
    for printed in &PRINTED_MODELS {
        let model = printed.refit().unwrap();
        let cells = CELLS.iter().zip(printed.response.values());
        let residuals = cells.map(|(cell, value)| {
            let effects = model.effects.iter();
            let terms = effects.map(|row| row.coefficient * row.effect.value(&cell.coded));
            (cell.coded, value - model.constant - terms.sum::<f64>())
        });
        let residuals: Vec<([f64; 5], f64)> = residuals.collect();
        let other = |coded: [f64; 5]| {
            let mut other = coded;
            other[Layer as usize] *= -1.0;
            residuals.iter().find(|row| row.0 == other).unwrap().1
        };
        let products = residuals.iter().map(|row| row.1 * other(row.0));
        assert!(products.sum::<f64>() < 0.0);
    }
}

#[test]
fn elimination_at_ten_per_cent_confirms_one_of_three_printed_models() {
    let kept = |response| {
        let model = Elimination::of(response, THRESHOLD).unwrap().model;
        let effects = model.effects.iter().map(|row| row.effect.to_string());
        effects.collect::<Vec<_>>()
    };
    assert_eq!(kept(CellResponse::Base), ["Shape", "Width", "Length·Width"]);
    assert_eq!(kept(CellResponse::Saturation), ["Shape", "Length·Width"]);
    assert_eq!(
        kept(CellResponse::Sensitivity),
        [
            "Glue",
            "Shape",
            "Length",
            "Width",
            "Glue·Length",
            "Layer·Length"
        ]
    );
}

#[test]
fn foot_cell_has_the_printed_parameters_at_20_by_25_millimetres_only() {
    let of = |length, width| {
        let design = CellDesign {
            length,
            width,
            ..FOOT
        };
        let found = CellPrediction::of(&design).unwrap();
        let values = [
            found.sensitivity.value,
            found.base.value,
            found.saturation.value,
        ];
        let printed = [1.01e-5, 4.14e-5, 31.5];
        let same = values.iter().zip(printed);
        let same = same.map(|(ours, printed)| (ours - printed).abs() <= rounding(printed, 3));
        (same.fold(true, |all, one| all & one), found.departures)
    };
    let (same, departures) = of(20e-3, 25e-3);
    assert!(same);
    assert!(
        matches!(departures[..], [Departure::Strips { .. }]),
        "{departures:?}"
    );
    for (length, width) in [(20e-3, 30e-3), (30e-3, 20e-3)] {
        let (same, departures) = of(length, width);
        assert!(!same);
        assert!(matches!(departures[0], Departure::Outside { .. }));
    }
}

#[test]
fn widths_of_whole_strips_can_be_made() {
    for strips in 2..=10 {
        let width = 3e-3 * f64::from(strips) - 1e-3;
        let design = CellDesign { width, ..FOOT };
        assert!(design.departures().is_empty(), "{width}");
        let design = CellDesign {
            width: width + 1e-3,
            ..FOOT
        };
        assert!(!design.departures().is_empty(), "{width}");
    }
}

#[test]
fn impossible_cells_are_rejected() {
    for design in [
        CellDesign { layers: 0, ..FOOT },
        CellDesign {
            length: 0.0,
            ..FOOT
        },
        CellDesign {
            width: -1e-3,
            ..FOOT
        },
        CellDesign {
            width: f64::NAN,
            ..FOOT
        },
    ] {
        let error = CellPrediction::of(&design).unwrap_err();
        assert!(matches!(error, SensorError::Dimension { .. }), "{error}");
    }
}

fn effects() -> impl Strategy<Value = Vec<Effect>> {
    proptest::sample::subsequence(Effect::estimable(), 0..=12)
}

proptest! {
    /// Least squares leaves residuals that are orthogonal to every column, and squares that add up.
    #[test]
    fn residuals_are_orthogonal_to_effects(
        values in proptest::array::uniform16(-1.0..1.0_f64),
        effects in effects(),
    ) {
        let model = LinearModel::fit(&values, &effects).unwrap();
        let fitted = |cell: &TestedCell| {
            let terms = model.effects.iter().map(|row| row.coefficient * row.effect.value(&cell.coded));
            model.constant + terms.sum::<f64>()
        };
        let residuals: Vec<f64> = CELLS.iter().zip(values).map(|(cell, y)| y - fitted(cell)).collect();
        for effect in effects.iter().chain(&[Effect::CONSTANT]) {
            let products = CELLS.iter().zip(&residuals).map(|(cell, e)| e * effect.value(&cell.coded));
            prop_assert!(products.sum::<f64>().abs() < 1e-13);
        }
        let squares: f64 = values.iter().map(|y| y * y).sum();
        let explained: f64 = model.effects.iter().map(|row| row.sum_of_squares).sum();
        let sum = 16.0 * model.constant * model.constant + explained + model.residual;
        prop_assert!((sum - squares).abs() < 1e-13 * squares.max(1.0));
    }

    /// An output interval contains the outputs at the ends of each parameter's own interval.
    #[test]
    fn amplifier_interval_contains_that_of_each_parameter(
        layers in 1..8_u32,
        glue in any::<bool>(),
        b in any::<bool>(),
        length in 5e-3..40e-3_f64,
        width in 5e-3..40e-3_f64,
        load in 0.0..60.0_f64,
    ) {
        let electrode = if b { Electrode::B } else { Electrode::A };
        let design = CellDesign { electrode, layers, glue, length, width };
        let found = CellPrediction::of(&design).unwrap();
        let output = found.volts(&AMPLIFIER, load);
        prop_assert!(output.low >= 0.25 && output.low <= output.value && output.value <= output.high);
        for (a1, a2, end) in [
            (found.sensitivity.high, found.base.value, found.saturation.value),
            (found.sensitivity.value, found.base.high, found.saturation.value),
            (found.sensitivity.value, found.base.low, found.saturation.value),
            (found.sensitivity.value, found.base.value, found.saturation.high),
        ] {
            let cell = Characteristic::Saturating(Saturating {
                sensitivity: a1.max(0.0), base: a2, saturation: end.max(0.0),
            });
            let volts = AMPLIFIER.volts(cell.conductance(load, 0.0));
            prop_assert!(load == 0.0 || (output.low <= volts && volts <= output.high));
        }
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|it| it.as_f64().unwrap()).collect()
}

fn script(python: &Path, name: &str, input: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    python::run(python, &script.join(name), &[], input)
}

/// Columns of the factors of an effect.
fn indices(effect: Effect) -> Vec<usize> {
    effect.factors().map(|factor| factor as usize).collect()
}

/// Pivoted and iterated decompositions of the peer leave more rounding than contrasts do.
const PEER: f64 = 1e-9;

/// Effect with these columns of factors.
fn effect(columns: &Value) -> Effect {
    let columns = columns.as_array().unwrap().iter();
    let factor =
        |column: &Value| CellFactor::ALL[usize::try_from(column.as_u64().unwrap()).unwrap()];
    match columns.map(factor).collect::<Vec<_>>()[..] {
        [one, other] => Effect::interaction(one, other),
        [one] => Effect::main(one),
        _ => panic!("the peer has effects of one or two factors"),
    }
}

/// Figures of a model, and those of the peer.
fn figures(model: &LinearModel, coded: &[[f64; 5]], peer: &Value) -> Vec<(f64, f64)> {
    let whole = |key: &str| peer[key].as_f64().unwrap();
    let mut pairs = vec![
        (model.constant, whole("constant")),
        (model.residual, whole("residual")),
        (model.f, whole("f")),
        (model.p, whole("p")),
        (model.r_squared, whole("r_squared")),
    ];
    for (ours, theirs) in model.effects.iter().zip(peer["rows"].as_array().unwrap()) {
        let ours = [ours.coefficient, ours.sum_of_squares, ours.f, ours.p];
        pairs.extend(ours.into_iter().zip(numbers(theirs)));
    }
    let intervals = peer["intervals"].as_array().unwrap();
    for (coded, theirs) in coded.iter().zip(intervals) {
        let found = model.predict(coded, 0.95);
        let ours = [found.value, found.low, found.high];
        pairs.extend(ours.into_iter().zip(numbers(theirs)));
    }
    pairs
}

#[test]
fn models_intervals_and_elimination_agree_with_statsmodels() {
    let Some(python) = python::python_of_peers("statsmodels.api") else {
        return;
    };
    let large = CellDesign {
        layers: 4,
        width: 40e-3,
        ..FOOT
    };
    let coded = [FOOT, CELLS[3].design(), large].map(|design| design.coded());
    let responses = PRINTED_MODELS.map(|printed| {
        let effects = printed.effects.iter().map(|row| indices(row.effect));
        json!({
            "values": printed.response.values(), "effects": effects.collect::<Vec<_>>(),
            "coded": coded, "threshold": THRESHOLD,
        })
    });
    let cells = CELLS.map(|cell| cell.coded);
    let case = json!({ "cells": cells, "responses": responses });
    let peer = script(&python, "regression.py", &case);
    for (n, printed) in PRINTED_MODELS.iter().enumerate() {
        let model = printed.refit().unwrap();
        for (ours, theirs) in figures(&model, &coded, &peer[n]) {
            assert!(close(ours, theirs, PEER), "{ours} {theirs}");
        }
        let ours = Elimination::of(printed.response, THRESHOLD).unwrap().model;
        let kept = peer[n]["kept"]["effects"].as_array().unwrap();
        assert_eq!(kept.len(), ours.effects.len());
        for (columns, p) in kept.iter().zip(numbers(&peer[n]["kept"]["p"])) {
            // The peer names the first of two aliased interactions.
            let same = |row: &&Anova| row.effect.is_aliased_with(effect(columns));
            let ours = ours.effects.iter().find(same).unwrap();
            assert!(close(ours.p, p, PEER), "{} {p}", ours.p);
        }
    }
    // The output of the foot cell at 20 N, by eq. 4.2 from the ends of the joint intervals.
    let end = |response: usize, end: usize| peer[response]["joint"][0][end].as_f64().unwrap();
    let volts = |n| {
        let load = 20.0_f64.min(end(2, n).max(0.0));
        let conductance = end(1, n) + end(0, n).max(0.0) * load;
        (1.0 + 75e3 * conductance.max(0.0)) * 0.25
    };
    let output = CellPrediction::of(&FOOT).unwrap().volts(&AMPLIFIER, 20.0);
    assert!(close(output.low, volts(0), PEER) && close(output.high, volts(1), PEER));
}
