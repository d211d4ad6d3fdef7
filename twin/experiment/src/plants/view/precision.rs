//! Page of a study of precision.

use twinrig_report::html::plot::{Curve, EndedRun, Look, Mark, Plot, Point, Setting};
use twinrig_report::number::si;
use twinrig_report::page::{Block, Card, Swatch};
use twinrig_report::table::{Cell, Column, Table};

use super::error_axis::{LEAST_M, floor};
use super::rows::{self, integration, of_series};
use super::{
    commanded, constraint_violation, contact, curve_swatch, dominance, ensemble, figure, footsteps,
    models, references, runs, tolerance, transport,
};
use crate::plants::headline::{AIM_M, Choice, HeadlineRow, USUAL_STEP_S, at_usual_step};
use crate::plants::row::{Row, Series, Status};
use crate::plants::study::{Order, Study};

const AIM_FACTOR: f64 = 1000.0;

pub(crate) fn blocks(study: &Study) -> Vec<Block> {
    let mut out = introduction(study);
    out.extend([
        Block::Cards(cards(study)),
        Block::heading("Error against run time"),
        cost(study),
    ]);
    out.extend(dominance::section(study));
    out.extend([Block::heading("Error against step"), convergence(study)]);
    out.extend(tolerance::section(study));
    out.extend(constraint_violation::section(study));
    out.extend([
        Block::heading("Summary by method"),
        Block::Table(summary(study)),
        Block::heading("References"),
        Block::text(
            "The reference of a plant is its best method at its finest setting, checked by a \
             second one; a plant that solves the model of another with a different engine shares \
             the reference of that plant. Errors below the disagreement of reference and check \
             are at the floor: they are not significant.",
        ),
        Block::Table(references(&study.references)),
    ]);
    out.extend(models::section(study));
    out.extend(footsteps::section(study));
    out.extend(contact::section(study));
    out.extend(ensemble::section(study));
    out.extend(transport::section(study));
    out.push(Block::heading("All runs"));
    out.extend(runs::section(study));
    out
}

