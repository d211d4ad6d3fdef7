//! Table of all runs of a study of precision.

use twinrig_report::number::si;
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table};

use super::rows;
use crate::plants::row::Row;
use crate::plants::study::Study;

/// Returns the table of all runs.
pub(crate) fn section(study: &Study) -> [Block; 2] {
    let metres = |name: &str| Column::number(name).in_unit("m");
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        Column::text("setting"),
        Column::status(""),
        metres("feet, RMS"),
        metres("greatest"),
        metres("trunk, RMS"),
        metres("greatest"),
        metres("worst foot to hip, RMS"),
        Column::number("event time").in_unit("s"),
        Column::number("events"),
        Column::number("energy residual").in_unit("J"),
        metres("constraint violation"),
        Column::number("evalu\u{ad}ations"),
        Column::number("factori\u{ad}sations"),
        Column::number("solver"),
        Column::number("fallbacks"),
        Column::number("per step").in_unit("s"),
        Column::number("speed"),
        Column::reason(),
    ]);
    let mut before: Option<&Row> = None;
    for row in rows::integration(study) {
        let nonzero = |value: Option<f64>| value.filter(|&value| value > 0.0);
        table.row([
            row.plant.label().into(),
            row.series().method_label().into(),
            rows::setting(row).into(),
            rows::status(row),
            error(row),
            row.error_max_m.into(),
            nonzero(row.trunk_error_rms_m).into(),
            nonzero(row.trunk_error_max_m).into(),
            row.foot_to_hip_error_rms_m.into(),
            row.event_time_error_s.into(),
            events(row).into(),
            row.energy_residual_j.into(),
            row.drift_m.into(),
            rows::count(row.evaluations).into(),
            rows::count(row.factorisations).into(),
            rows::count(row.solver_iterations).into(),
            rows::count(row.fallbacks).into(),
            row.cost_per_step_s.into(),
            rows::factor(row.real_time_factor).into(),
            row.why.clone().into(),
        ]);
        let first = before.is_some_and(|before| before.series() != row.series());
        rows::mark(&mut table, first, row.status, row.cut);
        before = Some(row);
    }
    let legend = "Energy residual: residual of the energy balance at the end. Speed: simulated \
                  time over run time, the median of several runs without sampling; time in which \
                  the program waited for a processor does not count, where the system reports it. \
                  ≤ marks errors at the floor. Fallbacks: steps for which another method or a \
                  shorter step was substituted.";
    [Block::Table(table), Block::text(legend)]
}

/// Returns the error of a row, or its bound at the floor.
fn error(row: &Row) -> Cell {
    match row.error_rms_m {
        Some(error) if row.at_floor => format!("≤ {}", si(error, "m")).into(),
        error => error.into(),
    }
}

fn events(row: &Row) -> String {
    match (row.events, row.events_expected) {
        (None, Some(_)) => "none located".to_owned(),
        (Some(own), Some(expected)) if own != expected => format!("{own} of {expected}"),
        (own, _) => rows::count(own),
    }
}
