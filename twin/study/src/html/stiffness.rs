//! The part of a page that tells whose limit a largest stable step is: that of the springs, or not.

use crate::number::{plain, si};
use crate::stiffness::StiffnessTrend;
use crate::study::Study;

use super::rows;
use super::table::Table;
use super::text::{element, escaped, paragraph};

/// How each limit goes with the stiffness of the springs.
pub(crate) fn section(study: &Study) -> String {
    let trends = study.stiffnesses();
    if trends
        .iter()
        .all(|trend| trend.limits + trend.unlimited == 0)
    {
        return String::new();
    }
    let mut out = "<h2>Is it the springs?</h2>\n".to_owned();
    out += &paragraph(
        "Springs that limit a step do so the more, the stiffer they are: with their frequency, as stiffness to the power −½, or, where \
         the damping of a mode must not be overstepped, to the power −1. A limit that stays where it is, however stiff the springs, is not theirs. \
         It belongs to something else that is as stiff as before: the closure of a loop, a joint, a stop, a contact. An \
         engine that closes loops by springs of its own with a fixed stiffness has such a limit; one that makes them softer as \
         its step becomes longer carries no limit of theirs, and pays in error. The thesis found 9 ms at every stiffness \
         for its model in maximal coordinates (sections 2.5.2 and 2.6.1).",
    );
    let mut table = Table::new(
        &[
            "plant",
            "method",
            "depends on stiffness",
            "not from … to",
            "exponent",
            "none below",
            "least limit",
            "greatest",
            "limits found",
            "beyond the longest",
        ],
        3,
    );
    let mut before = "";
    for trend in &trends {
        let first = !before.is_empty() && before != trend.plant;
        before = &trend.plant;
        let all = trend.limits + trend.unlimited + trend.unknown;
        let beyond = Some(trend.unlimited as u64);
        table.row(
            if first { "first" } else { "" },
            vec![
                element("b", "", &escaped(&trend.plant)),
                escaped(&trend.method),
                verdict(trend).to_owned(),
                trend.same_over.map_or(String::new(), |[from, to]| {
                    format!("{} … {} ×", plain(from), plain(to))
                }),
                trend
                    .exponent
                    .map_or(String::new(), |value| format!("{value:.2}")),
                trend
                    .none_below
                    .map_or(String::new(), |value| format!("{value:.2}")),
                trend
                    .least_step_s
                    .map_or(String::new(), |step| si(step, "s")),
                trend
                    .greatest_step_s
                    .map_or(String::new(), |step| si(step, "s")),
                format!("{} of {all}", trend.limits),
                rows::count(beyond),
            ],
        );
    }
    out += &table.html();
    out += &paragraph(
        "The exponent is by least squares over the logarithms of all limits found. One is none if it is no further from zero than a \
         twentieth, a tenth of what springs make of it at the least, and what the width of the search leaves open; and a limit \
         does not depend on stiffness if it has none and moves no further, either, than such an exponent would move it. \
         Stiffnesses at which even the longest step that was tried is stable have no part in it.",
    );
    out
}

fn verdict(trend: &StiffnessTrend) -> &'static str {
    match (trend.depends, trend.limits, trend.unlimited) {
        (Some(true), ..) if trend.is_power == Some(false) => "yes, as no one power",
        (Some(true), ..) => "yes",
        (Some(false), ..) => "no",
        (None, 0, 0) => "no limit is known",
        (None, 0, _) => "no limit was met",
        (None, ..) => "too few limits to tell",
    }
}
