//! Page section that compares a plant with others that solve the same model.

use crate::dominance::{Comparison, Competitor, Dominance};
use crate::headline::{dominance_sentence, spread};
use crate::row::{Row, RowKind, Status};
use crate::study::Study;
use twinrig_report::number::{grouped_factor, method_setting, si};

use super::error_axis::{LEAST_M, floor};
use super::figure;
use super::rows;
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::plot::{Curve, Look, Plot, Point, Setting};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: run times at equal or smaller error.
pub(crate) fn section(study: &Study) -> String {
    let all = study.dominances();
    let sections: Vec<String> = all.iter().map(|one| of_plant(study, one)).collect();
    if sections.is_empty() {
        return String::new();
    }
    "<h2>Own plants and engines</h2>\n".to_owned() + &sections.concat()
}

fn of_plant(study: &Study, dominance: &Dominance) -> String {
    let of = &dominance.of;
    let mut out = paragraph(&dominance_sentence(dominance));
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
    out += &paragraph(&format!(
        "{} {relation}. The best settings of a plant are those that no other of its settings \
         surpasses, by any method, steps of the engine alone included. All run times are from this \
         run of the study.",
        names(&dominance.over),
    ));
    out += &fronts(study, dominance);
    out += &by_method(study, dominance);
    out += &behind(study, dominance);
    out
}

fn names(plants: &[String]) -> String {
    match plants {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        _ => plants.concat(),
    }
}

/// Returns the plot of the Pareto fronts of the plants in error and run time.
fn fronts(study: &Study, dominance: &Dominance) -> String {
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
    let entries: Vec<(String, String)> = plants()
        .enumerate()
        .map(|(number, plant)| (swatch(number, false), plant.clone()))
        .collect();
    let caption = "The settings of each plant, over all its methods, that no other of its \
                   settings surpasses in both error and run time. A plant whose curve lies below \
                   and to the left of another's is ahead of it.";
    figure("Pareto front of each plant", &entries, &plot, caption)
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
fn by_method(study: &Study, dominance: &Dominance) -> String {
    let of = &dominance.of;
    let head = format!(
        "plant | method | {of} ahead at | less time at no greater error | its smallest RMS \
         | levels off from | less time than at that RMS | less error at no more time"
    );
    let mut table = HtmlTable::new(&head, 2);
    let floors = study.floors();
    let mut before: Option<(&str, &str)> = None;
    for comparison in &dominance.settings {
        let method = (&*comparison.plant, &*comparison.method);
        if before == Some(method) {
            continue;
        }
        let first = before.is_some_and(|(plant, _)| plant != comparison.plant);
        before = Some(method);
        let settings_of_method = || {
            let settings = dominance.settings.iter();
            settings.filter(|comparison| (&*comparison.plant, &*comparison.method) == method)
        };
        let won = settings_of_method()
            .filter(|comparison| comparison.is_won())
            .count();
        let range = dominance.range(method.0, Some(method.1));
        let best = settings_of_method().min_by(|a, b| a.error_rms_m.total_cmp(&b.error_rms_m));
        let best = best.unwrap_or(comparison);
        let levels = floors
            .iter()
            .find(|floor| floor.plant == method.0 && floor.method == method.1);
        let closer = best.no_greater_error.as_ref();
        let faster = best.no_more_time.as_ref();
        table.row(
            if first { "first" } else { "" },
            vec![
                element("b", "", &escaped(method.0)),
                escaped(method.1),
                format!("{won} of {}", settings_of_method().count()),
                range.map_or("none".to_owned(), |(least, most)| spread(least, most)),
                with_detail(
                    &si(best.error_rms_m, "m"),
                    &setting(best.step_s, best.tolerance),
                ),
                levels.map_or(String::new(), |floor| rows::time(floor.levels_off_from_s)),
                closer.map_or("none".to_owned(), |competitor| {
                    with_detail(
                        &grouped_factor(competitor.times_less_time),
                        &name(competitor),
                    )
                }),
                faster.map_or("none".to_owned(), |competitor| {
                    let error = si(competitor.error_rms_m, "m");
                    let factor = grouped_factor(competitor.times_less_error);
                    with_detail(&factor, &format!("{}: {error}", name(competitor)))
                }),
            ],
        );
    }
    table.html()
        + &paragraph(
            "The last two columns give the settings that surpass the most accurate setting of \
             the method: the fastest with no greater error, and the most accurate with no longer \
             run time. A method levels off where shorter steps, down to at most a quarter of \
             the length, no longer halve its error: the remaining error, such as the softness of \
             the engine, does not depend on the step.",
        )
}

/// Formats a figure with a detail below it.
fn with_detail(figure: &str, more: &str) -> String {
    format!("{figure}<br/>{}", element("span", "soft", more))
}

fn setting(step_s: Option<f64>, tolerance: Option<f64>) -> String {
    method_setting(step_s, tolerance)
}

fn name(competitor: &Competitor) -> String {
    let setting = setting(competitor.step_s, competitor.tolerance);
    format!("{}, {setting}", escaped(&competitor.method))
}

/// Returns the table of the settings at which the plant is not ahead, with their counts.
fn behind(study: &Study, dominance: &Dominance) -> String {
    let of = &dominance.of;
    let head = format!(
        "plant | setting | RMS | run time | {of}, no greater error | RMS | run time \
         | × less time |"
    );
    let mut table = HtmlTable::new(&head, 2);
    for comparison in dominance.behind() {
        let competitor = comparison.no_greater_error.as_ref();
        table.row(
            "",
            vec![
                element("b", "", &escaped(&comparison.plant)),
                format!(
                    "{}, {}",
                    escaped(&comparison.method),
                    setting(comparison.step_s, comparison.tolerance)
                ),
                si(comparison.error_rms_m, "m"),
                si(comparison.run_s_per_simulated_s, "s/s"),
                competitor.map_or("none".to_owned(), name),
                competitor.map_or(String::new(), |competitor| si(competitor.error_rms_m, "m")),
                competitor.map_or(String::new(), |competitor| {
                    si(competitor.run_s_per_simulated_s, "s/s")
                }),
                competitor.map_or(String::new(), |competitor| {
                    grouped_factor(competitor.times_less_time)
                }),
                element("span", "why", &escaped(&counts(study, of, comparison))),
            ],
        );
    }
    if dominance.behind().next().is_none() {
        return String::new();
    }
    format!("<h3>Where {} is not ahead</h3>\n", escaped(of)) + &table.html()
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
