//! Page section on the dependence of the largest stable step on the stiffness of the springs.

use twinrig_report::number::plain;
use twinrig_report::page::Block;
use twinrig_report::table::{Column, Table};
use twinrig_rig::PlantId;

use super::rows;
use crate::plants::stiffness::StiffnessTrend;
use crate::plants::study::Study;

/// Returns the section: limits as functions of stiffness.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let trends = study.stiffnesses();
    if trends
        .iter()
        .all(|trend| trend.limits + trend.unlimited == 0)
    {
        return Vec::new();
    }
    let introduction = "A limit due to the springs decreases with their stiffness: with exponent −½ if it is \
         due to their frequency, with exponent −1 if it is due to the damping of a mode. A limit \
         independent of the stiffness of the springs is due to another stiff element: a loop \
         closure, a joint, a stop, a contact. An engine that closes loops by springs of fixed \
         stiffness has such a limit; one that softens them as its step becomes longer has no \
         such limit, but a larger error. The thesis found 9 ms at every stiffness for its model \
         in maximal coordinates (sections 2.5.2 and 2.6.1).";
    let legend = "The exponent is fitted by least squares to the logarithms of all limits found. It is \
         insignificant if its magnitude is no greater than a twentieth, a tenth of the least \
         exponent due to springs, plus the uncertainty from the resolution of the search. A \
         limit does not depend on stiffness if its exponent is insignificant and it varies by no \
         more than such an exponent would make it. Stiffnesses at which the longest step tried \
         is stable are excluded.";
    vec![
        Block::heading("Dependence on stiffness"),
        Block::text(introduction),
        Block::Table(table(&trends)),
        Block::text(legend),
    ]
}

pub(super) fn table(trends: &[StiffnessTrend]) -> Table {
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        Column::text("depends on stiffness"),
        Column::number("constant from … to"),
        Column::number("exponent").with_places(2),
        Column::number("insignificant below").with_places(2),
        Column::number("smallest limit").in_unit("s"),
        Column::number("greatest limit").in_unit("s"),
        Column::number("limits found"),
        Column::number("stable at the longest"),
    ]);
    let mut before: Option<&PlantId> = None;
    for trend in trends {
        let constant = trend.same_over;
        let constant = constant.map(|[from, to]| format!("{} … {} ×", plain(from), plain(to)));
        let all = trend.limits + trend.unlimited + trend.unknown;
        table.row([
            trend.plant.label().into(),
            trend.method.as_str().into(),
            verdict(trend).into(),
            constant.into(),
            trend.exponent.into(),
            trend.none_below.into(),
            trend.least_step_s.into(),
            trend.greatest_step_s.into(),
            format!("{} of {all}", trend.limits).into(),
            rows::count(Some(trend.unlimited as u64)).into(),
        ]);
        if before.is_some_and(|before| *before != trend.plant) {
            table.begin_group();
        }
        before = Some(&trend.plant);
    }
    table
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
