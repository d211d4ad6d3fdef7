//! Models of the leg: stable steps and run times (sections 2.5 to 2.7).

use twinrig_experiment::{Row, StabilityPlan, Status, Study};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

/// Largest stable step of the model with segment masses: sections 2.5.2 and 2.7.3, chapter 6
/// \[µs\].
const STEP: f64 = 15.0;
pub(super) const STEP_OF_DISCUSSION: f64 = 15.7;
const STEP_OF_CONCLUSION: f64 = 40.0;
/// That with a quarter of the stiffness \[µs\].
const STEP_AT_QUARTER: f64 = 166.1;
/// Run time of a step (2.6.2) \[µs\].
const RUN: f64 = 380.0;
/// That of the massless model (2.7.3, chapter 6) \[µs\].
const RUN_MASSLESS: f64 = 350.0;
const RUN_MASSLESS_OF_CONCLUSION: f64 = 357.0;
/// Largest stable step of the massless model \[ms\].
pub(super) const STEP_MASSLESS: f64 = 1.69;
/// Largest stable step of the model in maximal coordinates \[ms\], and its speed \[× real time\].
const STEP_MAXIMAL: f64 = 9.0;
const SPEED_MAXIMAL: f64 = 2.7;

/// Method of the thesis.
pub(super) const EULER: &str = "explicit-euler";

pub(super) const READING: &str = "reading of a curve";
const ROUNDED: &str = "\"approximately\"";
const NOT_PRINTED: &str = "inertias and joint friction of the drawings are not printed, and explicit \
                           Euler's limit 2ζ/ω is proportional to the friction, which is ASSUMED here";

pub(crate) const FIG_2_5: Item = Item {
    id: "fig-2-5",
    title: "Largest stable step, maximal and generalised coordinates",
    place: "2.5.2, figure 2.5",
    run_s: 6.0,
    figures: &[
        PrintedFigure::value(
            "euler",
            "generalised coordinates, explicit Euler",
            "2.5.2, figure 2.5b",
            STEP,
            "µs",
        )
        .remark(NOT_PRINTED),
        PrintedFigure::value(
            "euler",
            "the same, in the discussion",
            "2.7.3",
            STEP_OF_DISCUSSION,
            "µs",
        )
        .remark(NOT_PRINTED),
        PrintedFigure::value(
            "euler",
            "the same, in the conclusion",
            "6",
            STEP_OF_CONCLUSION,
            "µs",
        )
        .remark(NOT_PRINTED),
        PrintedFigure::value(
            "quarter",
            "gain by a quarter of the stiffness",
            "2.5.2, figure 2.5b",
            STEP_AT_QUARTER / STEP,
            "×",
        )
        .rule(Rule::Within(0.2), READING)
        .remark(
            "springs limit a step by their frequency or their damping, hence by the power −½ \
             or −1 of the stiffness: a gain of 2 to 4. The impact rule of 2.3.2 creates energy \
             at stops, the less the softer the springs",
        ),
        PrintedFigure::value(
            "free",
            "the same on legs that reach no stop",
            "2.5.2, figure 2.5b",
            STEP,
            "µs",
        )
        .remark(NOT_PRINTED),
        PrintedFigure::statement(
            "best",
            "the same model by a method that locates events",
            "2.6.2",
            "needs steps of some 15 µs",
            "ms",
        )
        .rule(Rule::AtMost(0.1), "several times the printed step")
        .remark(
            "by `rodas4`, whose feet are right to micrometres at that step: the model is not \
             stiff at milliseconds",
        ),
        PrintedFigure::value(
            "maximal",
            "maximal coordinates, at every stiffness",
            "2.5.2, figure 2.5a",
            STEP_MAXIMAL,
            "ms",
        )
        .remark("the model for Webots, with the softness of its joints, is not printed"),
    ],
    sources: &[Source::rest(
        Basis::Substitute,
        &[
            Input::Set("springs, masses and friction of the robot file"),
            Input::Free("largest stable step"),
        ],
    )],
    measure: fig_2_5,
    commands: &[
        "twin study stability",
        "twin study stability scenarios/passive-legs-free.toml",
    ],
};

