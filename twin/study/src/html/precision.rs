//! The page of a study of precision.

use crate::row::{Line, Row, RowKind, Status};
use crate::study::{Order, Study};

use super::plot::{Curve, Ended, Look, Mark, Plot, Point, Setting};
use super::rows;
use super::shape::swatch;
use super::table::Table;
use super::text::{element, escaped, paragraph};
use super::{
    card, commanded, dominance, drift, figure, footsteps, lead, models, references, transport,
};
use crate::headline::{AIM_M, Choice, Foremost, USUAL_STEP_S, at_usual_step};
use crate::number::si;

const AIM_FACTOR: f64 = 1000.0;

/// The smallest error that has a place on a logarithmic scale \[m\].
pub(crate) const LEAST_M: f64 = 1e-16;

pub(crate) fn body(study: &Study) -> String {
    let compared = format!(
        "Every plant is led through {} by each of its methods at each setting, and where its feet are is \
         compared every {} with a reference. {}",
        window(study),
        si(study.grid_s, "s"),
        commanded(study)
    );
    let mut out = lead(&compared);
    for note in &study.references {
        if let Some(until_s) = note.holds_until_s {
            out += &paragraph(&format!(
                "What is known of {} ends at {}: there its reference and the check of it part by more than they may, and \
                 nothing is compared from there on.",
                note.plant,
                si(until_s, "s")
            ));
        }
    }
    out += &cards(study);
    out += "<h2>Error against run time</h2>\n";
    out += &cost(study);
    out += &dominance::section(study);
    out += "<h2>Error against step</h2>\n";
    out += &convergence(study);
    out += &drift::section(study);
    out += "<h2>The methods, side by side</h2>\n";
    out += &summary(study);
    out += "<h2>What they are measured against</h2>\n";
    out += &paragraph(
        "The reference of a plant is its best method at its finest setting, checked by a second one; that of a plant which solves \
         another's model by other means is that one's. Errors below the disagreement of the two are at the floor: less is not \
         known of them.",
    );
    out += &references(&study.references);
    out += &models::section(study);
    out += &footsteps::section(study);
    out += &transport::section(study);
    out += "<h2>All runs</h2>\n";
    out += &all(study);
    out
}

/// How much of the scene that is.
fn window(study: &Study) -> String {
    let (all, some) = (si(study.scene_s, "s"), si(study.simulated_s, "s"));
    if study.simulated_s < study.scene_s * (1.0 - 1e-9) {
        format!("the first {some} of the scene's {all}")
    } else {
        format!("the {some} of the scene")
    }
}

pub(crate) fn integration(study: &Study) -> impl Iterator<Item = &Row> {
    study
        .rows
        .iter()
        .filter(|row| row.kind == RowKind::Integration)
}

pub(crate) fn of_line<'a>(study: &'a Study, line: Line<'a>) -> impl Iterator<Item = &'a Row> {
    integration(study).filter(move |row| row.line() == line)
}

/// The order of a line, where its method steps and its errors show one.
fn order(study: &Study, line: Line<'_>) -> Option<f64> {
    let orders = study.orders().into_iter();
    let of_line = |order: &Order| order.plant == line.plant && order.method == line.method;
    let mut ours = orders.filter(of_line).map(|order| order.order);
    ours.next().filter(|_| !line.is_adaptive())
}

/// The row of the headline, the smallest error at the usual step, and the fastest within the aim at any setting; all of the
/// plants that the headline is about.
fn cards(study: &Study) -> String {
    let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
    let candidates = study.candidates();
    let sound = || candidates.iter().map(|(row, _)| *row);
    let name = |row: &Row| format!("{}, {}", row.line().name(), rows::setting(row));
    let speed = |row: &Row| format!("{} real time", rows::factor(row.real_time_factor));
    let mut out = foremost(study);
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
    let aim_m = si(AIM_M, "m");
    let what = format!("fastest at any setting with an error of at most {aim_m}");
    out += &match fastest {
        Some(row) => {
            let more = format!("{}; {}", name(row), rows::length(row.error_rms_m));
            card(&what, &speed(row), &more)
        }
        None if study.floor() > AIM_M => {
            let floor = si(study.floor(), "m");
            card(
                &what,
                "not known",
                &format!("the floor is {floor}: less cannot be told here"),
            )
        }
        None => card(&what, "none", "no run came that close"),
    };
    let count = integration(study).count();
    let whole = integration(study).filter(|row| row.status == Status::Ok);
    let cut = integration(study).filter(|row| row.cut).count();
    let whole = whole.count();
    let more = rows::outcome(whole, count - whole - cut, cut);
    out += &card("runs", &count.to_string(), &more);
    element("div", "cards", &out)
}

/// The row that the headline names.
fn foremost(study: &Study) -> String {
    let Some(Foremost {
        row,
        error_m,
        choice,
    }) = study.foremost()
    else {
        return String::new();
    };
    let (step, aim) = (si(USUAL_STEP_S, "s"), si(AIM_M, "m"));
    let name = format!("{}, {}", row.line().name(), rows::setting(row));
    let speed = format!("{} real time", rows::factor(row.real_time_factor));
    match choice {
        // The next card names it.
        Choice::Nearest => String::new(),
        Choice::Fastest => card(
            &format!("fastest at {step} with an error of at most {aim}"),
            &speed,
            &format!("{name}; {}", si(error_m, "m")),
        ),
        Choice::FastestAdaptive => card(
            &format!("fastest that chooses its steps, with an error of at most {aim}"),
            &speed,
            &format!("{name}; {}", si(error_m, "m")),
        ),
    }
}

