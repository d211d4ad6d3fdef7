//! Figures of a fit: recorded signals beside those of the twin.

use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::number::precise;
use twinrig_report::page::{Figure, Swatch};

use super::outcome::{FitOutcome, RecordingResidual};

const RECORDED: usize = 0;
const FITTED: usize = 1;
const LEFT_OUT: usize = 2;
/// Figures on a page.
const FIGURES: usize = 12;

/// Returns the figures of the recordings with the greatest residuals: of those left out, where
/// there are any.
pub(super) fn figures(outcome: &FitOutcome) -> Vec<Figure> {
    let left_out: Vec<&RecordingResidual> = outcome
        .held_out
        .iter()
        .flat_map(|it| &it.residuals)
        .collect();
    let mut pairs: Vec<_> = outcome
        .recordings
        .iter()
        .map(|fitted| {
            let is_same =
                |it: &&RecordingResidual| it.hash == fitted.hash && it.signal == fitted.signal;
            (fitted, left_out.iter().copied().find(is_same))
        })
        .collect();
    let size = |(fitted, left_out): &(&RecordingResidual, Option<&RecordingResidual>)| {
        left_out.unwrap_or(fitted).mean_absolute
    };
    pairs.sort_by(|one, other| size(other).total_cmp(&size(one)));
    pairs.truncate(FIGURES);
    let pairs = pairs.into_iter();
    pairs
        .map(|(fitted, left_out)| figure(fitted, left_out))
        .collect()
}

fn figure(fitted: &RecordingResidual, left_out: Option<&RecordingResidual>) -> Figure {
    let points = |curve: &[[f64; 3]], column: usize| -> Vec<[f64; 2]> {
        curve
            .iter()
            .map(|point| [point[0], point[column]])
            .collect()
    };
    let mut series = vec![
        Series {
            number: RECORDED,
            shape: Shape::Line(points(&fitted.curve, 1)),
        },
        Series {
            number: FITTED,
            shape: Shape::Line(points(&fitted.curve, 2)),
        },
    ];
    let mut legend = vec![
        (Swatch::Curve(RECORDED), "recorded".to_owned()),
        (Swatch::Curve(FITTED), "fitted".to_owned()),
    ];
    let size = |it: &RecordingResidual| precise(it.mean_absolute, &it.unit);
    let mut caption = format!("mean absolute residual {}", size(fitted));
    if let Some(left_out) = left_out {
        series.push(Series {
            number: LEFT_OUT,
            shape: Shape::Dashed(points(&left_out.curve, 2)),
        });
        legend.push((Swatch::Dashed(LEFT_OUT), "left out".to_owned()));
        caption = format!("{caption}, left out {}", size(left_out));
    }
    let plot = LinePlot {
        title: format!("{} of {}", fitted.signal, fitted.recording),
        width: 540.0,
        height: 260.0,
        x: AxisLabel::in_unit("time", "s"),
        y: AxisLabel::in_unit(&fitted.signal, &fitted.unit),
        series,
    };
    Figure {
        heading: fitted.recording.clone(),
        legend,
        drawing: plot.drawing(),
        caption,
    }
}
