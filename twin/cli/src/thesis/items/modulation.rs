//! Displacement of footsteps after a change of the step length (figures 3.5 and 3.8).

use twinrig_experiment::{Counting, ModelForm, ModulationStudy};

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

/// Place and words of the thesis on a figure, and the rule that they mean.
type Claim = (&'static str, &'static str, Rule);

/// Claims on an open loop: first displacement, gaits forwards, erratic gaits, R².
const ERRATIC: [Claim; 4] = [
    ("figure 3.5", "moves forwards", Rule::AtLeast(0.0)),
    ("figure 3.5", "moves forwards", Rule::AtLeast(MOST)),
    ("3.4", "erratic", Rule::AtLeast(MOST)),
    ("3.4", "erratic", Rule::AtMost(LINEAR)),
];
/// Claims on a loop with feedback, in the same order.
const REGULAR: [Claim; 4] = [
    ("3.3.3", "moves backwards", Rule::AtMost(0.0)),
    ("3.3.3", "moves backwards", Rule::AtMost(0.0)),
    ("3.3.3", "regular", Rule::AtMost(0.0)),
    ("3.3.3", "linear in change and steps", Rule::AtLeast(LINEAR)),
];

const fn figure(
    key: &'static str,
    quantity: &'static str,
    unit: &'static str,
    (place, printed, rule): Claim,
    ground: &'static str,
    remark: &'static str,
) -> PrintedFigure {
    PrintedFigure::statement(key, quantity, place, printed, unit)
        .rule(rule, ground)
        .remark(remark)
}

/// Figures of footsteps that are counted in one way.
const fn counted(keys: &Keys, claims: [Claim; 4], remark: &'static str) -> [PrintedFigure; 4] {
    let [first, forwards, erratic, linear] = claims;
    [
        figure(
            keys.first,
            "first footstep after a reduction by 2.5 mm",
            "mm",
            first,
            FIRST_GROUND,
            remark,
        ),
        figure(
            keys.forwards,
            "number of gaits with a first footstep forwards",
            "",
            forwards,
            FORWARDS_GROUND,
            remark,
        ),
        figure(
            keys.erratic,
            "number of erratic gaits",
            "",
            erratic,
            ERRATIC_GROUND,
            remark,
        ),
        figure(
            keys.linear,
            "coefficient of determination R²",
            "",
            linear,
            LINEAR_GROUND,
            remark,
        ),
    ]
}

/// Returns the figures of both ways of counting.
const fn figures(claims: [Claim; 4]) -> [PrintedFigure; 8] {
    let [a, b, c, d] = counted(&BY_CYCLE, claims, CYCLE);
    let [e, f, g, h] = counted(&BY_TOUCH_DOWN, claims, TOUCH_DOWN);
    [a, b, c, d, e, f, g, h]
}

pub(crate) const FIG_3_5: Item = Item {
    id: "fig-3-5",
    title: "Shorter steps in open loop",
    place: "figure 3.5, section 3.2.5",
    run_s: 30.0,
    figures: &figures(ERRATIC),
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
    figures: &figures(REGULAR),
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