pub(crate) const FIG_2_6: Item = Item {
    id: "fig-2-6",
    title: "Run time of a step, and speed of the simulation",
    place: "2.5.2, 2.6.2, 2.7.3, figure 2.6, 6",
    run_s: 6.0,
    figures: &[
        PrintedFigure::value(
            "run",
            "run time of a step, explicit Euler",
            "2.6.2, figure 2.6",
            RUN,
            "µs",
        )
        .remark("the computer is not named; `codyn` is a symbolic framework")
        .timing(),
        PrintedFigure::value(
            "run-massless",
            "run time of a step, massless",
            "2.7.3",
            RUN_MASSLESS,
            "µs",
        )
        .remark("the computer is not named; by explicit Euler with a table of forces")
        .timing(),
        PrintedFigure::value(
            "run-massless",
            "the same, in the conclusion",
            "6",
            RUN_MASSLESS_OF_CONCLUSION,
            "µs",
        )
        .remark("as above; both are printed for one model")
        .timing(),
        PrintedFigure::value(
            "slower",
            "segment masses: times slower than real time",
            "2.5.2, 2.6.2",
            25.0,
            "×",
        )
        .rule(Rule::Within(0.1), ROUNDED)
        .remark("printed run time over printed step, 380 µs / 15 µs"),
        PrintedFigure::value(
            "slower-conclusion",
            "the same, with the step of the conclusion",
            "6",
            25.0,
            "×",
        )
        .rule(Rule::Within(0.1), ROUNDED)
        .remark("380 µs / 40 µs: the conclusion's step and speed exclude each other"),
        PrintedFigure::value(
            "slower-quarter",
            "the same, with a quarter of the stiffness",
            "2.5.2",
            2.0,
            "×",
        )
        .rule(Rule::Within(0.2), "printed to one digit")
        .remark("380 µs / 166.1 µs"),
        PrintedFigure::value(
            "faster-massless",
            "massless: times faster than real time",
            "2.7.3",
            5.0,
            "×",
        )
        .rule(Rule::Within(0.1), "\"almost\"")
        .remark("1.69 ms / 350 µs"),
        PrintedFigure::value(
            "maximal-run",
            "run time of a step, maximal over generalised",
            "2.6.2",
            10.0,
            "×",
        )
        .rule(Rule::Factor(2.0), "\"one order of magnitude\"")
        .remark("9 ms at 2.7 × real time are 3.3 ms a step, over 380 µs"),
        PrintedFigure::value(
            "gain",
            "speed of simulation, massless over segment masses",
            "2.6.2, 2.7.3",
            STEP_MASSLESS * 1e3 / RUN_MASSLESS / (STEP / RUN),
            "×",
        )
        .rule(Rule::Factor(3.0), "run times of another machine")
        .remark(
            "of the fastest method of each model at its largest stable step: the masses of the \
             segments do not make the model slow",
        )
        .timing(),
        PrintedFigure::value(
            "gain-euler",
            "the same, both by explicit Euler, on legs that reach no stop",
            "2.6.2, 2.7.3",
            STEP_MASSLESS * 1e3 / RUN_MASSLESS / (STEP / RUN),
            "×",
        )
        .rule(Rule::Factor(3.0), "run times of another machine")
        .remark("of one friction of the joints, which is ASSUMED")
        .timing(),
    ],
    sources: &[
        Source::of(
            &[
                "slower",
                "slower-conclusion",
                "slower-quarter",
                "faster-massless",
                "maximal-run",
            ],
            Basis::Arithmetic,
            &[Input::Set("printed steps, run times and speeds")],
        ),
        Source::rest(
            Basis::Substitute,
            &[
                Input::Set("springs, masses and friction of the robot file"),
                Input::Free("run time"),
            ],
        ),
    ],
    measure: fig_2_6,
    commands: &["twin study precision", "twin study stability"],
};

/// Rows of a plant's methods at a factor of the stiffness.
fn rows<'s>(study: &'s Study, plant: &'s str, stiffness: f64) -> impl Iterator<Item = &'s Row> {
    let of = move |row: &&Row| {
        row.plant == plant
            && row.scales.stiffness.to_bits() == stiffness.to_bits()
            && row.status == Status::Ok
    };
    study.rows.iter().filter(of)
}

