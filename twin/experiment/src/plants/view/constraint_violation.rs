//! Page section on constraint violations.

use twinrig_report::html::plot::{Curve, Look, Plot, Point, Setting};
use twinrig_report::number::si;
use twinrig_report::page::{Block, Swatch};

use super::{figure, rows};
use crate::fit;
use crate::plants::row::{Row, Series, Status};
use crate::plants::study::Study;

/// Rounding error of lengths of a tenth of a metre \[m\].
const ROUNDING_M: f64 = 1e-15;

/// Returns the section: constraint violation over step.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let series = study.numbered_series().into_iter();
    let series = series.filter(|(_, key)| !key.is_adaptive() && points(study, *key).len() > 1);
    let series: Vec<(usize, Series<'_>)> = series.collect();
    if series.is_empty() {
        return Vec::new();
    }
    let curves = series.iter().map(|&(number, key)| {
        let settings = rows::of_series(study, key).map(|row| Setting::of(point(row), || None));
        Curve::through(number, false, settings)
    });
    let plot = Plot {
        title: "constraint violation over step".to_owned(),
        width: 1080.0,
        height: 420.0,
        x_label: "step  [s]".to_owned(),
        y_label: "maximum constraint violation  [m]".to_owned(),
        curves: curves.collect(),
        marks: Vec::new(),
        shared_y: Vec::new(),
        strip: String::new(),
    };
    let legend: Vec<(Swatch, String)> = series
        .iter()
        .map(|&(number, key)| {
            let points = points(study, key);
            let logarithms = points
                .iter()
                .filter(|(_, violation)| *violation > ROUNDING_M);
            let logarithms =
                logarithms.map(|(step, violation)| (libm::log(*step), libm::log(*violation)));
            let order = fit::order(&logarithms.collect::<Vec<_>>());
            let order = order.map_or(String::new(), |order| format!(", order {order:.1}"));
            (Swatch::Curve(number), format!("{}{order}", key.name()))
        })
        .collect();
    let caption = "Maximum over all sampling instants, hollow where it is within rounding. In a \
                   plant whose coordinates satisfy the loop closures identically, only stops, \
                   cables and contacts can be violated.";
    vec![
        Block::heading("Constraint violation"),
        Block::text(
            "Greatest loop closure error, joint limit violation or contact penetration in \
             metres, as reported by each plant.",
        ),
        Block::Figure(figure("", legend, &plot, caption)),
    ]
}

fn point(row: &Row) -> Option<Point> {
    let (step, violation) = known(row)?;
    Some(Point {
        x: step,
        y: violation.max(ROUNDING_M),
        title: format!(
            "{}; constraint violation {}",
            rows::title(row),
            si(violation, "m")
        ),
        look: if violation > ROUNDING_M {
            Look::Plain
        } else {
            Look::Hollow
        },
    })
}

/// Returns step and constraint violation of a completed run.
fn known(row: &Row) -> Option<(f64, f64)> {
    let violation = row.drift_m.filter(|_| row.status == Status::Ok)?;
    Some((row.step_s?, violation))
}

fn points(study: &Study, key: Series<'_>) -> Vec<(f64, f64)> {
    rows::of_series(study, key).filter_map(known).collect()
}
