//! Page of a study of precision.

use crate::row::{Row, Series, Status};
use crate::study::{Order, Study};

use super::error_axis::{LEAST_M, floor};
use super::rows::{self, integration, of_series};
use super::{
    card, commanded, constraint_violation, contact, dominance, ensemble, figure, footsteps,
    introduction, models, references, runs, tolerance, transport,
};
use crate::headline::{AIM_M, Choice, HeadlineRow, USUAL_STEP_S, at_usual_step};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::plot::{Curve, Ended, Look, Mark, Plot, Point, Setting};
use twinrig_report::html::table::HtmlTable;
use twinrig_report::number::si;

const AIM_FACTOR: f64 = 1000.0;

pub(crate) fn body(study: &Study) -> String {
    let compared = format!(
        "Every plant is run through {} with each of its methods at each setting, and the \
         positions of its feet are compared every {} with a reference. {}",
        window(study),
        si(study.grid_s, "s"),
        commanded(study)
    );
    let mut out = introduction(&compared);
    for note in &study.references {
        if let Some(until_s) = note.holds_until_s {
            out += &paragraph(&format!(
                "The reference of {} ends at {}: from there on it differs from its check by more \
                 than the tolerance, and nothing is compared.",
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
    out += &tolerance::section(study);
    out += &constraint_violation::section(study);
    out += "<h2>Summary by method</h2>\n";
    out += &summary(study);
    out += "<h2>References</h2>\n";
    out += &paragraph(
        "The reference of a plant is its best method at its finest setting, checked by a second \
         one; a plant that solves the model of another with a different engine shares the \
         reference of that plant. Errors below the disagreement of reference and check are at \
         the floor: they are not significant.",
    );
    out += &references(&study.references).html();
    out += &models::section(study);
    out += &footsteps::section(study);
    out += &contact::section(study);
    out += &ensemble::section(study);
    out += &transport::section(study);
    out += "<h2>All runs</h2>\n";
    out += &runs::table(study);
    out
}

/// Returns the simulated part of the scenario, in words.
fn window(study: &Study) -> String {
    let (all, some) = (si(study.scene_s, "s"), si(study.simulated_s, "s"));
    if study.simulated_s < study.scene_s * (1.0 - 1e-9) {
        format!("the first {some} of the scenario's {all}")
    } else {
        format!("the {some} of the scenario")
    }
}

/// Returns the order of a series, if it is of a fixed-step method and its errors show one.
fn order(study: &Study, series: Series<'_>) -> Option<f64> {
    let orders = study.orders().into_iter();
    let of_series = |order: &Order| order.plant == *series.plant && order.method == series.method;
    let mut orders_of_series = orders.filter(of_series).map(|order| order.order);
    orders_of_series.next().filter(|_| !series.is_adaptive())
}

/// Returns the cards: the headline row, the smallest error at the usual step, and the fastest
/// within the aim at any setting, of the plants of the headline.
fn cards(study: &Study) -> String {
    let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
    let candidates = study.candidates();
    let sound = || candidates.iter().map(|(row, _)| *row);
    let name = |row: &Row| format!("{}, {}", row.series().name(), rows::setting(row));
    let speed = |row: &Row| format!("{} real time", rows::factor(row.real_time_factor));
    let mut out = headline_card(study);
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
                &format!("the floor is {floor}: smaller errors cannot be resolved"),
            )
        }
        None => card(&what, "none", "no run is that accurate"),
    };
    let count = integration(study).count();
    let completed = integration(study).filter(|row| row.status == Status::Ok);
    let cut = integration(study).filter(|row| row.cut).count();
    let completed = completed.count();
    let more = rows::outcome(completed, count - completed - cut, cut);
    out += &card("runs", &count.to_string(), &more);
    element("div", "cards", &out)
}

/// Returns the card of the headline row.
fn headline_card(study: &Study) -> String {
    let Some(HeadlineRow {
        row,
        error_m,
        choice,
    }) = study.headline_row()
    else {
        return String::new();
    };
    let (step, aim) = (si(USUAL_STEP_S, "s"), si(AIM_M, "m"));
    let name = format!("{}, {}", row.series().name(), rows::setting(row));
    let speed = format!("{} real time", rows::factor(row.real_time_factor));
    match choice {
        // Shown by the next card.
        Choice::Nearest => String::new(),
        Choice::Fastest => card(
            &format!("fastest at {step} with an error of at most {aim}"),
            &speed,
            &format!("{name}; {}", si(error_m, "m")),
        ),
        Choice::FastestAdaptive => card(
            &format!("fastest adaptive method with an error of at most {aim}"),
            &speed,
            &format!("{name}; {}", si(error_m, "m")),
        ),
    }
}

fn entries(study: &Study, of: impl Fn(&Series<'_>) -> bool) -> Vec<(String, String)> {
    let series = study.numbered_series().into_iter();
    series
        .filter(|(_, series)| of(series))
        .map(|(number, series)| {
            let order =
                order(study, series).map_or(String::new(), |order| format!(", order {order:.1}"));
            (
                swatch(number, series.is_adaptive()),
                format!("{}{order}", series.name()),
            )
        })
        .collect()
}

/// Returns the point of a row. Errors below the floor are not significant and are shown just below
/// it.
fn point(study: &Study, row: &Row, x: f64) -> Option<Point> {
    /// Share of the floor.
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

/// Returns the setting of a row at `x`, if that has a place on the plot.
fn setting(study: &Study, row: &Row, x: Option<f64>) -> Setting {
    let Some(x) = x else {
        return Setting::Unknown;
    };
    let ended = || (row.status != Status::Ok).then(|| ended(row, x));
    Setting::of(point(study, row, x), ended)
}

/// Returns the plot of error over run time.
fn cost(study: &Study) -> String {
    let curves = study.numbered_series().into_iter().map(|(number, series)| {
        let cost = |row: &Row| row.run_s_per_simulated_s.filter(|&cost| cost > 0.0);
        let settings = of_series(study, series).map(|row| setting(study, row, cost(row)));
        Curve::through(number, series.is_adaptive(), settings)
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
        shared_y: Vec::new(),
        strip: "failed".to_owned(),
    };
    let unplaced = integration(study)
        .filter(|row| row.status != Status::Ok && row.run_s_per_simulated_s.is_none())
        .count();
    let unplaced = match unplaced {
        0 => String::new(),
        1 => " One run did not start or was cut before it started and is not shown; it is in the \
              table."
            .to_owned(),
        count => format!(
            " {count} runs did not start or were cut before they started and are not shown; they \
             are in the table."
        ),
    };
    let placed = integration(study)
        .any(|row| row.status != Status::Ok && row.run_s_per_simulated_s.is_some());
    let strip = if placed {
        " Crosses in a strip at the top are runs that failed, became unstable or, in grey, were \
         cut for the budget, at their run time until then."
    } else {
        ""
    };
    let caption = format!(
        "Lower left is better. A point is a step or a tolerance, finer ones further down; large \
         points are steps of {}, hollow ones are at the floor.{strip}{unplaced} Hover over a \
         mark for details.",
        si(USUAL_STEP_S, "s")
    );
    figure("", &entries(study, |_| true), &plot, &caption)
}

/// Returns the mark of a run that ended early.
fn ended(row: &Row, x: f64) -> Ended {
    Ended {
        x,
        title: format!("{}: {}", row.word(), rows::title(row)),
        cut: row.cut,
    }
}

/// Returns the plot of error over step, with the orders.
fn convergence(study: &Study) -> String {
    let stepped = |series: &Series<'_>| !series.is_adaptive();
    let curves = study.numbered_series().into_iter();
    let curves = curves
        .filter(|(_, series)| stepped(series))
        .map(|(number, series)| {
            let settings = of_series(study, series).map(|row| setting(study, row, row.step_s));
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
        shared_y: Vec::new(),
        strip: "failed".to_owned(),
    };
    let caption = "The slope of a curve is the order of its method: the powers of ten by which \
                   the error falls per power of ten of the step.";
    figure("", &entries(study, stepped), &plot, caption)
}

/// Returns a table row for each method.
fn summary(study: &Study) -> String {
    let step = si(USUAL_STEP_S, "s");
    let head = format!(
        "plant | method | order | RMS at {step} | speed at {step} | smallest RMS | at \
         | speed there | incomplete"
    );
    let mut table = HtmlTable::new(&head, 2);
    let mut plant_before = None;
    for series in study.series() {
        let plant = series.plant;
        let sound = || of_series(study, series).filter(|row| row.status == Status::Ok);
        let usual = sound().find(|row| at_usual_step(row));
        let best = sound().min_by(|a, b| {
            let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
            error(a).total_cmp(&error(b))
        });
        let failed = of_series(study, series).filter(|row| row.status != Status::Ok);
        let class = if plant_before == Some(plant) {
            ""
        } else {
            "first"
        };
        plant_before = Some(plant);
        table.row(
            class,
            vec![
                element("b", "", &escaped(&plant.label())),
                escaped(&series.method_label())
                    + &element("span", "wrap soft", &escaped(study.about(series))),
                order(study, series).map_or(String::new(), |order| format!("{order:.1}")),
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
