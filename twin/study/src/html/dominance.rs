//! The part of a page that sets a plant against those that solve its model by other means.

use crate::dominance::{Comparison, Competitor, Dominance};
use crate::headline::dominance_sentence;
use crate::number::{grouped_factor, method_setting, si};
use crate::row::{Row, RowKind, Status};
use crate::study::Study;

use super::plot::{Curve, Look, Plot, Point, Setting};
use super::rows;
use super::shape::swatch;
use super::table::Table;
use super::text::{element, escaped, paragraph};
use super::{figure, precision};

/// Who is faster at no greater error, and where not.
pub(crate) fn section(study: &Study) -> String {
    let all = study.dominances();
    let sections: Vec<String> = all.iter().map(|one| of_plant(study, one)).collect();
    if sections.is_empty() {
        return String::new();
    }
    "<h2>One model, several engines</h2>\n".to_owned() + &sections.concat()
}

fn of_plant(study: &Study, dominance: &Dominance) -> String {
    let of = &dominance.of;
    let mut out = paragraph(&dominance_sentence(dominance));
    out += &paragraph(&format!(
        "{} {} the model of {of} by other means, so the same reference holds for all, and what an engine gets wrong at every \
         step is an error like any other. All run times are of this run of the study.",
        names(&dominance.over),
        if dominance.over.len() == 1 {
            "solves"
        } else {
            "solve"
        }
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

/// The settings of each plant that none of its own beats in both.
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
        title: "the best of each plant".to_owned(),
        width: 1080.0,
        height: 420.0,
        x_label: "run time per simulated second  [s/s]".to_owned(),
        y_label: "distance of the feet from the reference, RMS  [m]".to_owned(),
        curves: curves.collect(),
        marks: vec![precision::floor(study)],
        beside: Vec::new(),
        strip: String::new(),
    };
    let entries: Vec<(String, String)> = plants()
        .enumerate()
        .map(|(number, plant)| (swatch(number, false), plant.clone()))
        .collect();
    let caption = "The settings of each plant, of whichever method, that no other of its own beats in error and run time at once. A \
                   plant whose curve lies below and to the left of another's is ahead of it.";
    figure("The best of each plant", &entries, &plot, caption)
}

fn front(study: &Study, plant: &str) -> Vec<Point> {
    let rows = precision::integration(study);
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
        y: error.max(precision::LEAST_M),
        title: rows::title(row),
        look: if row.at_floor {
            Look::Hollow
        } else {
            Look::Plain
        },
    });
    points.collect()
}

/// A line for each method of the others: its best, and what does better.
fn by_method(study: &Study, dominance: &Dominance) -> String {
    let of = &dominance.of;
    let mut table = Table::new(
        &[
            "plant",
            "method",
            &format!("{of} ahead at"),
            "less time at no greater error",
            "its smallest RMS",
            "levels off from",
            "less time, no further off",
            "less error, no slower",
        ],
        2,
    );
    let floors = study.floors();
    let mut before: Option<(&str, &str)> = None;
    for comparison in &dominance.settings {
        let method = (&*comparison.plant, &*comparison.method);
        if before == Some(method) {
            continue;
        }
        let first = before.is_some_and(|(plant, _)| plant != comparison.plant);
        before = Some(method);
        let ours = || {
            let settings = dominance.settings.iter();
            settings.filter(|comparison| (&*comparison.plant, &*comparison.method) == method)
        };
        let won = ours().filter(|comparison| comparison.is_won()).count();
        let range = dominance.range(method.0, Some(method.1));
        let best = ours().min_by(|a, b| a.error_rms_m.total_cmp(&b.error_rms_m));
        let best = best.unwrap_or(comparison);
        let levels = floors
            .iter()
            .find(|floor| (&*floor.plant, &*floor.method) == method);
        let closer = best.no_greater_error.as_ref();
        let faster = best.no_more_time.as_ref();
        table.row(
            if first { "first" } else { "" },
            vec![
                element("b", "", &escaped(method.0)),
                escaped(method.1),
                format!("{won} of {}", ours().count()),
                range.map_or("none".to_owned(), |(least, most)| spread(least, most)),
                beside(
                    &si(best.error_rms_m, "m"),
                    &setting(best.step_s, best.tolerance),
                ),
                levels.map_or(String::new(), |floor| rows::time(floor.levels_off_from_s)),
                closer.map_or("none".to_owned(), |rival| {
                    beside(&grouped_factor(rival.times_less_time), &name(rival))
                }),
                faster.map_or("none".to_owned(), |rival| {
                    let error = si(rival.error_rms_m, "m");
                    let factor = grouped_factor(rival.times_less_error);
                    beside(&factor, &format!("{}: {error}", name(rival)))
                }),
            ],
        );
    }
    table.html()
        + &paragraph(
            "To the right, what does better than the smallest error of the method: the fastest setting that is no further from the \
             reference, and the closest that takes no more time. A method levels off where shorter steps, though there are some a \
             quarter as long, do not halve its error any more: that is the engine's own softness, or whatever else of it does not \
             go with the step.",
        )
}

