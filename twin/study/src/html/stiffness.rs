//! Page section on the dependence of the largest stable step on the stiffness of the springs.

use crate::stiffness::StiffnessTrend;
use crate::study::Study;
use twinrig_report::number::{plain, si};
use twinrig_rig::PlantId;

use super::rows;
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: limits as functions of stiffness.
pub(crate) fn section(study: &Study) -> String {
    let trends = study.stiffnesses();
    if trends
        .iter()
        .all(|trend| trend.limits + trend.unlimited == 0)
    {
        return String::new();
    }
    let mut out = "<h2>Dependence on stiffness</h2>\n".to_owned();
    out += &paragraph(
        "A limit due to the springs decreases with their stiffness: with exponent −½ if it is \
         due to their frequency, with exponent −1 if it is due to the damping of a mode. A limit \
         independent of the stiffness of the springs is due to another stiff element: a loop \
         closure, a joint, a stop, a contact. An engine that closes loops by springs of fixed \
         stiffness has such a limit; one that softens them as its step becomes longer has no \
         such limit, but a larger error. The thesis found 9 ms at every stiffness for its model \
         in maximal coordinates (sections 2.5.2 and 2.6.1).",
    );
    let mut table = HtmlTable::new(
        "plant | method | depends on stiffness | constant from … to | exponent \
         | insignificant below | smallest limit | greatest limit | limits found \
         | stable at the longest",
        3,
    );
    let mut before: Option<&PlantId> = None;
    for trend in &trends {
        let first = before.is_some_and(|before| *before != trend.plant);
        before = Some(&trend.plant);
        let all = trend.limits + trend.unlimited + trend.unknown;
        let beyond = Some(trend.unlimited as u64);
        table.row(
            if first { "first" } else { "" },
            vec![
                element("b", "", &escaped(&trend.plant.label())),
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
        "The exponent is fitted by least squares to the logarithms of all limits found. It is \
         insignificant if its magnitude is no greater than a twentieth, a tenth of the least \
         exponent due to springs, plus the uncertainty from the resolution of the search. A \
         limit does not depend on stiffness if its exponent is insignificant and it varies by no \
         more than such an exponent would make it. Stiffnesses at which the longest step tried \
         is stable are excluded.",
    );
    out
}

fn verdict(trend: &StiffnessTrend) -> &'static str {
    match (trend.depends, trend.limits, trend.unlimited) {
        (Some(true), ..) if trend.is_power == Some(false) => "yes, not as a power law",
        (Some(true), ..) => "yes",
        (Some(false), ..) => "no",
        (None, 0, 0) => "no limit is known",
        (None, 0, _) => "no limit up to the longest step",
        (None, ..) => "too few limits",
    }
}
