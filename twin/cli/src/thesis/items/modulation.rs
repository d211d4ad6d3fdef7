//! Displacement of footsteps after a change of the step length (figures 3.5 and 3.8).

use twinrig_study::{Counting, ModelForm, ModulationStudy};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

/// Mean displacement against the change that counts \[mm\].
const OPPOSITE: Rule = Rule::AtLeast(0.5);
const OPPOSITE_GROUND: &str = "a fifth of the least change";
/// Coefficient of determination of a linear relation.
const LINEAR: Rule = Rule::AtLeast(0.9);
const LINEAR_GROUND: &str = "of (k n + k₀) Δ over all changes Δ and footsteps n";
const BACKWARDS: Rule = Rule::AtMost(0.0);
const BACKWARDS_GROUND: &str = "the mean over ten points of the cycle and all legs";

const BY_CYCLE: &str = "one footstep for each leg and cycle";
const BY_TOUCH_DOWN: &str = "bounces included; the thesis does not print how it counts";

const OPPOSITE_BY_CYCLE: &str = "opposite, by cycle";
const OPPOSITE_BY_TOUCH_DOWN: &str = "opposite, by touch-down";
const FIRST_BY_CYCLE: &str = "first, by cycle";
const FIRST_BY_TOUCH_DOWN: &str = "first, by touch-down";
const LINEAR_BY_CYCLE: &str = "linear, by cycle";
const LINEAR_BY_TOUCH_DOWN: &str = "linear, by touch-down";

pub(crate) const FIG_3_5: Item = Item {
    id: "fig-3-5",
    title: "Shorter steps in open loop",
    place: "figure 3.5, section 3.2.5",
    run_s: 3.0,
    figures: &[
        PrintedFigure::statement(
            FIRST_BY_CYCLE,
            "first footstep after a reduction by 2.5 mm",
            "figure 3.5",
            "moves forwards",
            "mm",
        )
        .rule(Rule::AtLeast(0.0), BACKWARDS_GROUND)
        .remark(BY_CYCLE),
        PrintedFigure::statement(
            FIRST_BY_TOUCH_DOWN,
            "the same, by touch-down",
            "figure 3.5",
            "moves forwards",
            "mm",
        )
        .rule(Rule::AtLeast(0.0), BACKWARDS_GROUND)
        .remark(BY_TOUCH_DOWN),
        PrintedFigure::statement(
            OPPOSITE_BY_CYCLE,
            "greatest mean displacement against a reduction",
            "3.4",
            "erratic",
            "mm",
        )
        .rule(OPPOSITE, OPPOSITE_GROUND)
        .remark(BY_CYCLE),
        PrintedFigure::statement(
            OPPOSITE_BY_TOUCH_DOWN,
            "the same, by touch-down",
            "3.4",
            "erratic",
            "mm",
        )
        .rule(OPPOSITE, OPPOSITE_GROUND)
        .remark(BY_TOUCH_DOWN),
    ],
    sources: &[Source::rest(
        Basis::Substitute,
        &[
            Input::Fitted("the gait, by a search for speed and evenness"),
            Input::Free("footsteps"),
        ],
    )],
    measure: open_loop,
    commands: &[
        "twin study modulation scenarios/thesis/fig-3-5.toml --plant massless --plant lcp",
        "twin run scenarios/thesis/fig-3-5.toml",
    ],
};

pub(crate) const FIG_3_8: Item = Item {
    id: "fig-3-8",
    title: "Shorter steps by feedback of the loads",
    place: "figure 3.8, section 3.3.3",
    run_s: 3.0,
    figures: &[
        PrintedFigure::statement(
            FIRST_BY_CYCLE,
            "first footstep after a reduction by 2.5 mm",
            "3.3.3",
            "moves backwards",
            "mm",
        )
        .rule(BACKWARDS, BACKWARDS_GROUND)
        .remark(BY_CYCLE),
        PrintedFigure::statement(
            FIRST_BY_TOUCH_DOWN,
            "the same, by touch-down",
            "3.3.3",
            "moves backwards",
            "mm",
        )
        .rule(BACKWARDS, BACKWARDS_GROUND)
        .remark(BY_TOUCH_DOWN),
        PrintedFigure::statement(
            LINEAR_BY_CYCLE,
            "coefficient of determination R²",
            "3.3.3",
            "linear in change and steps",
            "",
        )
        .rule(LINEAR, LINEAR_GROUND)
        .remark("one footstep for each leg and cycle; the open loop is as linear"),
        PrintedFigure::statement(
            LINEAR_BY_TOUCH_DOWN,
            "the same, by touch-down",
            "3.3.3",
            "linear in change and steps",
            "",
        )
        .rule(LINEAR, LINEAR_GROUND)
        .remark(BY_TOUCH_DOWN),
    ],
    sources: &[Source::rest(
        Basis::Substitute,
        &[
            Input::Fitted("the gait, by a search for speed and evenness"),
            Input::Free("footsteps"),
        ],
    )],
    measure: with_feedback,
    commands: &[
        "twin study modulation scenarios/thesis/fig-3-5.toml scenarios/thesis/fig-3-8.toml \
         --plant massless --plant lcp --factors",
        "twin run scenarios/thesis/fig-3-8.toml",
    ],
};

fn open_loop(context: &Context<'_>) -> Result<Measurements, TwinError> {
    Ok(measurements(&context.modulation("thesis/fig-3-5.toml")?))
}

fn with_feedback(context: &Context<'_>) -> Result<Measurements, TwinError> {
    Ok(measurements(&context.modulation("thesis/fig-3-8.toml")?))
}

fn measurements(study: &ModulationStudy) -> Measurements {
    let mut found = Measurements::default();
    let Some(case) = study.cases.first() else {
        return found;
    };
    let least = study.plan.changes.first().copied().unwrap_or(f64::NAN);
    let [cycle, touch_down] = Counting::ALL;
    for (counting, first, opposite, linear) in [
        (cycle, FIRST_BY_CYCLE, OPPOSITE_BY_CYCLE, LINEAR_BY_CYCLE),
        (
            touch_down,
            FIRST_BY_TOUCH_DOWN,
            OPPOSITE_BY_TOUCH_DOWN,
            LINEAR_BY_TOUCH_DOWN,
        ),
    ] {
        let Some(table) = case.table(counting) else {
            continue;
        };
        let mean = table.cell(least, 1).map(|cell| 1e3 * cell.mean_m);
        found.add(first, mean.map(Measurement::exact));
        found.set(opposite, 1e3 * table.opposite_m());
        let model = table.model(ModelForm::BilinearWithFirstStep);
        found.add(
            linear,
            model.map(|model| Measurement::exact(model.r_squared)),
        );
    }
    found
}
