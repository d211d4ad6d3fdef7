//! Table of all runs of a study of precision.

use crate::study::Study;
use twinrig_report::number::si;

use super::rows;
use twinrig_report::html::element::{escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the table of all runs.
pub(crate) fn table(study: &Study) -> String {
    let mut table = HtmlTable::new(
        "plant | method | setting | | feet, RMS | greatest | trunk, RMS | greatest | worst foot to hip, RMS | event time \
         | events | energy residual | constraint violation | evalu\u{ad}ations \
         | factori\u{ad}sations | solver | fallbacks | per step | speed |",
        4,
    );
    let mut before = None;
    for row in rows::integration(study) {
        let events = match (row.events, row.events_expected) {
            (None, Some(_)) => "none located".to_owned(),
            (Some(own), Some(expected)) if own != expected => format!("{own} of {expected}"),
            (own, _) => rows::count(own),
        };
        let floor = if row.at_floor { "≤ " } else { "" };
        let nonzero = |value: Option<f64>| value.filter(|&value| value > 0.0);
        table.row(
            rows::class(row, before),
            vec![
                escaped(&row.plant.label()),
                escaped(&row.series().method_label()),
                rows::setting(row),
                rows::status(row),
                row.error_rms_m
                    .map_or(String::new(), |error| format!("{floor}{}", si(error, "m"))),
                rows::length(row.error_max_m),
                rows::length(nonzero(row.trunk_error_rms_m)),
                rows::length(nonzero(row.trunk_error_max_m)),
                rows::length(row.foot_to_hip_error_rms_m),
                rows::time(row.event_time_error_s),
                events,
                row.energy_residual_j
                    .map_or(String::new(), |joule| si(joule, "J")),
                rows::length(row.drift_m),
                rows::count(row.evaluations),
                rows::count(row.factorisations),
                rows::count(row.solver_iterations),
                rows::count(row.fallbacks),
                rows::time(row.cost_per_step_s),
                rows::factor(row.real_time_factor),
                rows::why(row),
            ],
        );
        before = Some(row);
    }
    table.html()
        + &paragraph(
            "Energy residual: residual of the energy balance at the end. Speed: simulated time \
             over run time, the median of several runs without sampling; time in which the program \
             waited for a processor does not count, where the system reports it. ≤ marks errors \
             at the floor. Fallbacks: steps for which another method or a shorter step was substituted.",
        )
}
