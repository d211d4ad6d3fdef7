//! Pages of studies with synthetic rows.

use twinrig_report::number::{method_setting, si};
use twinrig_rig::{MethodSetting, PlantId};

use crate::plants::dominance_tests::{page, row, study};
use crate::plants::factor::Factor;
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::Study;

/// Errors of a second-order method at five steps.
fn falling() -> Vec<Row> {
    let steps = [4000, 2000, 1000, 500, 250_u64];
    let row = |micros: u64| {
        let milliseconds = micros as f64 / 1e3;
        row(
            "full",
            micros,
            1e-7 * milliseconds * milliseconds,
            1.0 / milliseconds,
        )
    };
    steps.map(row).into()
}

/// Returns the plots of a page.
fn plots(page: &str) -> Vec<&str> {
    let plots = page.split("<svg viewBox").skip(1);
    let plots = plots.filter_map(|rest| rest.split("</svg>").next());
    plots.filter(|plot| plot.contains("role=\"img\"")).collect()
}

/// Returns the number of points of each line of a plot.
fn lines(plot: &str) -> Vec<usize> {
    let lines = plot.split("<polyline points=\"").skip(1);
    let lines = lines.filter_map(|rest| rest.split('"').next());
    lines.map(|points| points.split(' ').count()).collect()
}

#[test]
fn lines_are_interrupted_at_failed_runs() {
    let complete = page(&study(falling()));
    let drawn: Vec<Vec<usize>> = plots(&complete).into_iter().map(lines).collect();
    assert_eq!(drawn, [[5], [5]], "error over run time, error over step");
    let mut rows = falling();
    rows[2] = rows[2].clone().ended(Status::Failed, "it snapped");
    let broken = page(&study(rows));
    let drawn: Vec<Vec<usize>> = plots(&broken).into_iter().map(lines).collect();
    assert_eq!(drawn, [[2, 2], [2, 2]]);
}

#[test]
fn contradicting_run_is_marked_in_rows_and_plots() {
    let mut consistent = study(falling());
    consistent.mark_contradictions();
    assert!(
        consistent
            .rows
            .iter()
            .all(|row| !row.contradicts && row.why.is_none())
    );
    assert!(!page(&consistent).contains("contradicts"));
    let mut rows = falling();
    rows[3].error_rms_m = Some(0.18);
    let mut contradicting = study(rows);
    contradicting.mark_contradictions();
    let marked: Vec<bool> = contradicting
        .rows
        .iter()
        .map(|row| row.contradicts)
        .collect();
    assert_eq!(marked, [false, false, false, true, false]);
    let why = contradicting.rows[3].why.as_deref().unwrap();
    assert_eq!(
        why,
        "contradicts the settings next to it: 100 nm at 1 ms and 10 nm at 250 µs"
    );
    let page = page(&contradicting);
    for plot in plots(&page) {
        assert_eq!(plot.matches("class=\"doubtful\"").count(), 1);
    }
    assert!(
        page.contains(why),
        "the table of all runs contains the reason"
    );
}

#[test]
fn contradicting_limit_names_the_neighbouring_values_of_the_factor() {
    let rows = [0.1, 1.0, 10.0].map(|stiffness| {
        let mut row = row("full", 1000, 1e-6, 1.0);
        row.kind = RowKind::Stability;
        row.scales = Factor::Stiffness.scales(stiffness);
        row.largest_stable_step_s = Some(if stiffness == 1.0 { 1e-3 } else { 0.1 });
        row
    });
    let mut study = study(rows.into());
    study.mark_contradictions();
    assert_eq!(
        study.rows[1].why.as_deref(),
        Some(
            "contradicts the settings next to it: 100 ms at stiffness × 0.1 and 100 ms at stiffness × 10"
        )
    );
}

/// The headline row belongs to the plants with segment masses and to the step shown in the tables.
#[test]
fn headline_row_has_a_card_and_is_in_the_table() {
    let mut rows = falling();
    // More accurate and faster, but by a model without segment masses.
    rows.push(row("other", 2000, 1e-9, 0.01));
    let mut adaptive = row("full", 1, 2e-9, 0.02);
    (adaptive.step_s, adaptive.tolerance) = (None, MethodSetting::Tolerance(1e-8).tolerance());
    let foremost = |rows: &[Row]| {
        let study = study(rows.to_vec());
        let row = study.headline_row().unwrap().row.clone();
        let name = format!(
            "{}, {}",
            row.series().name(),
            method_setting(row.step_s, row.tolerance)
        );
        let (page, error) = (page(&study), si(row.error_rms_m.unwrap(), "m"));
        let headline = study.headline();
        assert!(
            headline.contains(&row.series().name()) && headline.contains(&error),
            "{headline}"
        );
        let cards = page.split("<div class=\"cards\">").nth(1).unwrap();
        let cards = cards.split("<h2>").next().unwrap();
        assert!(
            cards.contains(&name) && cards.contains(&error),
            "{name}: {cards}"
        );
        assert!(!cards.contains("other"), "{cards}");
        let table = page.split("Summary by method</h2>").nth(1).unwrap();
        let table = table.split("</table>").next().unwrap();
        assert!(table.contains(&error), "{error}: {table}");
        name
    };
    assert_eq!(foremost(&rows), "full euler, 2 ms");
    rows.push(adaptive);
    assert_eq!(
        foremost(&rows),
        "full euler, 2 ms",
        "an adaptive row is not preferred to the usual step"
    );
    // No row is within the aim at the usual step, so the adaptive one is selected.
    rows[1].error_rms_m = Some(1e-5);
    assert_eq!(foremost(&rows), "full euler, adaptive, tolerance 10⁻⁸");
    rows.pop();
    assert_eq!(foremost(&rows), "full euler, 2 ms", "the smallest error");
}

#[test]
fn error_at_the_floor_is_shown_as_the_floor() {
    let text = |study: &Study| study.summary().finish(&[]);
    let mut study = study(falling());
    assert!(!text(&study).contains('≤'));
    for row in &mut study.rows {
        row.at_floor = true;
    }
    let floor = si(study.floor_of(&PlantId::new("full")), "m");
    assert!(
        text(&study).contains(&format!("≤ {floor}")),
        "{}",
        text(&study)
    );
    assert!(page(&study).contains(&format!("≤ {floor}")));
}

#[test]
fn failed_and_truncated_runs_are_counted_apart() {
    let mut rows = falling();
    rows[0] = rows[0].clone().ended(Status::Failed, "it snapped");
    rows[1] = rows[1].clone().cut_off("too slow");
    rows[2] = rows[2].clone().cut_off("too slow");
    let study = study(rows);
    let counts = "1 of 5 failed, 2 of 5 truncated";
    assert!(study.summary().finish(&[]).contains(counts));
    assert!(page(&study).contains(counts));
}
