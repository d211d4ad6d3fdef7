//! Tables of the differences between models.

use twinrig_report::number::si;
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::rows;
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::Study;

/// Returns the tables: each model against each other, and the sensitivity to assumed compliance.
pub(crate) fn tables(study: &Study) -> Vec<Block> {
    let rows = study.rows.iter().filter(|row| row.kind == RowKind::Model);
    let (main, varied): (Vec<&Row>, Vec<&Row>) = rows.partition(|row| !row.varies_compliance());
    let mut models: Vec<String> = Vec::new();
    for row in &main {
        for model in row.against.iter().cloned().chain([row.model()]) {
            if !models.contains(&model) {
                models.push(model);
            }
        }
    }
    if models.is_empty() {
        return Vec::new();
    }
    let head = std::iter::once(Column::label("trunk / worst foot to hip"));
    let others = models[..models.len() - 1].iter();
    let mut table = Table::new(head.chain(others.map(Column::number)));
    for (n, model) in models.iter().enumerate().skip(1) {
        let cells = models[..n].iter().map(|against| {
            let found = main
                .iter()
                .find(|row| row.model() == *model && row.against.as_ref() == Some(against));
            found.map_or_else(Cell::empty, |row| difference(row))
        });
        table.row(std::iter::once(model.as_str().into()).chain(cells));
    }
    let until = main
        .iter()
        .filter_map(|row| row.compared_s)
        .fold(0.0, f64::max);
    let introduction = format!(
        "RMS over {}, the time for which the references of all models are trusted: distance of \
         the trunk, and distance of the worst foot relative to its hip. Stiffness is that of stops, \
         cables and soles, as a multiple of the robot file's; numerical errors are in the other \
         tables.",
        si(until, "s")
    );
    let mut out = vec![Block::Text(introduction), Block::Table(table)];
    if !varied.is_empty() {
        let thrice = main
            .iter()
            .filter(|row| row.scales.compliance == 3.0 && row.against == Some(row.plant.label()));
        out.push(Block::subheading("Sensitivity to compliance"));
        let rows = varied.into_iter().chain(thrice.copied());
        out.push(Block::Table(sensitivities(rows)));
    }
    out
}

/// Returns the table of models with other compliance against a model.
fn sensitivities<'r>(rows: impl Iterator<Item = &'r Row>) -> Table {
    let metres = |name: &str| Column::number(name).in_unit("m");
    let mut table = Table::new([
        Column::label("model"),
        Column::text("against"),
        metres("feet, RMS"),
        metres("greatest"),
        metres("trunk, RMS"),
        metres("worst foot to hip, RMS"),
        Column::number("over").in_unit("s"),
        Column::reason(),
    ]);
    for row in rows {
        table.row([
            row.model().into(),
            row.against.clone().into(),
            row.error_rms_m.into(),
            row.error_max_m.into(),
            row.trunk_error_rms_m.into(),
            row.foot_to_hip_error_rms_m.into(),
            row.compared_s.into(),
            row.why.clone().into(),
        ]);
        rows::mark(&mut table, false, row.status, row.cut);
    }
    table
}

/// Returns a difference: trunk and worst foot relative to its hip; without a trunk, the feet.
fn difference(row: &Row) -> Cell {
    if row.status != Status::Ok {
        return Cell::from(row.why.clone()).with_tone(Tone::Faint);
    }
    let length = |value: Option<f64>| value.map_or("–".to_owned(), |value| si(value, "m"));
    match (row.trunk_error_rms_m, row.foot_to_hip_error_rms_m) {
        (Some(trunk), foot) if trunk > 0.0 => format!("{} / {}", si(trunk, "m"), length(foot)),
        _ => length(row.error_rms_m),
    }
    .into()
}
