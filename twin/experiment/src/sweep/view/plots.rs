//! Plots of a sweep over its dimensions.

use twinrig_campaign::sweep::{ResultDimension, ResultRow, RowVerdict, SweepResult};
use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::page::{Figure, Swatch};

use crate::differing::is_visible;

/// Greatest number of points of one kind in a plot.
pub(super) const DRAWN: usize = 1000;
/// Greatest number of points with tooltips.
const NAMED: usize = 300;
/// Bars of a histogram, and least number of runs in one of them on average.
const BARS: usize = 12;
const RUNS_OF_BAR: usize = 4;

/// Colours of pass, fail and of what is required.
const PASS: usize = 0;
const FAIL: usize = 1;
const BOUND: usize = 7;

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

    fn label(&self) -> AxisLabel {
        let key = &self.dimension.key;
        if let Some(unit) = self.dimension.unit {
            return AxisLabel::in_unit(key, unit.symbol());
        }
        let texts = self.texts.iter().take(BARS).enumerate();
        let texts = texts.map(|(number, text)| format!("{} {text}", number + 1));
        let texts: Vec<String> = texts.collect();
        AxisLabel::number(format!("{key}  ({})", texts.join(", ")))
    }
}

/// Ranges of equal width that a dimension is divided into.
#[derive(Clone, Copy)]
struct Ranges {
    low: f64,
    bars: usize,
    width: f64,
}

impl Ranges {
    fn of(result: &SweepResult, axis: &SweepAxis<'_>) -> Self {
        let values = result.rows.iter().map(|row| axis.at(row));
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        let [low, high] = values.fold(ends, |[low, high], it| [low.min(it), high.max(it)]);
        if high <= low {
            // One value: a bar around it.
            return Self {
                low: low - 0.5,
                bars: 1,
                width: 1.0,
            };
        }
        let bars = (result.rows.len() / RUNS_OF_BAR).clamp(1, BARS);
        let width = (high - low) / bars as f64;
        Self { low, bars, width }
    }

    fn of_value(self, value: f64) -> usize {
        let place = (value - self.low) / self.width;
        (1..self.bars).filter(|&bar| place >= bar as f64).count()
    }

    /// Returns the share of the variance of values that is between the ranges; none of equal
    /// values.
    fn share_of_variance(self, points: &[[f64; 2]]) -> Option<f64> {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let all: Vec<f64> = points.iter().map(|[_, value]| *value).collect();
        let of_all = mean(&all);
        let square = |value: f64| value * value;
        let total: f64 = all.iter().map(|value| square(value - of_all)).sum();
        if total <= 0.0 {
            return None;
        }
        let mut in_ranges = vec![Vec::new(); self.bars];
        for [x, value] in points {
            in_ranges[self.of_value(*x)].push(*value);
        }
        let filled = in_ranges.iter().filter(|values| !values.is_empty());
        let between = filled.map(|values| values.len() as f64 * square(mean(values) - of_all));
        Some(between.sum::<f64>() / total)
    }
}

/// Returns a histogram of the share of runs that pass.
pub(super) fn passing(result: &SweepResult, axis: &SweepAxis<'_>) -> Figure {
    let ranges = Ranges::of(result, axis);
    let Ranges { low, bars, width } = ranges;
    // Runs in each bar, and those among them that pass.
    let mut counts = vec![(0_usize, 0_usize); bars];
    for row in &result.rows {
        let bar = ranges.of_value(axis.at(row));
        counts[bar].0 += 1;
        counts[bar].1 += usize::from(row_passes(row));
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
        x: axis.label(),
        y: AxisLabel::number("share that passes"),
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
    Figure {
        drawing: plot.drawing(),
        ..Figure::default()
    }
}

/// A run in a plot.
struct Dot<'r> {
    passes: bool,
    at: [f64; 2],
    row: &'r ResultRow,
}

/// Returns legend and dots of the runs that pass and fail, and the number left out.
fn dots(result: &SweepResult, points: &[Dot<'_>]) -> (Vec<(Swatch, String)>, Vec<Series>, usize) {
    let mut left_out = 0;
    let has_tooltips = points.len() <= NAMED;
    let mut series = |passes: bool, number: usize| {
        let of: Vec<&Dot<'_>> = points.iter().filter(|dot| dot.passes == passes).collect();
        // Evenly over the points, so that the same ones are drawn in every plot.
        let every = of.len().div_ceil(DRAWN).max(1);
        let drawn = of.iter().step_by(every);
        let drawn = drawn.map(|dot| {
            let name = has_tooltips.then(|| result.name_of(dot.row));
            (dot.at, name.unwrap_or_default())
        });
        let drawn: Vec<([f64; 2], String)> = drawn.collect();
        left_out += of.len() - drawn.len();
        Series {
            number,
            shape: Shape::Dots(drawn),
        }
    };
    let series = vec![series(true, PASS), series(false, FAIL)];
    let legend = vec![
        (Swatch::Curve(PASS), "pass".to_owned()),
        (Swatch::Curve(FAIL), "fail".to_owned()),
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
pub(super) fn plane(result: &SweepResult, x: &SweepAxis<'_>, y: &SweepAxis<'_>) -> Figure {
    let dot = |row| Dot {
        passes: row_passes(row),
        at: [x.at(row), y.at(row)],
        row,
    };
    let points: Vec<Dot<'_>> = result.rows.iter().map(dot).collect();
    let (legend, series, left_out) = dots(result, &points);
    let plot = LinePlot {
        title: format!("runs over {} and {}", x.dimension.key, y.dimension.key),
        width: 540.0,
        height: 320.0,
        x: x.label(),
        y: y.label(),
        series,
    };
    Figure {
        heading: String::new(),
        legend,
        drawing: plot.drawing(),
        caption: caption(left_out),
    }
}

fn row_passes(row: &ResultRow) -> bool {
    row.summary.verdict == RowVerdict::Pass
}

/// Returns the plot of the margin of an expectation over a dimension, with the strength of the
/// dependence; none where the margins do not differ visibly.
pub(super) fn margins(
    result: &SweepResult,
    axis: &SweepAxis<'_>,
    name: &str,
    unit: &str,
) -> Option<(f64, Figure)> {
    let points: Vec<Dot<'_>> = result
        .rows
        .iter()
        .filter_map(|row| {
            let one = row.summary.expectation(name)?;
            let margin = one.margin().filter(|_| one.unit() == unit)?;
            Some(Dot {
                passes: one.holds,
                at: [axis.at(row), margin],
                row,
            })
        })
        .collect();
    let places: Vec<[f64; 2]> = points.iter().map(|dot| dot.at).collect();
    let values = places.iter().map(|[_, value]| *value);
    let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
        [low.min(it), high.max(it)]
    });
    let strength = Ranges::of(result, axis)
        .share_of_variance(&places)
        .filter(|_| is_visible(ends))?;
    let (legend, mut series, left_out) = dots(result, &points);
    let ends = places.iter().map(|[x, _]| *x);
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
        x: axis.label(),
        y: AxisLabel::in_unit("margin", unit),
        series,
    };
    let figure = Figure {
        heading: name.to_owned(),
        legend,
        drawing: plot.drawing(),
        caption: caption(left_out),
    };
    Some((strength, figure))
}
