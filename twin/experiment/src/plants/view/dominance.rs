//! Page section that compares a plant with others that solve the same model.

use twinrig_report::html::plot::{Curve, Look, Plot, Point, Setting};
use twinrig_report::number::{grouped_factor, method_setting, si};
use twinrig_report::page::{Block, Swatch};
use twinrig_report::table::{Cell, Column, Table};

use super::error_axis::{LEAST_M, floor};
use super::{figure, rows};
use crate::plants::dominance::{Comparison, Competitor, Dominance};
use crate::plants::headline::{dominance_sentence, spread};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::Study;

/// Returns the section: run times at equal or smaller error.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let all = study.dominances();
    let sections = all.iter().flat_map(|one| of_plant(study, one));
    let mut out: Vec<Block> = sections.collect();
    if !out.is_empty() {
        out.insert(0, Block::heading("Own plants and engines"));
    }
    out
}

fn of_plant(study: &Study, dominance: &Dominance) -> Vec<Block> {
    let of = &dominance.of;
    let verb = |one, many| if dominance.over.len() == 1 { one } else { many };
    let relation = if dominance.own_references {
        let has = verb("has a model", "have models");
        format!(
            "{has} similar to that of {of}, with other forces of stops and contacts; each is \
             compared with its own reference, so that differences of the models do not count"
        )
    } else {
        format!(
            "{} the model of {of} with a different engine, so all share one reference, and an \
             error that an engine makes at every step counts as any other",
            verb("solves", "solve")
        )
    };
    let method = format!(
        "{} {relation}. The best settings of a plant are those that no other of its settings \
         surpasses, by any method, steps of the engine alone included. All run times are from this \
         run of the study.",
        names(&dominance.over),
    );
    let mut out = vec![
        Block::Text(dominance_sentence(dominance)),
        Block::Text(method),
        fronts(study, dominance),
        Block::Table(by_method(study, dominance)),
        Block::text(
            "The last two columns give the settings that surpass the most accurate setting of \
             the method: the fastest with no greater error, and the most accurate with no longer \
             run time. A method levels off where shorter steps, down to at most a quarter of \
             the length, no longer halve its error: the remaining error, such as the softness of \
             the engine, does not depend on the step.",
        ),
    ];
    if dominance.behind().next().is_some() {
        out.push(Block::Subheading(format!("Where {of} is not ahead")));
        out.push(Block::Table(behind(study, dominance)));
    }
    out
}

fn names(plants: &[String]) -> String {
    match plants {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        _ => plants.concat(),
    }
}

/// Returns the plot of the Pareto fronts of the plants in error and run time.
fn fronts(study: &Study, dominance: &Dominance) -> Block {
    let plants = || std::iter::once(&dominance.of).chain(&dominance.over);
    let curves = plants().enumerate().map(|(number, plant)| {
        Curve::through(
            number,
            false,
            front(study, plant).into_iter().map(Setting::Point),
        )
    });
    let plot = Plot {
        title: "Pareto front of each plant".to_owned(),
        width: 1080.0,
        height: 420.0,
        x_label: "run time per simulated second  [s/s]".to_owned(),
        y_label: "distance of the feet from the reference, RMS  [m]".to_owned(),
        curves: curves.collect(),
        marks: vec![floor(study)],
        shared_y: Vec::new(),
        strip: String::new(),
    };
    let legend = plants().enumerate();
    let legend = legend.map(|(number, plant)| (Swatch::Curve(number), plant.clone()));
    let caption = "The settings of each plant, over all its methods, that no other of its \
                   settings surpasses in both error and run time. A plant whose curve lies below \
                   and to the left of another's is ahead of it.";
    let heading = "Pareto front of each plant";
    Block::Figure(figure(heading, legend.collect(), &plot, caption))
}

fn front(study: &Study, plant: &str) -> Vec<Point> {
    let rows = rows::integration(study);
    let mut rows: Vec<(f64, f64, &Row)> = rows
        .filter(|row| row.plant == plant && row.status == Status::Ok)
        .filter_map(|row| Some((row.run_s_per_simulated_s?, row.error_rms_m?, row)))
        .filter(|&(cost, ..)| cost > 0.0)
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    rows.retain(|&(_, error, _)| {
        let better = error < least;
        least = least.min(error);
        better
    });
    let points = rows.iter().map(|&(cost, error, row)| Point {
        x: cost,
        y: error.max(LEAST_M),
        title: rows::title(row),
        look: if row.at_floor {
            Look::Hollow
        } else {
            Look::Plain
        },
    });
    points.collect()
}