fn introduction(study: &Study) -> Vec<Block> {
    let compared = format!(
        "Every plant is run through {} with each of its methods at each setting, and the \
         positions of its feet are compared every {} with a reference. {}",
        window(study),
        si(study.grid_s, "s"),
        commanded(study)
    );
    let ends = study.references.iter().filter_map(|note| {
        let until_s = note.holds_until_s?;
        Some(format!(
            "The reference of {} ends at {}: from there on it differs from its check by more \
             than the tolerance, and nothing is compared.",
            note.plant,
            si(until_s, "s")
        ))
    });
    std::iter::once(compared)
        .chain(ends)
        .map(Block::Text)
        .collect()
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
fn cards(study: &Study) -> Vec<Card> {
    let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
    let candidates = study.candidates();
    let sound = || candidates.iter().map(|(row, _)| *row);
    let name = |row: &Row| format!("{}, {}", row.series().name(), rows::setting(row));
    let speed = |row: &Row| format!("{} real time", rows::factor(row.real_time_factor));
    let mut out: Vec<Card> = headline_card(study).into_iter().collect();
    let usual = sound().filter(|row| at_usual_step(row));
    if let Some(row) = usual.min_by(|a, b| error(a).total_cmp(&error(b))) {
        let what = format!("smallest error at {}", si(USUAL_STEP_S, "s"));
        let more = format!("{}; {}", name(row), speed(row));
        out.push(Card::new(what, rows::length(row.error_rms_m), more));
    }
    let aim = sound().filter(|row| error(row) <= AIM_M);
    let fastest = aim.max_by(|a, b| {
        let speed = |row: &&Row| row.real_time_factor.unwrap_or(0.0);
        speed(a).total_cmp(&speed(b))
    });
    let aim_m = si(AIM_M, "m");
    let what = format!("fastest at any setting with an error of at most {aim_m}");
    out.push(match fastest {
        Some(row) => {
            let more = format!("{}; {}", name(row), rows::length(row.error_rms_m));
            Card::new(what, speed(row), more)
        }
        None if study.floor() > AIM_M => {
            let floor = si(study.floor(), "m");
            let more = format!("the floor is {floor}: smaller errors cannot be resolved");
            Card::new(what, "not known", more)
        }
        None => Card::new(what, "none", "no run is that accurate"),
    });
    let count = integration(study).count();
    let completed = integration(study).filter(|row| row.status == Status::Ok);
    let cut = integration(study).filter(|row| row.cut).count();
    let completed = completed.count();
    let more = rows::outcome(completed, count - completed - cut, cut);
    out.push(Card::new("runs", count.to_string(), more));
    out
}

/// Returns the card of the headline row, unless the next card shows it.
fn headline_card(study: &Study) -> Option<Card> {
    let HeadlineRow {
        row,
        error_m,
        choice,
    } = study.headline_row()?;
    let (step, aim) = (si(USUAL_STEP_S, "s"), si(AIM_M, "m"));
    let what = match choice {
        Choice::Nearest => return None,
        Choice::Fastest => format!("fastest at {step} with an error of at most {aim}"),
        Choice::FastestAdaptive => {
            format!("fastest adaptive method with an error of at most {aim}")
        }
    };
    let speed = format!("{} real time", rows::factor(row.real_time_factor));
    let (name, error) = (row.series().name(), si(error_m, "m"));
    let more = format!("{name}, {}; {error}", rows::setting(row));
    Some(Card::new(what, speed, more))
}

fn entries(study: &Study, of: impl Fn(&Series<'_>) -> bool) -> Vec<(Swatch, String)> {
    let series = study.numbered_series().into_iter();
    series
        .filter(|(_, series)| of(series))
        .map(|(number, series)| {
            let order =
                order(study, series).map_or(String::new(), |order| format!(", order {order:.1}"));
            (
                curve_swatch(number, series.is_adaptive()),
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
fn cost(study: &Study) -> Block {
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
    Block::Figure(figure("", entries(study, |_| true), &plot, caption))
}

/// Returns the mark of a run that ended early.
fn ended(row: &Row, x: f64) -> EndedRun {
    EndedRun {
        x,
        title: format!("{}: {}", row.word(), rows::title(row)),
        cut: row.cut,
    }
}

/// Returns the plot of error over step, with the orders.
fn convergence(study: &Study) -> Block {
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
    Block::Figure(figure("", entries(study, stepped), &plot, caption))
}

/// Returns a table row for each method.
pub(crate) fn summary(study: &Study) -> Table {
    let step = si(USUAL_STEP_S, "s");
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        Column::number("order").with_places(1),
        Column::number(format!("RMS at {step}")).in_unit("m"),
        Column::number(format!("speed at {step}")),
        Column::number("smallest RMS").in_unit("m"),
        Column::number("at"),
        Column::number("speed there"),
        Column::text("incomplete"),
    ]);
    let mut before = None;
    for series in study.series() {
        let rows = || of_series(study, series);
        let sound = || rows().filter(|row| row.status == Status::Ok);
        let usual = sound().find(|row| at_usual_step(row));
        let best = sound().min_by(|a, b| {
            let error = |row: &&Row| row.error_rms_m.unwrap_or(f64::INFINITY);
            error(a).total_cmp(&error(b))
        });
        let speed = |row: Option<&Row>| row.map(|row| rows::factor(row.real_time_factor));
        let incomplete = rows().filter(|row| row.status != Status::Ok);
        table.row([
            series.plant.label().into(),
            Cell::from(series.method_label()).with_detail(study.about(series)),
            order(study, series).into(),
            usual.map(|row| rows::error(study, row)).into(),
            speed(usual).into(),
            best.map(|row| rows::error(study, row)).into(),
            best.map(rows::setting).into(),
            speed(best).into(),
            rows::incomplete(rows().count(), incomplete),
        ]);
        if before.is_some_and(|before| before != series.plant) {
            table.begin_group();
        }
        before = Some(series.plant);
    }
    table
}