/// Returns the largest stable step of a row \[s\], a lower bound where no longer step was tried.
pub(super) fn step(row: &Row) -> Option<Measurement> {
    let stable = row.largest_stable_step_s?;
    Some(match row.least_unstable_step_s {
        Some(unstable) => Measurement::within(stable, stable, unstable),
        None => Measurement::at_least(stable),
    })
}

pub(super) fn of_method(
    study: &Study,
    plant: &str,
    method: &str,
    stiffness: f64,
) -> Option<Measurement> {
    let mut rows = rows(study, plant, stiffness);
    rows.find(|row| row.method == method).and_then(step)
}

/// Returns the largest stable step whose feet are right \[s\], which is known to the resolution of
/// the search.
pub(super) fn accurate_step(row: &Row) -> Option<Measurement> {
    let right = row.largest_right_step_s?;
    if Some(right) == row.largest_stable_step_s {
        return step(row);
    }
    Some(Measurement::within(
        right,
        right,
        right * StabilityPlan::default().ratio,
    ))
}

/// Returns the largest of the steps of all methods of a plant.
pub(super) fn best(
    study: &Study,
    plant: &str,
    step: fn(&Row) -> Option<Measurement>,
) -> Option<Measurement> {
    let steps = rows(study, plant, 1.0).filter_map(step);
    steps.max_by(|a, b| a.value.total_cmp(&b.value))
}

fn fig_2_5(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let study = context.stability()?;
    let mut found = Measurements::default();
    let of_euler = |stiffness| of_method(&study, "lcp", EULER, stiffness);
    found.add("euler", of_euler(1.0).map(|step| step.times(1e6)));
    let gain = of_euler(0.25).zip(of_euler(1.0));
    let free = of_method(&*context.free_stability()?, "lcp", EULER, 1.0);
    found.add("free", free.map(|step| step.times(1e6)));
    found.add("quarter", gain.map(|(quarter, whole)| over(quarter, whole)));
    found.add(
        "best",
        best(&study, "lcp", accurate_step).map(|step| step.times(1e3)),
    );
    Ok(found)
}

/// Returns the ratio of two positive measurements.
pub(super) fn over(numerator: Measurement, denominator: Measurement) -> Measurement {
    let divide = |above: Option<f64>, below: Option<f64>| Some(above? / below?);
    Measurement {
        value: numerator.value / denominator.value,
        low: divide(numerator.low, denominator.high),
        high: divide(numerator.high, denominator.low),
    }
}

fn fig_2_6(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let study = context.stability()?;
    let mut found = Measurements::default();
    let run = |plant, method: &str| {
        let row = rows(&study, plant, 1.0).find(|row| row.method == method)?;
        row.cost_per_step_s
    };
    let microseconds = |seconds: f64| Measurement::exact(seconds * 1e6);
    found.add("run", run("lcp", EULER).map(microseconds));
    found.add("run-massless", run("massless", EULER).map(microseconds));
    found.set("slower", RUN / STEP);
    found.set("slower-conclusion", RUN / STEP_OF_CONCLUSION);
    found.set("slower-quarter", RUN / STEP_AT_QUARTER);
    found.set("faster-massless", STEP_MASSLESS * 1e3 / RUN_MASSLESS);
    found.set("maximal-run", STEP_MAXIMAL * 1e3 / SPEED_MAXIMAL / RUN);
    let fastest = |plant| {
        let speeds = rows(&study, plant, 1.0).filter_map(|row| row.real_time_factor);
        speeds.max_by(f64::total_cmp)
    };
    let gain = fastest("massless").zip(fastest("lcp"));
    found.add(
        "gain",
        gain.map(|(massless, full)| Measurement::exact(massless / full)),
    );
    let free = context.free_stability()?;
    let speed = |plant| {
        let row = rows(&free, plant, 1.0).find(|row| row.method == EULER)?;
        row.real_time_factor
    };
    let gain = speed("massless").zip(speed("lcp"));
    found.add(
        "gain-euler",
        gain.map(|(massless, full)| Measurement::exact(massless / full)),
    );
    Ok(found)
}
