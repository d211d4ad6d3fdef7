//! Section about compliant constraints, whose method has error control.

use twinrig_report::number::{grouped, plain};
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table};

use super::rows;
use crate::plants::factor::Factor;
use crate::plants::row::Row;
use crate::plants::study::Study;

/// Returns the section, empty without such methods.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    if study.error_control_trends().is_empty() {
        return Vec::new();
    }
    let introduction = "A method with error control has no largest stable step: it completes, at a cost, or \
         refuses with a reason. Evaluations of the right-hand side per simulated time, the least \
         substep, and the error against its own reference, over each factor.";
    vec![
        Block::heading("Compliant constraints"),
        Block::text(introduction),
        Block::Table(table(study)),
    ]
}

fn table(study: &Study) -> Table {
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        Column::text("varied"),
        Column::number("value"),
        Column::status(""),
        Column::number("evaluations/s"),
        Column::number("least substep").in_unit("s"),
        Column::number("feet, RMS").in_unit("m"),
        Column::number("energy residual").in_unit("J"),
        Column::number("speed"),
        Column::reason(),
    ]);
    let all = study.series().into_iter();
    for key in all.filter(|key| key.is_adaptive() && key.plant.is_compliant()) {
        for factor in Factor::ALL {
            let rows = study.varied(key, factor);
            if rows.len() < 2 {
                continue;
            }
            for (n, (value, row)) in rows.into_iter().enumerate() {
                table.row(cells(factor, value, row));
                rows::mark(&mut table, n == 0, row.status, row.cut);
            }
        }
    }
    table
}

fn cells(factor: Factor, value: f64, row: &Row) -> [Cell; 11] {
    let rate = row.evaluations_per_s();
    [
        row.plant.label().into(),
        row.series().method_label().into(),
        factor.name().into(),
        plain(value).into(),
        rows::status(row),
        rate.map(|rate| grouped(&format!("{rate:.0}"))).into(),
        row.least_substep_s.into(),
        row.error_rms_m.into(),
        row.energy_residual_j.into(),
        rows::factor(row.real_time_factor).into(),
        row.why.clone().into(),
    ]
}
