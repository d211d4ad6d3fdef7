//! Page of a study of stability.

use crate::row::{Row, Series, Status};
use crate::study::Study;
use crate::sweep::Factor;
use crate::thesis::{FIGURES, ThesisFigure};
use twinrig_rig::Scales;

use super::rows::{self, limit_cell, unlimited};
use super::thesis::{self, QUARTER};
use super::{card, commanded, error_control, figure, introduction, legend, references, stiffness};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::marker::{foreign_swatch, swatch};
use twinrig_report::html::plot::{Curve, Ended, Look, Mark, Plot, Point, Setting};
use twinrig_report::html::table::HtmlTable;
use twinrig_report::number::{plain, si};

pub(crate) fn body(study: &Study) -> String {
    let found = format!(
        "For each plant and method, the longest step at which the motion stays bounded over {}, \
         found by bisection as in the thesis (section 2.5.1), with one property of the robot or \
         the ground varied at a time. A stable step need not be accurate: at the limit, the feet \
         are compared with a reference, too. {}",
        si(study.simulated_s, "s"),
        commanded(study)
    );
    let mut out = introduction(&found);
    out += &cards(study);
    out += "<h2>What limits the step</h2>\n";
    out += &sweeps(study);
    out += &stiffness::section(study);
    out += &error_control::section(study);
    out += "<h2>Unchanged scenario</h2>\n";
    out += &as_it_is(study);
    if !study.commanded && !study.ground {
        out += "<h2>Comparison with the thesis</h2>\n";
        out += &thesis::section(study);
    }
    out += "<h2>References</h2>\n";
    out += &references(&study.references).html();
    out += "<h2>All searches</h2>\n";
    out += &all(study);
    out
}

/// Returns the limit of a row, if it has one.
fn limit_of(row: &Row) -> Option<f64> {
    row.largest_stable_step_s
        .filter(|_| row.status == Status::Ok)
}

fn cards(study: &Study) -> String {
    let rows = || study.rows.iter().filter(|row| row.scales == Scales::AS_IS);
    let limit = |row: &&Row| row.largest_stable_step_s.unwrap_or(0.0);
    let accurate = |row: &&Row| row.largest_right_step_s.unwrap_or(0.0);
    let sound = || rows().filter(|row| row.status == Status::Ok && limit(row) > 0.0);
    // Of equal rows, the first.
    let longest = sound().rev().max_by(|a, b| limit(a).total_cmp(&limit(b)));
    let longest_accurate = sound()
        .rev()
        .filter(|row| accurate(row) > 0.0)
        .max_by(|a, b| accurate(a).total_cmp(&accurate(b)));
    let name = |row: &Row| row.series().name();
    let bound = |row: &Row| {
        format!(
            "{}{}",
            if unlimited(row) { "≥ " } else { "" },
            si(limit(&row), "s")
        )
    };
    let mut out = String::new();
    if let Some(row) = longest {
        out += &card(
            "longest stable step, unchanged scenario",
            &bound(row),
            &name(row),
        );
    }
    if let Some(row) = longest_accurate {
        let step = si(accurate(&row), "s");
        out += &card("longest accurate step", &step, &name(row));
    }
    let shortest = sound().min_by(|a, b| limit(a).total_cmp(&limit(b)));
    if let Some(row) = shortest {
        out += &card("smallest limit of a method", &bound(row), &name(row));
    }
    let wrong = study.rows.iter().filter(|row| row.wrong).count();
    let failed = study
        .rows
        .iter()
        .filter(|row| row.status != Status::Ok)
        .count();
    let more = format!("{wrong} stable but wrong at the limit, {failed} without a limit");
    out += &card("searches", &study.rows.len().to_string(), &more);
    element("div", "cards", &out)
}

