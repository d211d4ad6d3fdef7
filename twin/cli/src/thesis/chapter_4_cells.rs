//! Chapter 4, first half: demands on a sensor, and the design of piezoresistive cells.

use std::collections::BTreeSet;

use twinrig_sensor::design::CellFactor::{Glue, Layer, Length, Shape, Width};
use twinrig_sensor::design::{
    CELLS, CellDesign, CellPrediction, CellResponse, Effect, Electrode, Elimination, PrintedModel,
    THRESHOLD,
};
use twinrig_sensor::{ResistanceAmplifier, SensorError};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::error::ThesisError;
use crate::thesis::item::{Item, Measurements, PrintedFigure};
use crate::thesis::verdict::Rule;

const ROUNDING: Rule = Rule::Within(5e-4);
const DIGITS: &str = "four printed digits";
const ABOUT: &str = "\"approximately\"";

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

const fn foot(
    key: &'static str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "4.2.3", value, unit)
        .rule(Rule::Within(5e-3), "three printed digits")
}

/// The text's dimensions of the foot.
const EXTRAPOLATED: &str = "by table 4.5 for type B, two layers, glue; 30 mm are beyond the tested \
                            widths, and the printed value is that of 20 mm × 25 mm";
const FOOT: &str = "by table 4.5 for type B, two layers, glue";

pub(super) const ITEMS: &[Item] = &[
    Item {
        id: "fig-4-4",
        title: "Characteristic of a cell",
        place: "4.2.2.1, figure 4.4",
        run_s: 0.1,
        figures: &[
            PrintedFigure::value(
                "r-squared",
                "R² of the fit of eq. 4.4",
                "figure 4.4",
                0.9994,
                "",
            )
            .rule(Rule::Within(1e-4), DIGITS)
            .remark("the same cell in appendix B, figure B.4"),
            PrintedFigure::value("points", "the same, fitted here", "figure 4.4", 0.9994, "")
                .remark("the measured points are not printed"),
        ],
        measure: fig_4_4,
        commands: &["twin cell fit"],
    },
    Item {
        id: "table-4-4",
        title: "Design of the experiment",
        place: "4.2.2.1, table 4.4",
        run_s: 0.1,
        figures: &[
            PrintedFigure::value(
                "runs",
                "characterised cells",
                "4.2.2.1, table 4.4",
                16.0,
                "",
            )
            .rule(Rule::Within(0.0), "a count"),
            PrintedFigure::value("made", "cells to be made", "table 4.4", 8.0, "")
                .rule(Rule::Within(0.0), "a count")
                .remark("combinations of the factors other than the number of layers"),
            PrintedFigure::value("order", "resolution of the design", "4.2.2.1", 4.0, "")
                .rule(Rule::Within(0.0), "a count")
                .remark("least order of an effect that is constant: Glue·Shape·Length·Width"),
            PrintedFigure::value(
                "effects",
                "effects that can be told apart",
                "4.2.2.3",
                12.0,
                "",
            )
            .rule(Rule::Within(0.0), "a count"),
            PrintedFigure::value(
                "least",
                "least resistance without load",
                "4.2.3",
                10.0,
                "kΩ",
            )
            .rule(Rule::AtLeast(10.0), "of all cells")
            .remark("of the greatest base conductance of table 4.4"),
            PrintedFigure::statement(
                "measured",
                "coefficients of the sixteen cells",
                "table 4.4, appendix B",
                "16 × 3 coefficients, R² 0.989 to 0.999",
                "",
            )
            .rule(Rule::NotReproducible, "")
            .remark("the measured points are not printed; no cell was made"),
        ],
        measure: table_4_4,
        commands: &["twin cell fit"],
    },
    Item {
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
        measure: table_4_5,
        commands: &["twin cell fit"],
    },
    Item {
        id: "sec-4-2-3",
        title: "Cell for the foot of the Cheetah-cub",
        place: "4.2.3",
        run_s: 0.1,
        figures: &[
            foot("a1-text", "sensitivity, 2 cm × 3 cm", 10.1, "µS/N").remark(EXTRAPOLATED),
            foot("a2-text", "base conductance, 2 cm × 3 cm", 41.4, "µS").remark(EXTRAPOLATED),
            foot("a3-text", "saturation load, 2 cm × 3 cm", 31.5, "N").remark(EXTRAPOLATED),
            foot("a1", "sensitivity, 20 mm × 25 mm", 10.1, "µS/N").remark(FOOT),
            foot("a2", "base conductance, 20 mm × 25 mm", 41.4, "µS").remark(FOOT),
            foot("a3", "saturation load, 20 mm × 25 mm", 31.5, "N").remark(FOOT),
            PrintedFigure::value(
                "unloaded-ohm",
                "resistance without load",
                "4.2.3",
                25.0,
                "kΩ",
            )
            .rule(Rule::Within(0.1), ABOUT),
            PrintedFigure::value(
                "loaded-ohm",
                "resistance at the greatest load",
                "4.2.3",
                5.0,
                "kΩ",
            )
            .rule(Rule::Within(0.1), ABOUT)
            .remark("at 15 N"),
            PrintedFigure::value("unloaded-volt", "output without load", "4.2.3", 0.75, "V")
                .rule(Rule::Within(0.1), ABOUT)
                .remark("the printed value is eq. 4.2 without its \"1 +\""),
            PrintedFigure::value(
                "loaded-volt",
                "output at the greatest load",
                "4.2.3",
                4.7,
                "V",
            )
            .rule(Rule::Within(0.1), ABOUT)
            .remark("at 20 N, the range of table 4.1; at 15 N it is 3.9 V"),
            PrintedFigure::value(
                "load",
                "1.4 times the weight of the body",
                "4.2.3",
                15.0,
                "N",
            )
            .rule(Rule::Within(0.05), ABOUT),
        ],
        measure: sec_4_2_3,
        commands: &[
            "twin cell predict --type B --layers 2 --glue yes --length 20mm --width 30mm",
            "twin cell predict --type B --layers 2 --glue yes --length 20mm --width 25mm",
        ],
    },
];

