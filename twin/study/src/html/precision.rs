//! The page of a study of precision.

use crate::row::{Row, RowKind, Status};
use crate::study::Study;

use super::plot::{Curve, Look, Mark, Plot, Point, swatch};
use super::rows;
use super::table::Table;
use super::text::{element, escaped, paragraph};
use super::{card, commanded, figure, lead, models, references};
use crate::number::si;

/// The step that plants are used at, and what is aimed for there.
const USUAL_STEP_S: f64 = 2e-3;
const AIM_M: f64 = 1e-6;
const AIM_FACTOR: f64 = 1000.0;

/// The smallest error that has a place on a logarithmic scale \[m\].
pub(crate) const LEAST_M: f64 = 1e-16;

pub(crate) fn body(study: &Study) -> String {
    let compared = format!(
        "Every plant is led through the first {} of the scene by each of its methods at each setting, and where its feet are is \
         compared every {} with a reference of the same plant. {}",
        si(study.simulated_s, "s"),
        si(study.grid_s, "s"),
        commanded(study)
    );
    let mut out = lead(&compared);
    out += &cards(study);
    out += "<h2>Error against run time</h2>\n";
    out += &cost(study);
    out += "<h2>Error against step</h2>\n";
    out += &convergence(study);
    out += "<h2>The methods, side by side</h2>\n";
    out += &summary(study);
    out += "<h2>What they are measured against</h2>\n";
    out += &paragraph(
        "The reference of a plant is its best method at its finest setting, checked by a second one. Errors below the \
         disagreement of the two are at the floor: less is not known of them.",
    );
    out += &references(study);
    out += &models::section(study);
    out += "<h2>All runs</h2>\n";
    out += &all(study);
    out
}

fn integration(study: &Study) -> impl Iterator<Item = &Row> {
    study
        .rows
        .iter()
        .filter(|row| row.kind == RowKind::Integration)
}

fn of_curve<'a>(study: &'a Study, curve: (&'a str, &'a str)) -> impl Iterator<Item = &'a Row> {
    integration(study).filter(move |row| row.curve() == curve)
}

fn at_usual_step(row: &Row) -> bool {
    row.step_s
        .is_some_and(|step| (step / USUAL_STEP_S - 1.0).abs() < 1e-9)
}

/// The best at the usual step, the best within the aim, the most precise of all.
fn cards(study: &Study) -> String {
    let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
    let sound =
        || integration(study).filter(|row| row.status == Status::Ok && row.error_rms_m.is_some());
    let name = |row: &Row| format!("{} {}, {}", row.plant, row.method, rows::setting(row));
    let speed = |row: &Row| format!("{} real time", rows::factor(row.real_time_factor));
    let mut out = String::new();
    let usual = sound().filter(|row| at_usual_step(row));
    if let Some(row) = usual.min_by(|a, b| error(a).total_cmp(&error(b))) {
        let what = format!("smallest error at {}", si(USUAL_STEP_S, "s"));
        let more = format!("{}; {}", name(row), speed(row));
        out += &card(&what, &rows::length(row.error_rms_m), &more);
    }
    let aim = sound().filter(|row| error(row) <= AIM_M);
    let fastest = aim.max_by(|a, b| {
        let speed = |row: &&Row| row.real_time_factor.unwrap_or(0.0);
        speed(a).total_cmp(&speed(b))
    });
    let what = format!("fastest with an error of at most {}", si(AIM_M, "m"));
    out += &match fastest {
        Some(row) => {
            let more = format!("{}; {}", name(row), rows::length(row.error_rms_m));
            card(&what, &speed(row), &more)
        }
        None => card(&what, "none", "no run came that close"),
    };
    let not: Vec<&Row> = integration(study)
        .filter(|row| row.status != Status::Ok)
        .collect();
    let count = integration(study).count();
    let more = if not.is_empty() {
        "all came to the end of the scene".to_owned()
    } else {
        format!(
            "{} did not come to the end of the scene: see the strip",
            not.len()
        )
    };
    out += &card("runs", &count.to_string(), &more);
    element("div", "cards", &out)
}

