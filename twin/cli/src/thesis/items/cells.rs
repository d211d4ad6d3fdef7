//! Design of piezoresistive cells (section 4.2).

use std::collections::BTreeSet;

use twinrig_sensor::ResistanceAmplifier;
use twinrig_sensor::design::{CELLS, CellDesign, CellPrediction, Effect, Electrode};

use crate::error::ThesisError;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

const ABOUT: &str = "\"approximately\"";

/// The text's dimensions of the foot.
const EXTRAPOLATED: &str = "by table 4.5 for type B, two layers, glue; 30 mm are beyond the tested \
                            widths, and the printed value is that of 20 mm × 25 mm";

const FOOT: &str = "by table 4.5 for type B, two layers, glue";

const fn foot(
    key: &'static str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
) -> PrintedFigure {
    PrintedFigure::value(key, quantity, "4.2.3", value, unit)
        .rule(Rule::Within(5e-3), "three printed digits")
}

pub(crate) const FIG_4_4: Item = Item {
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
        .rule(Rule::Within(1e-4), "its digits")
        .remark("the same cell in appendix B, figure B.4"),
        PrintedFigure::value("points", "the same, fitted here", "figure 4.4", 0.9994, "")
            .remark("the measured points are not printed"),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed numbers")],
    )],
    measure: |_| Ok(fig_4_4()),
    commands: &["twin cell fit"],
};

pub(crate) const TABLE_4_4: Item = Item {
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
            "48 coefficients",
            "",
        )
        .rule(Rule::NotRun, "")
        .remark("the measured points are not printed, but their R² of 0.989 to 0.999"),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed numbers")],
    )],
    measure: |_| Ok(table_4_4()),
    commands: &["twin cell fit"],
};

pub(crate) const SEC_4_2_3: Item = Item {
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
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed numbers")],
    )],
    measure: |_| Ok(sec_4_2_3()?),
    commands: &[
        "twin cell predict --type B --layers 2 --glue yes --length 20mm --width 30mm",
        "twin cell predict --type B --layers 2 --glue yes --length 20mm --width 25mm",
    ],
};

fn fig_4_4() -> Measurements {
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
    found
}

fn table_4_4() -> Measurements {
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
    found
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

fn sec_4_2_3() -> Result<Measurements, ThesisError> {
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
    let text = of(30e-3)?;
    let cell = of(25e-3)?;
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
    Ok(found)
}