fn fig_4_4(_: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let shown = CellDesign {
        electrode: Electrode::A,
        layers: 2,
        glue: true,
        length: 8e-3,
        width: 29e-3,
    };
    let cell = CELLS.iter().find(|cell| cell.design() == shown);
    if let Some(cell) = cell {
        found.set("r-squared", cell.r_squared);
    }
    Ok(found)
}

fn table_4_4(_: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let mut made = BTreeSet::new();
    for cell in &CELLS {
        let [glue, _, shape, length, width] = cell.coded.map(|level| level > 0.0);
        made.insert([glue, shape, length, width]);
    }
    found.set("runs", CELLS.len() as f64);
    found.set("made", made.len() as f64);
    let constant = Effect::CONSTANT.aliases().into_iter();
    if let Some(order) = constant.map(|(effect, _)| effect.order()).min() {
        found.set("order", f64::from(order));
    }
    found.set("effects", Effect::estimable().len() as f64);
    let greatest = CELLS.iter().map(|cell| cell.base).fold(0.0, f64::max);
    found.set("least", 1e-3 / greatest);
    Ok(found)
}

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

fn table_4_5(_: &Context<'_>) -> Result<Measurements, TwinError> {
    Ok(refitted().map_err(ThesisError::from)?)
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

/// Circuit of section 4.2.3.
const AMPLIFIER: ResistanceAmplifier = ResistanceAmplifier {
    feedback: 75e3,
    reference: 0.25,
    rail: f64::INFINITY,
};
/// Load of a leg (4.2.3), and range of the sensor (table 4.1) \[N\].
const LOAD: f64 = 15.0;
const RANGE: f64 = 20.0;

fn sec_4_2_3(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let of = |width| {
        CellPrediction::of(&CellDesign {
            electrode: Electrode::B,
            layers: 2,
            glue: true,
            length: 20e-3,
            width,
        })
    };
    let text = of(30e-3).map_err(ThesisError::from)?;
    let cell = of(25e-3).map_err(ThesisError::from)?;
    for (keys, of) in [
        (["a1-text", "a2-text", "a3-text"], &text),
        (["a1", "a2", "a3"], &cell),
    ] {
        found.set(keys[0], 1e6 * of.sensitivity.value);
        found.set(keys[1], 1e6 * of.base.value);
        found.set(keys[2], of.saturation.value);
    }
    let kilohm = |load| 1e-3 / cell.characteristic().conductance(load, 0.0);
    found.set("unloaded-ohm", kilohm(0.0));
    found.set("loaded-ohm", kilohm(LOAD));
    found.set("unloaded-volt", cell.volts(&AMPLIFIER, 0.0).value);
    found.set("loaded-volt", cell.volts(&AMPLIFIER, RANGE).value);
    if let Some(robot) = context.assembly("trot.toml")?.robot() {
        found.set("load", 1.4 * robot.weight());
    }
    Ok(found)
}