fn entries(study: &Study, of: impl Fn(&(&str, &str)) -> bool) -> Vec<(String, String)> {
    let orders = study.orders();
    let curves = study.curves().into_iter().enumerate();
    curves
        .filter(|(_, curve)| of(curve))
        .map(|(number, (plant, method))| {
            let order = orders
                .iter()
                .find(|order| order.plant == plant && order.method == method);
            let order = order.map_or(String::new(), |order| format!(", order {:.1}", order.order));
            (swatch(number, false), format!("{plant} {method}{order}"))
        })
        .collect()
}

/// The place of a row on a plot. What is below the floor stands just below it: where exactly is chance.
fn point(study: &Study, row: &Row, x: f64) -> Option<Point> {
    /// Of the floor.
    const BELOW: f64 = 0.5;
    let error = row.error_rms_m.filter(|_| row.status == Status::Ok)?;
    let floor = study.floor_of(&row.plant);
    Some(Point {
        x,
        y: error.max(BELOW * floor).max(LEAST_M),
        title: rows::title(row),
        look: match (row.at_floor, at_usual_step(row)) {
            (true, _) => Look::Hollow,
            (false, true) => Look::Marked,
            (false, false) => Look::Plain,
        },
    })
}

/// Error over run time.
fn cost(study: &Study) -> String {
    let curves = study
        .curves()
        .into_iter()
        .enumerate()
        .map(|(number, curve)| {
            let cost = |row: &Row| row.run_s_per_simulated_s.filter(|&cost| cost > 0.0);
            let failed = of_curve(study, curve).filter(|row| row.status != Status::Ok);
            Curve {
                number,
                dashed: false,
                points: of_curve(study, curve)
                    .filter_map(|row| point(study, row, cost(row)?))
                    .collect(),
                failed: failed
                    .filter_map(|row| Some((cost(row)?, failure(row))))
                    .collect(),
            }
        });
    let plot = Plot {
        title: "error of the feet over run time".to_owned(),
        width: 1080.0,
        height: 600.0,
        x_label: "run time per simulated second  [s/s]".to_owned(),
        y_label: "distance of the feet from the reference, RMS  [m]".to_owned(),
        curves: curves.collect(),
        marks: vec![
            Mark::Across(1.0, "real time".to_owned()),
            Mark::Across(1.0 / AIM_FACTOR, format!("{AIM_FACTOR} × real time")),
            Mark::Along(AIM_M, "aim: 10⁻⁶ m".to_owned()),
            floor(study),
        ],
        beside: Vec::new(),
        strip: "failed".to_owned(),
    };
    let unplaced = integration(study)
        .filter(|row| row.status != Status::Ok && row.run_s_per_simulated_s.is_none())
        .count();
    let unplaced = match unplaced {
        0 => String::new(),
        1 => " One run did not begin or was cut, and has no place there; it is in the table."
            .to_owned(),
        count => format!(
            " {count} runs did not begin or were cut, and have no place there; they are in the table."
        ),
    };
    let caption = format!(
        "Down and to the left is better. A point is a step or a tolerance, finer ones further down; the large ones are steps of \
         {}, hollow ones are at the floor. Crosses in the strip at the top are runs that failed or became unstable, at the run time they took by then.{unplaced} \
         Point at anything to see what it is.",
        si(USUAL_STEP_S, "s")
    );
    figure("", &entries(study, |_| true), &plot, &caption)
}

/// What is not known of the reference.
fn floor(study: &Study) -> Mark {
    let reference = study.reference();
    let plant = reference.map_or("", |note| note.plant.as_str());
    Mark::Below(
        study.floor_of(plant),
        format!("floor: the references of {plant} disagree by so much"),
    )
}

fn failure(row: &Row) -> String {
    format!("{}: {}", row.status.word(), rows::title(row))
}

