//! Largest stable step of the leg without segment masses (section 2.7).

use super::models::{
    EULER, READING, STEP_MASSLESS, STEP_OF_DISCUSSION, accurate_step, best, of_method, over, step,
};
use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

const FRICTION_SETS_IT: &str = "explicit Euler's limit c/k is proportional to the friction of the \
                                joints, which is not printed and ASSUMED here; stops that the legs \
                                rest on hold the unstable motion";

pub(crate) const FIG_2_10: Item = Item {
    id: "fig-2-10",
    title: "Largest stable step without segment masses",
    place: "2.7.2, 2.7.3, figure 2.10, 6",
    run_s: 6.0,
    figures: &[
        PrintedFigure::value(
            "step",
            "largest stable step",
            "2.7.3, figure 2.10, 6",
            STEP_MASSLESS,
            "ms",
        )
        .rule(Rule::Within(0.2), READING)
        .remark(
            "a table of forces by an explicit method does not conserve energy; the implicit \
             step here does, and is stable at all lengths",
        ),
        PrintedFigure::value(
            "euler",
            "the same by explicit Euler and a linear table of forces",
            "2.7.3, figure 2.10, 6",
            STEP_MASSLESS,
            "ms",
        )
        .rule(Rule::Within(0.2), READING)
        .remark(FRICTION_SETS_IT),
        PrintedFigure::value(
            "euler-free",
            "the same, on legs that reach no stop",
            "2.7.3, figure 2.10, 6",
            STEP_MASSLESS,
            "ms",
        )
        .rule(Rule::Within(0.2), READING)
        .remark(FRICTION_SETS_IT),
        PrintedFigure::value(
            "accurate",
            "the same, with feet right to a millimetre",
            "2.7.3, figure 2.10, 6",
            STEP_MASSLESS,
            "ms",
        )
        .rule(Rule::Within(0.2), READING)
        .remark("no error is printed; against the same method at a fine step"),
        PrintedFigure::value(
            "gain",
            "gain over the step with segment masses",
            "2.7.3",
            STEP_MASSLESS * 1e3 / STEP_OF_DISCUSSION,
            "×",
        )
        .rule(Rule::Factor(2.0), "\"two orders of magnitude\"")
        .remark(
            "of the longest accurate step of each model, by its best method: the printed gain \
             is one of the method, not of the model without masses",
        ),
        PrintedFigure::value(
            "gain-euler",
            "the same, both by explicit Euler, on legs that reach no stop",
            "2.7.3",
            STEP_MASSLESS * 1e3 / STEP_OF_DISCUSSION,
            "×",
        )
        .rule(Rule::Factor(2.0), "\"two orders of magnitude\"")
        .remark("of one friction of the joints, which is ASSUMED"),
    ],
    sources: &[
        Source::of(
            &["euler-free"],
            Basis::Given,
            &[
                Input::Set("springs of passive-legs-free, masses of the robot file"),
                Input::Set("friction of the joints, ASSUMED"),
            ],
        ),
        Source::rest(
            Basis::Substitute,
            &[
                Input::Set("springs, masses and friction of the robot file"),
                Input::Free("largest stable step"),
            ],
        ),
    ],
    measure: fig_2_10,
    commands: &[
        "twin study stability --plant massless --plant lcp",
        "twin study stability scenarios/passive-legs-free.toml --plant massless \
         --factor damping=0.1,0.2,0.5,2",
    ],
};

fn fig_2_10(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let study = context.stability()?;
    let mut found = Measurements::default();
    let stable = best(&study, "massless", step);
    found.add("step", stable.map(|step| step.times(1e3)));
    let massless = best(&study, "massless", accurate_step);
    found.add("accurate", massless.map(|step| step.times(1e3)));
    let gain = massless.zip(best(&study, "lcp", accurate_step));
    found.add("gain", gain.map(|(massless, full)| over(massless, full)));
    let euler = of_method(&study, "massless", EULER, 1.0);
    found.add("euler", euler.map(|step| step.times(1e3)));
    let free = context.free_stability()?;
    let massless = of_method(&free, "massless", EULER, 1.0);
    found.add("euler-free", massless.map(|step| step.times(1e3)));
    let gain = massless.zip(of_method(&free, "lcp", EULER, 1.0));
    found.add(
        "gain-euler",
        gain.map(|(massless, full)| over(massless, full)),
    );
    Ok(found)
}
