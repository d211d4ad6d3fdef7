//! The part of a page that tells how far what must be closed is open.

use crate::fit;
use crate::number::si;
use crate::row::{Line, Row, Status};
use crate::study::Study;

use super::plot::{Curve, Look, Plot, Point, Setting};
use super::shape::swatch;
use super::text::paragraph;
use super::{figure, precision, rows};

/// Less is rounding of lengths of a tenth of a metre \[m\].
const ROUNDING_M: f64 = 1e-15;

/// Drift over step.
pub(crate) fn section(study: &Study) -> String {
    let lines = study.numbered_lines().into_iter();
    let lines = lines.filter(|(_, line)| !line.is_adaptive() && points(study, *line).len() > 1);
    let lines: Vec<(usize, Line<'_>)> = lines.collect();
    if lines.is_empty() {
        return String::new();
    }
    let curves = lines.iter().map(|&(number, line)| {
        let settings = precision::of_line(study, line).map(|row| Setting::of(point(row), || None));
        Curve::through(number, false, settings)
    });
    let plot = Plot {
        title: "drift over step".to_owned(),
        width: 1080.0,
        height: 420.0,
        x_label: "step  [s]".to_owned(),
        y_label: "greatest drift  [m]".to_owned(),
        curves: curves.collect(),
        marks: Vec::new(),
        beside: Vec::new(),
        strip: String::new(),
    };
    let entries: Vec<(String, String)> = lines
        .iter()
        .map(|&(number, line)| {
            let points = points(study, line);
            let logarithms = points.iter().filter(|(_, drift)| *drift > ROUNDING_M);
            let logarithms = logarithms.map(|(step, drift)| (libm::log(*step), libm::log(*drift)));
            let order = fit::order(&logarithms.collect::<Vec<_>>());
            let order = order.map_or(String::new(), |order| format!(", order {order:.1}"));
            (swatch(number, false), format!("{}{order}", line.name()))
        })
        .collect();
    let caption = "The worst of all instants of the grid, hollow where it is no more than rounding. A plant whose coordinates cannot \
                   leave a loop open has stops, cables and contacts alone to drift.";
    "<h2>What is open that must be closed</h2>\n".to_owned()
        + &paragraph(
            "How far loops are open, stops passed and contacts overlapped, in metres of the worst of them, as each plant tells of \
             itself.",
        )
        + &figure("", &entries, &plot, caption)
}

fn point(row: &Row) -> Option<Point> {
    let (step, drift) = known(row)?;
    Some(Point {
        x: step,
        y: drift.max(ROUNDING_M),
        title: format!("{}; drift {}", rows::title(row), si(drift, "m")),
        look: if drift > ROUNDING_M {
            Look::Plain
        } else {
            Look::Hollow
        },
    })
}

/// The step of a run that came to its end, and its drift.
fn known(row: &Row) -> Option<(f64, f64)> {
    let drift = row.drift_m.filter(|_| row.status == Status::Ok)?;
    Some((row.step_s?, drift))
}

fn points(study: &Study, line: Line<'_>) -> Vec<(f64, f64)> {
    precision::of_line(study, line).filter_map(known).collect()
}
