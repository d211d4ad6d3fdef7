//! Plots of a sweep over its dimensions.

use twinrig_campaign::sweep::{ResultDimension, ResultRow, RowVerdict, SweepResult};
use twinrig_kernel::Unit;

use super::super::drawing;
use twinrig_report::html::element::paragraph;
use twinrig_report::html::line_plot::{LinePlot, Series, Shape};
use twinrig_report::html::marker::swatch;

/// Greatest number of points of one kind in a plot.
pub(super) const DRAWN: usize = 1000;
/// Bars of a histogram, and least number of runs in one of them on average.
const BARS: usize = 12;
const RUNS_OF_BAR: usize = 4;

/// Colours of pass, fail and of what is required.
pub(super) const PASS: usize = 0;
const FAIL: usize = 1;
pub(super) const BOUND: usize = 7;

/// A dimension as an axis of plots: numbers as they are, texts by their number in a list.
pub(super) struct SweepAxis<'a> {
    dimension: &'a ResultDimension,
    index: usize,
    /// Texts of a dimension without numbers.
    texts: Vec<&'a str>,
}

impl<'a> SweepAxis<'a> {
    pub(super) fn of(result: &'a SweepResult, index: usize) -> Self {
        let dimension = &result.dimensions[index];
        let mut texts: Vec<&str> = Vec::new();
        if dimension.unit.is_none() {
            for row in &result.rows {
                let text = row.point[index].shown();
                if !texts.contains(&text) {
                    texts.push(text);
                }
            }
        }
        Self {
            dimension,
            index,
            texts,
        }
    }

    fn at(&self, row: &ResultRow) -> f64 {
        let value = &row.point[self.index];
        if let (Some(_), Some(number)) = (self.dimension.unit, value.number) {
            return number;
        }
        let text = value.shown();
        let place = self.texts.iter().position(|known| *known == text);
        place.map_or(0.0, |place| (place + 1) as f64)
    }

    fn label(&self) -> String {
        match self.dimension.unit {
            Some(Unit::One) => self.dimension.key.clone(),
            Some(unit) => format!("{}  [{}]", self.dimension.key, unit.symbol()),
            None => {
                let texts = self.texts.iter().take(BARS).enumerate();
                let texts = texts.map(|(number, text)| format!("{} {text}", number + 1));
                let texts: Vec<String> = texts.collect();
                format!("{}  ({})", self.dimension.key, texts.join(", "))
            }
        }
    }
}

/// Returns a histogram of the share of runs that pass.
pub(super) fn passing(result: &SweepResult, axis: &SweepAxis<'_>) -> String {
    let values = result.rows.iter().map(|row| axis.at(row));
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let (low, bars, width) = if high > low {
        let bars = (result.rows.len() / RUNS_OF_BAR).clamp(1, BARS);
        (low, bars, (high - low) / bars as f64)
    } else {
        // One value: a bar around it.
        (low - 0.5, 1, 1.0)
    };
    // Runs in each bar, and those among them that pass.
    let mut counts = vec![(0_usize, 0_usize); bars];
    for row in &result.rows {
        let place = (axis.at(row) - low) / width;
        let bar = (1..bars).filter(|&bar| place >= bar as f64).count();
        counts[bar].0 += 1;
        counts[bar].1 += usize::from(row.row.verdict == RowVerdict::Pass);
    }
    // Without a run there is no share.
    let counts = counts.iter().enumerate().filter(|(_, (runs, _))| *runs > 0);
    let points = counts.map(|(bar, &(runs, pass))| {
        let share = pass as f64 / runs as f64;
        [low + width * (bar as f64 + 0.5), share]
    });
    // Both ends of the scale of shares.
    let scale = Shape::Line(vec![[low, 0.0], [low, 1.0]]);
    let plot = LinePlot {
        title: format!("share of runs that pass over {}", axis.dimension.key),
        width: 540.0,
        height: 260.0,
        x_label: axis.label(),
        y_label: "share that passes".to_owned(),
        series: vec![
            Series {
                number: BOUND,
                shape: scale,
            },
            Series {
                number: PASS,
                shape: Shape::Bars {
                    width,
                    points: points.collect(),
                },
            },
        ],
    };
    drawing("", &[], &plot.svg(), "")
}

/// Returns legend and dots of the runs that pass and fail, and the number left out.
fn dots(points: &[(bool, [f64; 2])]) -> ([(String, String); 2], Vec<Series>, usize) {
    let mut left_out = 0;
    let mut series = |passes: bool, number: usize| {
        let of: Vec<[f64; 2]> = points
            .iter()
            .filter(|(pass, _)| *pass == passes)
            .map(|(_, point)| *point)
            .collect();
        // Evenly over the points, so that the same ones are drawn in every plot.
        let every = of.len().div_ceil(DRAWN).max(1);
        let drawn: Vec<[f64; 2]> = of.iter().step_by(every).copied().collect();
        left_out += of.len() - drawn.len();
        Series {
            number,
            shape: Shape::Dots(drawn),
        }
    };
    let series = vec![series(true, PASS), series(false, FAIL)];
    let legend = [
        (swatch(PASS, false), "pass".to_owned()),
        (swatch(FAIL, false), "fail".to_owned()),
    ];
    (legend, series, left_out)
}

fn caption(left_out: usize) -> String {
    match left_out {
        0 => String::new(),
        count => format!("{count} runs are not drawn; all are in rows.csv."),
    }
}

/// Returns a plot of passing and failing runs over two dimensions.
pub(super) fn plane(result: &SweepResult, x: &SweepAxis<'_>, y: &SweepAxis<'_>) -> String {
    let rows = result.rows.iter();
    let points: Vec<_> = rows
        .map(|row| {
            let pass = row.row.verdict == RowVerdict::Pass;
            (pass, [x.at(row), y.at(row)])
        })
        .collect();
    let (legend, series, left_out) = dots(&points);
    let plot = LinePlot {
        title: format!("runs over {} and {}", x.dimension.key, y.dimension.key),
        width: 540.0,
        height: 320.0,
        x_label: x.label(),
        y_label: y.label(),
        series,
    };
    drawing("", &legend, &plot.svg(), &caption(left_out))
}

/// Returns a plot of the margin of an expectation over a dimension.
pub(super) fn margins(
    result: &SweepResult,
    axis: &SweepAxis<'_>,
    name: &str,
    unit: &str,
) -> String {
    let points: Vec<_> = result
        .rows
        .iter()
        .filter_map(|row| {
            let one = row.row.expectation(name).filter(|one| one.unit == unit)?;
            Some((one.holds, [axis.at(row), one.margin?]))
        })
        .collect();
    if points.is_empty() {
        return paragraph("No run has a margin.");
    }
    let (legend, mut series, left_out) = dots(&points);
    let ends = points.iter().map(|(_, [x, _])| *x);
    let ends = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    });
    series.push(Series {
        number: BOUND,
        shape: Shape::Dashed(ends.map(|x| [x, 0.0]).into()),
    });
    let plot = LinePlot {
        title: format!("margin of {name} over {}", axis.dimension.key),
        width: 540.0,
        height: 260.0,
        x_label: axis.label(),
        y_label: match unit {
            "1" => "margin".to_owned(),
            unit => format!("margin  [{unit}]"),
        },
        series,
    };
    drawing("", &legend, &plot.svg(), &caption(left_out))
}
