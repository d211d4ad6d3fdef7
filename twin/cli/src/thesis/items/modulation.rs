//! Displacement of footsteps after a change of the step length (figures 3.5 and 3.8).

use twinrig_study::{Counting, ModelForm, ModulationStudy};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

/// Keys of the figures of all gaits, counted in one way.
struct Keys {
    /// Mean over the gaits of the first footstep's displacement by the least change.
    first: &'static str,
    /// Number of gaits in which it is forwards.
    forwards: &'static str,
    /// Number of gaits with a mean displacement against a change.
    erratic: &'static str,
    /// R² of the linear model, mean over the gaits.
    linear: &'static str,
}

const BY_CYCLE: Keys = Keys {
    first: "first, by cycle",
    forwards: "forwards, by cycle",
    erratic: "erratic, by cycle",
    linear: "linear, by cycle",
};
const BY_TOUCH_DOWN: Keys = Keys {
    first: "first, by touch-down",
    forwards: "forwards, by touch-down",
    erratic: "erratic, by touch-down",
    linear: "linear, by touch-down",
};

const CYCLE: &str = "one footstep for each leg and cycle";
const TOUCH_DOWN: &str = "bounces included; the thesis does not print how it counts";

const FIRST_GROUND: &str = "the mean over ten points of the cycle, all legs and five gaits";
const FORWARDS_GROUND: &str = "of five gaits; the thesis shows one";
const ERRATIC_GROUND: &str = "of five gaits; a mean displacement of more than 0.5 mm, a fifth of the least change, against \
     a reduction";
const LINEAR_GROUND: &str = "of (k n + k₀) Δ over all changes Δ and footsteps n; mean of five gaits; the bound is ours, as \
     no R² is printed";
/// Coefficient of determination of a linear relation.
const LINEAR: f64 = 0.9;
/// Most of five.
const MOST: f64 = 3.0;

const SEARCHED: Input = Input::Fitted("five gaits, by searches for speed and evenness");
const FOOTSTEPS: Input = Input::Free("footsteps");

/// Figures of an open loop, as the thesis describes them.
const fn erratic(keys: &Keys, remark: &'static str) -> [PrintedFigure; 4] {
    let place = "figure 3.5";
    [
        PrintedFigure::statement(
            keys.first,
            "first footstep after a reduction by 2.5 mm",
            place,
            "moves forwards",
            "mm",
        )
        .rule(Rule::AtLeast(0.0), FIRST_GROUND)
        .remark(remark),
        PrintedFigure::statement(
            keys.forwards,
            "number of gaits with a first footstep forwards",
            place,
            "moves forwards",
            "",
        )
        .rule(Rule::AtLeast(MOST), FORWARDS_GROUND)
        .remark(remark),
        PrintedFigure::statement(
            keys.erratic,
            "number of erratic gaits",
            "3.4",
            "erratic",
            "",
        )
        .rule(Rule::AtLeast(MOST), ERRATIC_GROUND)
        .remark(remark),
        PrintedFigure::statement(
            keys.linear,
            "coefficient of determination R²",
            "3.4",
            "erratic",
            "",
        )
        .rule(Rule::AtMost(LINEAR), LINEAR_GROUND)
        .remark(remark),
    ]
}

/// Figures with feedback, as the thesis describes them.
const fn regular(keys: &Keys, remark: &'static str) -> [PrintedFigure; 4] {
    let place = "3.3.3";
    [
        PrintedFigure::statement(
            keys.first,
            "first footstep after a reduction by 2.5 mm",
            place,
            "moves backwards",
            "mm",
        )
        .rule(Rule::AtMost(0.0), FIRST_GROUND)
        .remark(remark),
        PrintedFigure::statement(
            keys.forwards,
            "number of gaits with a first footstep forwards",
            place,
            "moves backwards",
            "",
        )
        .rule(Rule::AtMost(0.0), FORWARDS_GROUND)
        .remark(remark),
        PrintedFigure::statement(
            keys.erratic,
            "number of erratic gaits",
            place,
            "regular",
            "",
        )
        .rule(Rule::AtMost(0.0), ERRATIC_GROUND)
        .remark(remark),
        PrintedFigure::statement(
            keys.linear,
            "coefficient of determination R²",
            place,
            "linear in change and steps",
            "",
        )
        .rule(Rule::AtLeast(LINEAR), LINEAR_GROUND)
        .remark(remark),
    ]
}

