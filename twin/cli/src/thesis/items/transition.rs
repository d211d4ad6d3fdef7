//! Transition between gaits as the excitation rises and falls (figure 3.7).

use std::f64::consts::PI;

use twinrig_experiment::{MIXED, RampDirection, STANDING, Transition, TransitionResult};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

/// Gaits before and after the printed transition.
const BEFORE: &str = "trot";
const AFTER: &str = "pace";

/// Share of the time in which a gait is that of a part of the run \[%\].
const MOSTLY: Rule = Rule::AtLeast(50.0);
const MOSTLY_GROUND: &str = "most of the time";

const OTHER_GAIT: &str = "the settings of the gait are not printed, and every gait has its own time; \
                          ours was optimised on this ramp, up and down";

pub(crate) const FIG_3_7: Item = Item {
    id: "fig-3-7",
    title: "Transition between gaits by the excitation",
    place: "figure 3.7, section 3.3.2.3",
    run_s: 2.0,
    figures: &[
        PrintedFigure::statement(
            "emerges",
            "transitions into a pace as the excitation rises",
            "3.3.2.3",
            "emerge",
            "",
        )
        .rule(Rule::AtLeast(1.0), "a count")
        .remark(
            "the thesis finds one in all of its optimised gaits; so do three searches here, of which \
             the best gait was chosen",
        ),
        PrintedFigure::statement(
            "before",
            "share of trot in the regular cycles before",
            "figure 3.7",
            BEFORE,
            "%",
        )
        .rule(MOSTLY, MOSTLY_GROUND)
        .remark(
            "by the loads; regular are cycles within a tenth of the pattern of a gait, half of the time \
             here. By its oscillators the robot does not trot: it rocks on its diagonals",
        ),
        PrintedFigure::statement(
            "after",
            "share of pace in the regular cycles after, as the excitation rises",
            "figure 3.7",
            AFTER,
            "%",
        )
        .rule(MOSTLY, MOSTLY_GROUND),
        PrintedFigure::value("begins", "change begins", "figure 3.7", 63.0, "s").remark(OTHER_GAIT),
        PrintedFigure::value(
            "excitation",
            "excitation then",
            "figure 3.7",
            3.0,
            "π rad/s",
        )
        .remark(OTHER_GAIT),
        PrintedFigure::value(
            "established",
            "pace is established",
            "figure 3.7",
            70.0,
            "s",
        )
        .remark(OTHER_GAIT),
        PrintedFigure::value("lasts", "duration of the change", "figure 3.7", 7.0, "s")
            .rule(Rule::Factor(2.0), "\"a few seconds\"")
            .remark(
                "established are three cycles in a row; from the last diagonal walk on, before which \
                 cycles are irregular from 65 s on",
            ),
        PrintedFigure::statement(
            "slip",
            "slip of the feet in the change over that in the rest of the run",
            "figure 3.7",
            "large, from 64 s to 66 s",
            "×",
        )
        .rule(Rule::AtLeast(2.0), "\"large\"; of the slip in a second")
        .remark(
            "path of all feet on the ground, from the first footstep on; feet slip as much in the \
             irregular cycles from 90 s on",
        ),
    ],
    sources: &[Source::rest(Basis::Substitute, &[Input::Fitted("the gait, by a search of the printed fitness on this ramp"), Input::Free("classes of the strides, and their times")])],
    measure: transition,
    commands: &[
        "twin study transition scenarios/thesis/fig-3-7.toml --plant massless --plant lcp",
        "twin run scenarios/thesis/fig-3-7.toml",
    ],
};

fn transition(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let study = context.transition("thesis/fig-3-7.toml")?;
    Ok(study.cases.first().map(measurements).unwrap_or_default())
}

fn measurements(run: &TransitionResult) -> Measurements {
    let mut found = Measurements::default();
    let changes = || run.transitions.iter().filter(|one| is_change(one));
    found.set("emerges", changes().count() as f64);
    let Some((change, established_s)) =
        changes().find_map(|one| one.established_s.map(|at_s| (one, at_s)))
    else {
        return found;
    };
    let begin_s = change.begin_s;
    let first_s = run.run.footsteps.first().map_or(0.0, |it| it.touch_down_s);
    let end_s = run.run.fell_at_s.unwrap_or(run.run.end_s);
    found.set("before", 100.0 * share(run, BEFORE, [first_s, begin_s]));
    let rise_s = [established_s, descent_s(run)];
    found.set("after", 100.0 * share(run, AFTER, rise_s));
    found.set("begins", begin_s);
    found.set("excitation", change.value / PI);
    found.set("established", established_s);
    found.set("lasts", established_s - begin_s);
    let slip = |span_s| run.run.slip_m(span_s);
    let rest = slip([first_s, begin_s]) + slip([established_s, end_s]);
    let rest = rest / (begin_s - first_s + end_s - established_s);
    let during = slip([begin_s, established_s]) / (established_s - begin_s);
    found.set("slip", during / rest);
    found
}

/// Returns whether a transition is from one gait into the printed one on the way up.
fn is_change(one: &Transition) -> bool {
    one.way == RampDirection::Up && one.to == AFTER && one.from != STANDING
}

/// Returns the time from which the excitation falls \[s\].
fn descent_s(run: &TransitionResult) -> f64 {
    let values = run.case.values.windows(2);
    let mut falls = values.filter(|pair| pair[1][1] < pair[0][1]);
    falls.next().map_or(run.run.end_s, |pair| pair[1][0])
}

/// Returns the share of a class in the time of the regular cycles of a span.
fn share(run: &TransitionResult, class: &str, [from_s, to_s]: [f64; 2]) -> f64 {
    let time = |is_counted: &dyn Fn(&str) -> bool| -> f64 {
        let cycles = run.cycles.iter().filter(|cycle| is_counted(&cycle.class));
        let within = cycles.map(|cycle| cycle.end_s.min(to_s) - cycle.begin_s.max(from_s));
        within.map(|lasts| lasts.max(0.0)).sum()
    };
    time(&|of| of == class) / time(&|of| ![MIXED, STANDING].contains(&of))
}