/// Error over step, and what order that is.
fn convergence(study: &Study) -> String {
    let stepped = |curve: &(&str, &str)| of_curve(study, *curve).any(|row| row.step_s.is_some());
    let curves = study.curves().into_iter().enumerate();
    let curves = curves
        .filter(|(_, curve)| stepped(curve))
        .map(|(number, curve)| {
            let failed = of_curve(study, curve).filter(|row| row.status != Status::Ok);
            Curve {
                number,
                dashed: false,
                points: of_curve(study, curve)
                    .filter_map(|row| point(study, row, row.step_s?))
                    .collect(),
                failed: failed
                    .filter_map(|row| Some((row.step_s?, failure(row))))
                    .collect(),
            }
        });
    let plot = Plot {
        title: "error of the feet over step".to_owned(),
        width: 1080.0,
        height: 470.0,
        x_label: "step  [s]".to_owned(),
        y_label: "distance of the feet, RMS  [m]".to_owned(),
        curves: curves.collect(),
        marks: vec![Mark::Along(AIM_M, "aim: 10⁻⁶ m".to_owned()), floor(study)],
        beside: Vec::new(),
        strip: "failed".to_owned(),
    };
    let caption = "The slope of a curve is the order of its method: by how many powers of ten its error falls with one of its step.";
    figure("", &entries(study, stepped), &plot, caption)
}

/// A line for each method.
fn summary(study: &Study) -> String {
    let step = si(USUAL_STEP_S, "s");
    let mut table = Table::new(
        &[
            "plant",
            "method",
            "order",
            &format!("RMS at {step}"),
            &format!("greatest at {step}"),
            &format!("speed at {step}"),
            "smallest RMS",
            "at",
            "at the cost of",
            "not to the end",
        ],
        2,
    );
    let orders = study.orders();
    let mut plant_before = "";
    for (plant, method) in study.curves() {
        let sound = || of_curve(study, (plant, method)).filter(|row| row.status == Status::Ok);
        let usual = sound().find(|row| at_usual_step(row));
        let best = sound().min_by(|a, b| {
            let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
            error(a).total_cmp(&error(b))
        });
        let order = orders
            .iter()
            .find(|order| order.plant == plant && order.method == method);
        let failed = of_curve(study, (plant, method)).filter(|row| row.status != Status::Ok);
        let class = if plant == plant_before { "" } else { "first" };
        plant_before = plant;
        table.row(
            class,
            vec![
                element("b", "", &escaped(plant)),
                escaped(method),
                order.map_or(String::new(), |order| format!("{:.1}", order.order)),
                usual.map_or(String::new(), |row| rows::length(row.error_rms_m)),
                usual.map_or(String::new(), |row| rows::length(row.error_max_m)),
                usual.map_or(String::new(), |row| rows::factor(row.real_time_factor)),
                best.map_or(String::new(), |row| rows::length(row.error_rms_m)),
                best.map_or(String::new(), rows::setting),
                best.map_or(String::new(), |row| rows::factor(row.real_time_factor)),
                rows::count(Some(failed.count() as u64)),
            ],
        );
    }
    table.html()
}

/// Every run.
fn all(study: &Study) -> String {
    let mut table = Table::new(
        &[
            "plant",
            "method",
            "set to",
            "",
            "feet, RMS",
            "greatest",
            "trunk, RMS",
            "greatest",
            "event time",
            "events",
            "energy",
            "drift",
            "evaluations",
            "factorisations",
            "solver",
            "fallbacks",
            "per step",
            "speed",
            "",
        ],
        4,
    );
    let mut before = None;
    for row in integration(study) {
        let events = match (row.events, row.events_expected) {
            (Some(own), Some(expected)) if own != expected => format!("{own} of {expected}"),
            (own, _) => rows::count(own),
        };
        let floor = if row.at_floor { "≤ " } else { "" };
        let nonzero = |value: Option<f64>| value.filter(|&value| value > 0.0);
        table.row(
            rows::class(row, before),
            vec![
                escaped(&row.plant),
                escaped(&row.method),
                rows::setting(row),
                rows::status(row),
                row.error_rms_m
                    .map_or(String::new(), |error| format!("{floor}{}", si(error, "m"))),
                rows::length(row.error_max_m),
                rows::length(nonzero(row.trunk_error_rms_m)),
                rows::length(nonzero(row.trunk_error_max_m)),
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
            "Energy is what the energy books lack at the end. Speed is simulated time over run time: the median of several \
             runs without looking; ≤ marks errors at the floor.",
        )
}
