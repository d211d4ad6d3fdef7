//! Section about compliant constraints, whose method has error control.

use crate::row::{Row, RowKind, Status};
use crate::study::Study;
use crate::sweep::Factor;

use super::rows;
use twinrig_report::html::element::{escaped, paragraph};
use twinrig_report::html::table::HtmlTable;
use twinrig_report::number::{grouped, plain, si};

/// Returns the section, empty without such methods.
pub(crate) fn section(study: &Study) -> String {
    if study.error_control_trends().is_empty() {
        return String::new();
    }
    let mut out = String::from("<h2>Compliant constraints</h2>\n");
    out += &paragraph(
        "A method with error control has no largest stable step: it completes, at a cost, or refuses \
         with a reason. Evaluations of the right-hand side per simulated time, the least substep, and the \
         error against its own reference, over each factor.",
    );
    out + &table(study)
}

fn table(study: &Study) -> String {
    let mut table = HtmlTable::new(
        "plant | method | varied | value | | evaluations/s | least substep | feet, RMS \
         | energy residual | speed |",
        3,
    );
    let all = study.series().into_iter();
    for key in all.filter(|key| key.is_adaptive() && key.plant.is_compliant()) {
        for factor in Factor::ALL {
            let rows = study.rows.iter().filter(|row| row.series() == key);
            let rows = rows.filter(|row| row.kind == RowKind::Stability);
            let rows = rows.filter_map(|row| Some((factor.of(&row.scales)?, row)));
            let mut rows: Vec<(f64, &Row)> = rows.collect();
            rows.sort_by(|a, b| a.0.total_cmp(&b.0));
            if rows.len() < 2 {
                continue;
            }
            for (n, (value, row)) in rows.into_iter().enumerate() {
                table.row(
                    match (n, row.status) {
                        (0, Status::Ok) => "first",
                        (0, _) => "first bad",
                        (_, Status::Ok) => "",
                        _ => "bad",
                    },
                    vec![
                        escaped(&row.plant.label()),
                        escaped(&row.series().method_label()),
                        factor.name().to_owned(),
                        plain(value),
                        rows::status(row),
                        row.evaluations_per_s()
                            .map_or(String::new(), |rate| grouped(&format!("{rate:.0}"))),
                        rows::time(row.least_substep_s),
                        rows::length(row.error_rms_m),
                        row.energy_residual_j
                            .map_or(String::new(), |joule| si(joule, "J")),
                        rows::factor(row.real_time_factor),
                        rows::why(row),
                    ],
                );
            }
        }
    }
    table.html()
}
