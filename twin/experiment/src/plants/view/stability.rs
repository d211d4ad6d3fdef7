//! Page of a study of stability.

use twinrig_report::html::plot::{Curve, EndedRun, Look, Mark, Plot, Point, Setting};
use twinrig_report::number::{plain, si};
use twinrig_report::page::{Block, Card, Swatch};
use twinrig_report::table::{Column, Table};
use twinrig_rig::Scales;

use super::rows::{self, limit_cell, unlimited};
use super::thesis::{self, QUARTER};
use super::{commanded, error_control, figure, references, stiffness};
use crate::plants::factor::Factor;
use crate::plants::row::{Row, Series, Status};
use crate::plants::study::Study;
use crate::plants::thesis::{FIGURES, ThesisFigure};

pub(crate) fn blocks(study: &Study) -> Vec<Block> {
    let found = format!(
        "For each plant and method, the longest step at which the motion stays bounded over {}, \
         found by bisection as in the thesis (section 2.5.1), with one property of the robot or \
         the ground varied at a time. A stable step need not be accurate: at the limit, the feet \
         are compared with a reference, too. {}",
        si(study.simulated_s, "s"),
        commanded(study)
    );
    let mut out = vec![
        Block::Text(found),
        Block::Cards(cards(study)),
        Block::heading("What limits the step"),
    ];
    out.extend(sweeps(study));
    out.extend(stiffness::section(study));
    out.extend(error_control::section(study));
    out.extend([
        Block::heading("Unchanged scenario"),
        Block::Table(as_it_is(study)),
    ]);
    if !study.commanded && !study.ground {
        out.push(Block::heading("Comparison with the thesis"));
        out.extend(thesis::section(study));
    }
    out.extend([
        Block::heading("References"),
        Block::Table(references(&study.references)),
        Block::heading("All searches"),
        Block::Table(all(study)),
    ]);
    out
}

/// Returns the limit of a row, if it has one.
fn limit_of(row: &Row) -> Option<f64> {
    row.largest_stable_step_s
        .filter(|_| row.status == Status::Ok)
}

fn cards(study: &Study) -> Vec<Card> {
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
    let mut out = Vec::new();
    out.extend(longest.map(|row| {
        let what = "longest stable step, unchanged scenario";
        Card::new(what, bound(row), name(row))
    }));
    out.extend(longest_accurate.map(|row| {
        let step = si(accurate(&row), "s");
        Card::new("longest accurate step", step, name(row))
    }));
    let shortest = sound().min_by(|a, b| limit(a).total_cmp(&limit(b)));
    out.extend(shortest.map(|row| Card::new("smallest limit of a method", bound(row), name(row))));
    let wrong = study.rows.iter().filter(|row| row.wrong).count();
    let failed = study
        .rows
        .iter()
        .filter(|row| row.status != Status::Ok)
        .count();
    let more = format!("{wrong} stable but wrong at the limit, {failed} without a limit");
    out.push(Card::new("searches", study.rows.len().to_string(), more));
    out
}

/// Returns a plot for each factor.
fn sweeps(study: &Study) -> [Block; 3] {
    // Adaptive methods have no limit.
    let series = study.numbered_series().into_iter();
    let series: Vec<(usize, Series<'_>)> = series.filter(|(_, key)| !key.is_adaptive()).collect();
    let mut legend: Vec<(Swatch, String)> = series
        .iter()
        .map(|&(number, key)| (Swatch::Curve(number), key.name()))
        .collect();
    if !study.commanded && !study.ground {
        legend.push((Swatch::Foreign, "thesis".to_owned()));
    }
    let looks = "Filled: accurate at the limit. Hollow: stable but wrong, or the longest step \
                 tried. In the strip: no stable step found.";
    let shared_y: Vec<f64> = study.rows.iter().filter_map(limit_of).collect();
    let mut figures = Vec::new();
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
        figures.push(figure("", Vec::new(), &plot, ""));
    }
    [
        Block::Legend(legend),
        Block::text(looks),
        Block::Figures(figures),
    ]
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
    let ended = |&(value, row): &(f64, &Row)| EndedRun {
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
pub(crate) fn as_it_is(study: &Study) -> Table {
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        Column::number("largest stable step"),
        Column::status(""),
        Column::number("accurate up to").in_unit("s"),
        Column::number("feet, RMS").in_unit("m"),
        Column::number("greatest").in_unit("m").only_on_pages(),
        Column::number("fallbacks").only_on_pages(),
        Column::number("time per step").in_unit("s"),
        Column::number("speed").only_on_pages(),
        Column::reason().only_on_pages(),
    ]);
    let mut before: Option<&Row> = None;
    for row in study.rows.iter().filter(|row| row.scales == Scales::AS_IS) {
        table.row([
            row.plant.label().into(),
            row.series().method_label().into(),
            limit_cell(row).into(),
            rows::status(row),
            row.largest_right_step_s.into(),
            row.error_rms_m.into(),
            row.error_max_m.into(),
            rows::count(row.fallbacks).into(),
            row.cost_per_step_s.into(),
            rows::factor(row.real_time_factor).into(),
            row.why.clone().into(),
        ]);
        let first = before.is_some_and(|before| before.plant != row.plant);
        rows::mark(&mut table, first, row.status, row.cut);
        before = Some(row);
    }
    table
}

/// Returns the table of all searches.
fn all(study: &Study) -> Table {
    let mut table = Table::new([
        Column::text("varied"),
        Column::number("value"),
        Column::label("plant"),
        Column::text("method"),
        Column::number("largest stable step"),
        Column::number("shortest unstable").in_unit("s"),
        Column::status(""),
        Column::number("accurate up to").in_unit("s"),
        Column::number("feet, RMS").in_unit("m"),
        Column::number("energy residual").in_unit("J"),
        Column::number("fallbacks"),
        Column::number("time per step").in_unit("s"),
        Column::number("speed"),
        Column::number("probes"),
        Column::reason(),
    ]);
    let mut before: Option<&Row> = None;
    for row in &study.rows {
        let varied = Factor::ALL.into_iter().find_map(|factor| {
            let value = factor
                .of(&row.scales)
                .filter(|_| row.scales != Scales::AS_IS)?;
            Some((factor.name(), plain(value)))
        });
        let (name, value) = varied.unwrap_or(("nothing", String::new()));
        table.row([
            name.into(),
            value.into(),
            row.plant.label().into(),
            row.series().method_label().into(),
            limit_cell(row).into(),
            row.least_unstable_step_s.into(),
            rows::status(row),
            row.largest_right_step_s.into(),
            row.error_rms_m.into(),
            row.energy_residual_j.into(),
            rows::count(row.fallbacks).into(),
            row.cost_per_step_s.into(),
            rows::factor(row.real_time_factor).into(),
            rows::count(row.probes).into(),
            row.why.clone().into(),
        ]);
        let first = before.is_some_and(|before| before.scales != row.scales);
        rows::mark(&mut table, first, row.status, row.cut);
        before = Some(row);
    }
    table
}