/// A figure, and what belongs to it.
fn beside(figure: &str, more: &str) -> String {
    format!("{figure}<br/>{}", element("span", "soft", more))
}

/// `3.1 × to 40 ×`
fn spread(least: f64, most: f64) -> String {
    let [least, most] = [least, most].map(grouped_factor);
    if least == most {
        least
    } else {
        format!("{least} to {most}")
    }
}

fn setting(step_s: Option<f64>, tolerance: Option<f64>) -> String {
    method_setting(step_s, tolerance)
}

fn name(rival: &Competitor) -> String {
    let setting = setting(rival.step_s, rival.tolerance);
    format!("{}, {setting}", escaped(&rival.method))
}

/// Where it is not ahead, with what was counted there.
fn behind(study: &Study, dominance: &Dominance) -> String {
    let of = &dominance.of;
    let mut table = Table::new(
        &[
            "plant",
            "set to",
            "RMS",
            "run time",
            &format!("{of}, no further off"),
            "RMS",
            "run time",
            "× less time",
            "",
        ],
        2,
    );
    for comparison in dominance.behind() {
        let rival = comparison.no_greater_error.as_ref();
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
                rival.map_or("none".to_owned(), name),
                rival.map_or(String::new(), |rival| si(rival.error_rms_m, "m")),
                rival.map_or(String::new(), |rival| {
                    si(rival.run_s_per_simulated_s, "s/s")
                }),
                rival.map_or(String::new(), |rival| grouped_factor(rival.times_less_time)),
                element("span", "why", &escaped(&counts(study, of, comparison))),
            ],
        );
    }
    if dominance.behind().next().is_none() {
        return String::new();
    }
    format!("<h3>Where {} is not ahead</h3>\n", escaped(of)) + &table.html()
}

/// What was counted of both sides of a duel: why one is slower shows there or nowhere.
fn counts(study: &Study, of: &str, comparison: &Comparison) -> String {
    let find = |plant: &str, method: &str, step: Option<f64>, tolerance: Option<f64>| {
        let mut rows = study.rows.iter();
        rows.find(|row| {
            row.kind == RowKind::Integration
                && (&*row.plant, &*row.method) == (plant, method)
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
        None => parts.push(format!("no setting of {of} comes as close")),
        Some(rival) => {
            let row = find(of, &rival.method, rival.step_s, rival.tolerance);
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
        (Some(events), _) => parts.push(format!("{events} events found")),
        (None, Some(expected)) => parts.push(format!("looks for none of {expected} events")),
        (None, None) => {}
    }
    if let Some(count) = row.fallbacks.filter(|&count| count > 0) {
        parts.push(format!("{count} steps handed over"));
    }
    if let Some(count) = row.solver_iterations.filter(|&count| count > 0) {
        parts.push(format!("{count} iterations of the contact solver"));
    }
    parts.join(", ")
}