/// Returns a table row for each method of the compared plants: its most accurate setting, and the
/// settings that are better.
fn by_method(study: &Study, dominance: &Dominance) -> Table {
    let of = &dominance.of;
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        Column::number(format!("{of} ahead at")),
        Column::number("less time at no greater error"),
        Column::number("its smallest RMS").in_unit("m"),
        Column::number("levels off from").in_unit("s"),
        Column::number("less time than at that RMS"),
        Column::number("less error at no more time"),
    ]);
    let floors = study.floors();
    let mut before: Option<(&str, &str)> = None;
    for comparison in &dominance.settings {
        let method = (&*comparison.plant, &*comparison.method);
        if before == Some(method) {
            continue;
        }
        let of_method = |one: &&Comparison| (&*one.plant, &*one.method) == method;
        let settings = || dominance.settings.iter().filter(of_method);
        let won = settings().filter(|comparison| comparison.is_won()).count();
        let range = dominance.range(method.0, Some(method.1));
        let range = range.map_or("none".to_owned(), |(least, most)| spread(least, most));
        let best = settings().min_by(|a, b| a.error_rms_m.total_cmp(&b.error_rms_m));
        let best = best.unwrap_or(comparison);
        let levels = floors
            .iter()
            .find(|floor| floor.plant == method.0 && floor.method == method.1);
        table.row([
            method.0.into(),
            method.1.into(),
            format!("{won} of {}", settings().count()).into(),
            range.into(),
            Cell::from(best.error_rms_m).with_detail(method_setting(best.step_s, best.tolerance)),
            levels.and_then(|floor| floor.levels_off_from_s).into(),
            faster_than(best),
            closer_than(best),
        ]);
        if before.is_some_and(|(plant, _)| plant != comparison.plant) {
            table.begin_group();
        }
        before = Some(method);
    }
    table
}

/// Returns the fastest setting with no greater error.
fn faster_than(best: &Comparison) -> Cell {
    match &best.no_greater_error {
        None => "none".into(),
        Some(other) => Cell::from(grouped_factor(other.times_less_time)).with_detail(name(other)),
    }
}

/// Returns the most accurate setting with no longer run time.
fn closer_than(best: &Comparison) -> Cell {
    match &best.no_more_time {
        None => "none".into(),
        Some(other) => {
            let detail = format!("{}: {}", name(other), si(other.error_rms_m, "m"));
            Cell::from(grouped_factor(other.times_less_error)).with_detail(detail)
        }
    }
}

fn name(competitor: &Competitor) -> String {
    let setting = method_setting(competitor.step_s, competitor.tolerance);
    format!("{}, {setting}", competitor.method)
}

/// Returns the table of the settings at which the plant is not ahead, with their counts.
fn behind(study: &Study, dominance: &Dominance) -> Table {
    let of = &dominance.of;
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("setting"),
        Column::number("RMS").in_unit("m"),
        Column::number("run time").in_unit("s/s"),
        Column::text(format!("{of}, no greater error")),
        Column::number("RMS").in_unit("m"),
        Column::number("run time").in_unit("s/s"),
        Column::number("× less time"),
        Column::reason(),
    ]);
    for comparison in dominance.behind() {
        let competitor = comparison.no_greater_error.as_ref();
        let setting = method_setting(comparison.step_s, comparison.tolerance);
        table.row([
            comparison.plant.as_str().into(),
            format!("{}, {setting}", comparison.method).into(),
            comparison.error_rms_m.into(),
            comparison.run_s_per_simulated_s.into(),
            competitor.map_or("none".to_owned(), name).into(),
            competitor.map(|competitor| competitor.error_rms_m).into(),
            competitor
                .map(|competitor| competitor.run_s_per_simulated_s)
                .into(),
            competitor
                .map(|competitor| grouped_factor(competitor.times_less_time))
                .into(),
            counts(study, of, comparison).into(),
        ]);
    }
    table
}

/// Returns the counts of both settings of a comparison, which may explain the difference in speed.
fn counts(study: &Study, of: &str, comparison: &Comparison) -> String {
    let find = |plant: &str, method: &str, step: Option<f64>, tolerance: Option<f64>| {
        let mut rows = study.rows.iter();
        rows.find(|row| {
            row.kind == RowKind::Integration
                && row.plant == plant
                && row.method == method
                && (row.step_s, row.tolerance) == (step, tolerance)
        })
    };
    let own = find(
        &comparison.plant,
        &comparison.method,
        comparison.step_s,
        comparison.tolerance,
    );
    let mut parts: Vec<String> = Vec::new();
    parts.extend(own.map(|row| format!("{}: {}", comparison.plant, counted(row))));
    match &comparison.no_greater_error {
        None => parts.push(format!("no setting of {of} is as accurate")),
        Some(competitor) => {
            let row = find(
                of,
                &competitor.method,
                competitor.step_s,
                competitor.tolerance,
            );
            parts.extend(row.map(|row| format!("{of}: {}", counted(row))));
        }
    }
    parts.join("; ")
}

fn counted(row: &Row) -> String {
    let mut parts = Vec::new();
    if let (Some(steps), Some(cost)) = (row.steps, row.cost_per_step_s) {
        parts.push(format!("{steps} steps of {} each", si(cost, "s")));
    }
    match (row.events, row.events_expected) {
        (Some(events), _) => parts.push(format!("{events} events located")),
        (None, Some(expected)) => parts.push(format!("locates none of {expected} events")),
        (None, None) => {}
    }
    if let Some(count) = row.fallbacks.filter(|&count| count > 0) {
        parts.push(format!("{count} fallbacks"));
    }
    if let Some(count) = row.solver_iterations.filter(|&count| count > 0) {
        parts.push(format!("{count} iterations of the contact solver"));
    }
    parts.join(", ")
}
