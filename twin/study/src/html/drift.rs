//! The part of a page that tells how far what must be closed is open.

use crate::fit;
use crate::number::si;
use crate::row::{Line, Row, Status};
use crate::study::Study;

use super::plot::{Curve, Look, Plot, Point};
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
    let curves = lines.iter().map(|&(number, line)| Curve {
        number,
        dashed: false,
        points: points(study, line)
            .into_iter()
            .map(|(step, drift, row)| Point {
                x: step,
                y: drift.max(ROUNDING_M),
                title: format!("{}; drift {}", rows::title(row), si(drift, "m")),
                look: if drift > ROUNDING_M {
                    Look::Plain
                } else {
                    Look::Hollow
                },
            })
            .collect(),
        failed: Vec::new(),
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
            let logarithms = points.iter().filter(|(_, drift, _)| *drift > ROUNDING_M);
            let logarithms =
                logarithms.map(|(step, drift, _)| (libm::log(*step), libm::log(*drift)));
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

fn points<'a>(study: &'a Study, line: Line<'a>) -> Vec<(f64, f64, &'a Row)> {
    let rows = precision::of_line(study, line).filter(|row| row.status == Status::Ok);
    let known = rows.filter_map(|row| Some((row.step_s?, row.drift_m?, row)));
    known.collect()
}