fn entries(study: &Study, of: impl Fn(&Line<'_>) -> bool) -> Vec<(String, String)> {
    let lines = study.numbered_lines().into_iter();
    lines
        .filter(|(_, line)| of(line))
        .map(|(number, line)| {
            let order =
                order(study, line).map_or(String::new(), |order| format!(", order {order:.1}"));
            (
                swatch(number, line.is_adaptive()),
                format!("{}{order}", line.name()),
            )
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
        look: match (row.contradicts, row.at_floor, at_usual_step(row)) {
            (true, ..) => Look::Doubtful,
            (false, true, _) => Look::Hollow,
            (false, false, true) => Look::Marked,
            (false, false, false) => Look::Plain,
        },
    })
}

/// The setting of a row on a plot, at `x` if it has a place there.
fn setting(study: &Study, row: &Row, x: Option<f64>) -> Setting {
    let Some(x) = x else {
        return Setting::Unknown;
    };
    let ended = || (row.status != Status::Ok).then(|| ended(row, x));
    Setting::of(point(study, row, x), ended)
}

/// Error over run time.
fn cost(study: &Study) -> String {
    let curves = study.numbered_lines().into_iter().map(|(number, line)| {
        let cost = |row: &Row| row.run_s_per_simulated_s.filter(|&cost| cost > 0.0);
        let settings = of_line(study, line).map(|row| setting(study, row, cost(row)));
        Curve::through(number, line.is_adaptive(), settings)
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
    let placed = integration(study)
        .any(|row| row.status != Status::Ok && row.run_s_per_simulated_s.is_some());
    let strip = if placed {
        " Crosses in a strip at the top are runs that failed, became unstable or, in grey, were cut for the budget, at the run time \
         they took by then."
    } else {
        ""
    };
    let caption = format!(
        "Down and to the left is better. A point is a step or a tolerance, finer ones further down; the large ones are steps of \
         {}, hollow ones are at the floor.{strip}{unplaced} \
         Point at anything to see what it is.",
        si(USUAL_STEP_S, "s")
    );
    figure("", &entries(study, |_| true), &plot, &caption)
}

/// What is not known of the reference.
pub(crate) fn floor(study: &Study) -> Mark {
    let reference = study.reference();
    let plant = reference.map_or("", |note| note.plant.as_str());
    let floor = study.floor();
    let label = format!(
        "floor: the references of {plant} are {} apart",
        si(floor, "m")
    );
    Mark::Below(floor, label)
}

/// A row without a point.
fn ended(row: &Row, x: f64) -> Ended {
    Ended {
        x,
        title: format!("{}: {}", row.word(), rows::title(row)),
        cut: row.cut,
    }
}

/// Error over step, and what order that is.
fn convergence(study: &Study) -> String {
    let stepped = |line: &Line<'_>| !line.is_adaptive();
    let curves = study.numbered_lines().into_iter();
    let curves = curves
        .filter(|(_, line)| stepped(line))
        .map(|(number, line)| {
            let settings = of_line(study, line).map(|row| setting(study, row, row.step_s));
            Curve::through(number, false, settings)
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
            &format!("speed at {step}"),
            "smallest RMS",
            "at",
            "at the cost of",
            "not to the end",
        ],
        2,
    );
    let mut plant_before = "";
    for line in study.lines() {
        let plant = line.plant;
        let sound = || of_line(study, line).filter(|row| row.status == Status::Ok);
        let usual = sound().find(|row| at_usual_step(row));
        let best = sound().min_by(|a, b| {
            let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
            error(a).total_cmp(&error(b))
        });
        let failed = of_line(study, line).filter(|row| row.status != Status::Ok);
        let class = if plant == plant_before { "" } else { "first" };
        plant_before = plant;
        table.row(
            class,
            vec![
                element("b", "", &escaped(plant)),
                escaped(&line.way()) + &element("span", "wrap soft", &escaped(study.about(line))),
                order(study, line).map_or(String::new(), |order| format!("{order:.1}")),
                usual.map_or(String::new(), |row| rows::length(row.error_rms_m)),
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
            "evalu\u{ad}ations",
            "factori\u{ad}sations",
            "solver",
            "handed over",
            "per step",
            "speed",
            "",
        ],
        4,
    );
    let mut before = None;
    for row in integration(study) {
        let events = match (row.events, row.events_expected) {
            (None, Some(_)) => "looks for none".to_owned(),
            (Some(own), Some(expected)) if own != expected => format!("{own} of {expected}"),
            (own, _) => rows::count(own),
        };
        let floor = if row.at_floor { "≤ " } else { "" };
        let nonzero = |value: Option<f64>| value.filter(|&value| value > 0.0);
        table.row(
            rows::class(row, before),
            vec![
                escaped(&row.plant),
                escaped(&row.line().way()),
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
             runs without looking; ≤ marks errors at the floor. Handed over: steps that another method, or shorter ones, had to take.",
        )
}
