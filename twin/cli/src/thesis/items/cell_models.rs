//! Additive models of piezoresistive cells (table 4.5).

use twinrig_sensor::SensorError;
use twinrig_sensor::design::CellFactor::{Glue, Layer, Length, Shape, Width};
use twinrig_sensor::design::{CellResponse, Effect, Elimination, PrintedModel, THRESHOLD};

use crate::error::ThesisError;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

const ROUNDING: Rule = Rule::Within(5e-4);

const DIGITS: &str = "four printed digits";

const fn coefficient(
    key: &'static str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "table 4.5", value, unit).rule(ROUNDING, DIGITS)
}

const fn kept(key: &'static str, quantity: &'static str, effects: f64) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "4.2.2.3, table 4.5", effects, "")
        .rule(Rule::Within(0.0), "a count")
}

const fn model(key: &'static str, quantity: &'static str, p: f64) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "table 4.5", p, "").rule(Rule::Within(1e-3), "its digits")
}

pub(crate) const TABLE_4_5: Item = Item {
    id: "table-4-5",
    title: "Additive models of the cells",
    place: "4.2.2.3, table 4.5",
    run_s: 0.1,
    figures: &[
        coefficient("a1", "sensitivity, constant", 5.785, "µS/N"),
        coefficient("a1-glue", "sensitivity, glue", -1.690, "µS/N"),
        coefficient("a1-shape", "sensitivity, shape", 3.698, "µS/N"),
        coefficient("a1-width", "sensitivity, width", 2.992, "µS/N"),
        coefficient("a1-glue-length", "sensitivity, glue·length", 2.330, "µS/N")
            .remark("the design cannot distinguish it from shape·width"),
        model("a1-p", "sensitivity, p-value of the model", 7.85e-6),
        coefficient("a2", "base conductance, constant", 17.69, "µS"),
        coefficient("a2-shape", "base conductance, shape", 17.51, "µS"),
        coefficient("a2-width", "base conductance, width", 10.80, "µS"),
        coefficient(
            "a2-length-width",
            "base conductance, length·width",
            -10.56,
            "µS",
        ),
        model("a2-p", "base conductance, p-value of the model", 0.00719),
        coefficient("a3", "saturation load, constant", 29.00, "N"),
        coefficient("a3-layer", "saturation load, layer", 6.799, "N"),
        coefficient("a3-shape", "saturation load, shape", 10.13, "N"),
        coefficient(
            "a3-length-width",
            "saturation load, length·width",
            -8.621,
            "N",
        ),
        model("a3-p", "saturation load, p-value of the model", 0.0174),
        PrintedFigure::statement(
            "rest",
            "other figures: greatest relative deviation",
            "table 4.5",
            "sums of squares, F and p-values",
            "",
        )
        .rule(Rule::AtMost(1e-3), "three to four printed digits"),
        kept("a1-kept", "sensitivity: effects with p < 10 %", 4.0)
            .remark("length (p = 0.064) and layer·length (0.086) remain as well"),
        kept("a2-kept", "base conductance: effects with p < 10 %", 3.0),
        kept("a3-kept", "saturation load: effects with p < 10 %", 3.0)
            .remark("layer, p = 0.1023, is kept on purpose (4.2.3)"),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed numbers")],
    )],
    measure: |_| Ok(refitted().map_err(ThesisError::from)?),
    commands: &["twin cell fit"],
};

/// Effects of the models with the keys of their coefficients.
const EFFECTS: [(&str, CellResponse, Effect); 10] = [
    ("a1-glue", CellResponse::Sensitivity, Effect::main(Glue)),
    ("a1-shape", CellResponse::Sensitivity, Effect::main(Shape)),
    ("a1-width", CellResponse::Sensitivity, Effect::main(Width)),
    (
        "a1-glue-length",
        CellResponse::Sensitivity,
        Effect::interaction(Glue, Length),
    ),
    ("a2-shape", CellResponse::Base, Effect::main(Shape)),
    ("a2-width", CellResponse::Base, Effect::main(Width)),
    (
        "a2-length-width",
        CellResponse::Base,
        Effect::interaction(Length, Width),
    ),
    ("a3-layer", CellResponse::Saturation, Effect::main(Layer)),
    ("a3-shape", CellResponse::Saturation, Effect::main(Shape)),
    (
        "a3-length-width",
        CellResponse::Saturation,
        Effect::interaction(Length, Width),
    ),
];

/// Keys of constant, p-value and number of effects of a response, and the factor to its unit.
fn keys(response: CellResponse) -> ([&'static str; 3], f64) {
    match response {
        CellResponse::Sensitivity => (["a1", "a1-p", "a1-kept"], 1e6),
        CellResponse::Base => (["a2", "a2-p", "a2-kept"], 1e6),
        CellResponse::Saturation => (["a3", "a3-p", "a3-kept"], 1.0),
    }
}

fn refitted() -> Result<Measurements, SensorError> {
    let mut found = Measurements::default();
    let mut rest: f64 = 0.0;
    for response in CellResponse::ALL {
        let printed = PrintedModel::of(response);
        let ours = printed.refit()?;
        let ([constant, p, kept], scale) = keys(response);
        found.set(constant, scale * ours.constant);
        found.set(p, ours.p);
        for row in &ours.effects {
            let is_it = |of: &&(&str, CellResponse, Effect)| (of.1, of.2) == (response, row.effect);
            if let Some((key, ..)) = EFFECTS.iter().find(is_it) {
                found.set(key, scale * row.coefficient);
            }
        }
        let mut pairs = vec![
            (ours.residual, printed.residual),
            (ours.variance(), printed.variance),
        ];
        for (row, known) in ours.effects.iter().zip(printed.effects) {
            pairs.push((row.sum_of_squares, known.sum_of_squares));
            pairs.extend([(row.f, known.f), (row.p, known.p)]);
        }
        let deviations = pairs
            .iter()
            .map(|(ours, printed)| (ours / printed - 1.0).abs());
        rest = deviations.fold(rest, f64::max);
        let elimination = Elimination::of(response, THRESHOLD)?;
        found.set(kept, elimination.model.effects.len() as f64);
    }
    found.set("rest", rest);
    Ok(found)
}