/// Returns the figures of both ways of counting.
const fn both(cycle: &[PrintedFigure; 4], touch_down: &[PrintedFigure; 4]) -> [PrintedFigure; 8] {
    let [a, b, c, d] = *cycle;
    let [e, f, g, h] = *touch_down;
    [a, b, c, d, e, f, g, h]
}

pub(crate) const FIG_3_5: Item = Item {
    id: "fig-3-5",
    title: "Shorter steps in open loop",
    place: "figure 3.5, section 3.2.5",
    run_s: 30.0,
    figures: &both(
        &erratic(&BY_CYCLE, CYCLE),
        &erratic(&BY_TOUCH_DOWN, TOUCH_DOWN),
    ),
    sources: &[Source::rest(
        Basis::Substitute,
        &[
            Input::Set("step length, stance curve and duty map as printed"),
            SEARCHED,
            FOOTSTEPS,
        ],
    )],
    measure: open_loop,
    commands: &[
        "twin optimize scenarios/thesis/fig-3-5.toml \
         --space scenarios/optimizations/fig-3-5.toml --seed 1",
        "twin run scenarios/thesis/fig-3-5.toml",
    ],
};

pub(crate) const FIG_3_8: Item = Item {
    id: "fig-3-8",
    title: "Shorter steps by feedback of the loads",
    place: "figure 3.8, section 3.3.3",
    run_s: 30.0,
    figures: &both(
        &regular(&BY_CYCLE, CYCLE),
        &regular(&BY_TOUCH_DOWN, TOUCH_DOWN),
    ),
    sources: &[Source::rest(
        Basis::Substitute,
        &[
            Input::Set("stance curve as printed, step length of figure 3.5"),
            SEARCHED,
            FOOTSTEPS,
        ],
    )],
    measure: with_feedback,
    commands: &[
        "twin optimize scenarios/thesis/fig-3-8.toml \
         --space scenarios/optimizations/fig-3-8.toml --seed 2",
        "twin run scenarios/thesis/fig-3-8.toml",
    ],
};

fn open_loop(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let gaits = context.modulations("thesis/fig-3-5.toml", "optimizations/fig-3-5.toml")?;
    Ok(measurements(&gaits))
}

fn with_feedback(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let gaits = context.modulations("thesis/fig-3-8.toml", "optimizations/fig-3-8.toml")?;
    Ok(measurements(&gaits))
}

/// Figures of a gait, counted in one way.
struct Footsteps {
    /// Mean displacement of the first footstep by the least change \[mm\].
    first: f64,
    is_erratic: bool,
    /// R² of the linear model.
    linear: f64,
}

fn footsteps(gait: &ModulationStudy, counting: Counting) -> Option<Footsteps> {
    let table = gait.cases.first()?.table(counting)?;
    let least = gait.plan.changes.first()?;
    Some(Footsteps {
        first: 1e3 * table.cell(*least, 1)?.mean_m,
        is_erratic: ModulationStudy::is_erratic(table),
        linear: table.model(ModelForm::BilinearWithFirstStep)?.r_squared,
    })
}

/// Returns the figures of all gaits; none of a counting in which one of them has none.
fn measurements(gaits: &[ModulationStudy]) -> Measurements {
    let mut found = Measurements::default();
    for (counting, keys) in Counting::ALL.into_iter().zip([BY_CYCLE, BY_TOUCH_DOWN]) {
        let of_gaits = gaits.iter().map(|gait| footsteps(gait, counting));
        let Some(of_gaits) = of_gaits.collect::<Option<Vec<Footsteps>>>() else {
            continue;
        };
        let mean = |of: fn(&Footsteps) -> f64| {
            of_gaits.iter().map(of).sum::<f64>() / of_gaits.len() as f64
        };
        found.set(keys.first, mean(|it| it.first));
        let forwards = of_gaits.iter().filter(|it| it.first > 0.0).count();
        found.set(keys.forwards, forwards as f64);
        let erratic = of_gaits.iter().filter(|it| it.is_erratic).count();
        found.set(keys.erratic, erratic as f64);
        found.set(keys.linear, mean(|it| it.linear));
    }
    found
}