/// Returns a plot for each factor.
fn sweeps(study: &Study) -> String {
    // Adaptive methods have no limit.
    let series = study.numbered_series().into_iter();
    let series: Vec<(usize, Series<'_>)> = series.filter(|(_, key)| !key.is_adaptive()).collect();
    let mut entries: Vec<(String, String)> = series
        .iter()
        .map(|&(number, key)| (swatch(number, false), key.name()))
        .collect();
    if !study.commanded && !study.ground {
        entries.push((foreign_swatch(), "thesis".to_owned()));
    }
    let mut out = legend(&entries);
    out += &paragraph(
        "Filled: accurate at the limit. Hollow: stable but wrong, or the longest step tried. In \
         the strip: no stable step found.",
    );
    let shared_y: Vec<f64> = study.rows.iter().filter_map(limit_of).collect();
    let mut figures = String::new();
    for factor in Factor::ALL {
        let curves: Vec<Curve> = series
            .iter()
            .map(|&(number, key)| sweep(study, factor, number, key))
            .collect();
        let values = curves.iter().map(Curve::len);
        if values.max().unwrap_or(0) < 2 {
            continue;
        }
        let multiple = if factor.is_multiple() {
            "  × the robot's"
        } else {
            ""
        };
        let plot = Plot {
            title: format!("largest stable step over {}", factor.name()),
            width: 560.0,
            height: 400.0,
            x_label: format!("{}{multiple}", factor.name()),
            y_label: "largest stable step  [s]".to_owned(),
            curves,
            marks: foreign(study, factor),
            shared_y: shared_y.clone(),
            strip: "none".to_owned(),
        };
        figures += &figure("", &[], &plot, "");
    }
    out += &element("div", "pair", &figures);
    out
}

fn sweep(study: &Study, factor: Factor, number: usize, key: Series<'_>) -> Curve {
    let rows = study.rows.iter().filter(|row| row.series() == key);
    let mut rows: Vec<(f64, &Row)> = rows
        .filter_map(|row| Some((factor.of(&row.scales)?, row)))
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let title =
        |value: f64, row: &Row| format!("{} {}: {}", factor.name(), plain(value), rows::title(row));
    let point = |&(value, row): &(f64, &Row)| {
        Some(Point {
            x: value,
            y: limit_of(row)?,
            title: title(value, row),
            look: match (row.contradicts, row.wrong || unlimited(row)) {
                (true, _) => Look::Doubtful,
                (false, true) => Look::Hollow,
                (false, false) => Look::Plain,
            },
        })
    };
    let ended = |&(value, row): &(f64, &Row)| Ended {
        x: value,
        title: title(value, row),
        cut: row.cut,
    };
    let settings = rows
        .iter()
        .map(|row| Setting::of(point(row), || Some(ended(row))));
    Curve::through(number, false, settings)
}

/// Returns the marks of the results of the thesis.
fn foreign(study: &Study, factor: Factor) -> Vec<Mark> {
    if factor != Factor::Stiffness || study.commanded || study.ground {
        return Vec::new();
    }
    let figures = FIGURES.iter();
    let mark = |value: f64, step: f64, figure: &ThesisFigure| {
        Mark::At(
            value,
            step,
            format!("thesis, {}: {}", figure.model, si(step, "s")),
        )
    };
    figures
        .flat_map(|figure| {
            let quarter = figure.quarter_s.map(|step| mark(QUARTER, step, figure));
            [Some(mark(1.0, figure.step_s, figure)), quarter]
        })
        .flatten()
        .collect()
}

/// Returns a table row for each method at the unchanged scenario.
fn as_it_is(study: &Study) -> String {
    let mut table = HtmlTable::new(
        "plant | method | largest stable step | | accurate up to | feet, RMS | greatest \
         | fallbacks | time per step | speed |",
        2,
    );
    let mut before: Option<&Row> = None;
    for row in study.rows.iter().filter(|row| row.scales == Scales::AS_IS) {
        let first = before.is_some_and(|before| before.plant != row.plant);
        before = Some(row);
        table.row(
            match (first, row.status) {
                (true, Status::Ok) => "first",
                (false, Status::Ok) => "",
                _ => "bad",
            },
            vec![
                element("b", "", &escaped(&row.plant.label())),
                escaped(&row.series().method_label()),
                limit_cell(row),
                rows::status(row),
                rows::time(row.largest_right_step_s),
                rows::length(row.error_rms_m),
                rows::length(row.error_max_m),
                rows::count(row.fallbacks),
                rows::time(row.cost_per_step_s),
                rows::factor(row.real_time_factor),
                rows::why(row),
            ],
        );
    }
    table.html()
}

/// Returns the table of all searches.
fn all(study: &Study) -> String {
    let mut table = HtmlTable::new(
        "varied | value | plant | method | largest stable step | shortest unstable | \
         | accurate up to | feet, RMS | energy residual | fallbacks | time per step | speed \
         | probes |",
        1,
    );
    let mut before: Option<&Row> = None;
    for row in &study.rows {
        let first = before.is_some_and(|before| before.scales != row.scales);
        before = Some(row);
        let factor = Factor::ALL.into_iter().find_map(|factor| {
            let value = factor
                .of(&row.scales)
                .filter(|_| row.scales != Scales::AS_IS)?;
            Some((factor.name(), plain(value)))
        });
        let (name, value) = factor.unwrap_or(("nothing", String::new()));
        table.row(
            match (first, row.status) {
                (true, Status::Ok) => "first",
                (false, Status::Ok) => "",
                (true, _) => "first bad",
                (false, _) => "bad",
            },
            vec![
                name.to_owned(),
                value,
                escaped(&row.plant.label()),
                escaped(&row.series().method_label()),
                limit_cell(row),
                rows::time(row.least_unstable_step_s),
                rows::status(row),
                rows::time(row.largest_right_step_s),
                rows::length(row.error_rms_m),
                row.energy_residual_j
                    .map_or(String::new(), |joule| si(joule, "J")),
                rows::count(row.fallbacks),
                rows::time(row.cost_per_step_s),
                rows::factor(row.real_time_factor),
                rows::count(row.probes),
                rows::why(row),
            ],
        );
    }
    let table = table.html();
    format!(
        "<details open=\"open\"><summary>{} searches</summary>{table}</details>\n",
        study.rows.len()
    )
}
