//! Tables of the differences between models.

use crate::row::{Row, RowKind, Status};
use crate::study::Study;
use twinrig_report::number::si;

use super::rows;
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the tables: each model against each other, and the sensitivity to assumed compliance.
pub(crate) fn tables(study: &Study) -> String {
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
        return String::new();
    }
    let mut table = HtmlTable::new(
        &format!(
            "trunk / worst foot to hip | {}",
            models[..models.len() - 1].join(" | ")
        ),
        1,
    );
    for (n, model) in models.iter().enumerate().skip(1) {
        let cells = models[..n].iter().map(|against| {
            let found = main
                .iter()
                .find(|row| row.model() == *model && row.against.as_ref() == Some(against));
            found.map_or(String::new(), |row| difference(row))
        });
        let mut all = vec![element("b", "", &escaped(model))];
        all.extend(cells);
        all.resize(models.len(), String::new());
        table.row("", all);
    }
    let until = main
        .iter()
        .filter_map(|row| row.compared_s)
        .fold(0.0, f64::max);
    let mut out = paragraph(&format!(
        "RMS over {}, the time for which the references of all models are trusted: distance of \
         the trunk, and distance of the worst foot relative to its hip. Stiffness is that of stops, \
         cables and soles, as a multiple of the robot file's; numerical errors are in the other \
         tables.",
        si(until, "s")
    )) + &table.html();
    if !varied.is_empty() {
        out += "<h3>Sensitivity to compliance</h3>\n";
        let mut table = HtmlTable::new(
            "model | against | feet, RMS | greatest | trunk, RMS | worst foot to hip, RMS | over | why",
            2,
        );
        let thrice = main
            .iter()
            .filter(|row| row.scales.compliance == 3.0 && row.against == Some(row.plant.label()));
        for row in varied.into_iter().chain(thrice.copied()) {
            table.row(
                rows::class(row, None),
                vec![
                    element("b", "", &escaped(&row.model())),
                    escaped(row.against.as_deref().unwrap_or_default()),
                    rows::length(row.error_rms_m),
                    rows::length(row.error_max_m),
                    rows::length(row.trunk_error_rms_m),
                    rows::length(row.foot_to_hip_error_rms_m),
                    rows::time(row.compared_s),
                    rows::why(row),
                ],
            );
        }
        out += &table.html();
    }
    out
}

/// Formats a difference: trunk and worst foot relative to its hip; without a trunk, the feet.
fn difference(row: &Row) -> String {
    if row.status != Status::Ok {
        return element(
            "span",
            "why",
            &escaped(row.why.as_deref().unwrap_or_default()),
        );
    }
    let length = |value: Option<f64>| value.map_or("–".to_owned(), |value| si(value, "m"));
    match (row.trunk_error_rms_m, row.foot_to_hip_error_rms_m) {
        (Some(trunk), foot) if trunk > 0.0 => format!("{} / {}", si(trunk, "m"), length(foot)),
        _ => length(row.error_rms_m),
    }
}
