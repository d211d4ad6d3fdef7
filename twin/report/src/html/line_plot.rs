//! Plots with linear axes as SVG.

use std::fmt::Write as _;

use super::drawing::{Drawing, begin};
use super::element::escaped;
use super::marker::COLOURS;
use crate::number::plain;

/// Element of a plot, of one colour.
#[derive(Clone, Debug)]
pub struct Series {
    /// Number that selects the colour.
    pub number: usize,
    /// Points.
    pub shape: Shape,
}

/// How its points are drawn.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Connected points.
    Line(Vec<[f64; 2]>),
    /// Points connected by a dashed line.
    Dashed(Vec<[f64; 2]>),
    /// Single points, each with a tooltip, which may be empty.
    Dots(Vec<([f64; 2], String)>),
    /// Shaded region: x, lower and upper end.
    Band(Vec<[f64; 3]>),
    /// Vertical lines: x, lower and upper end.
    Errors(Vec<[f64; 3]>),
    /// Bars from zero, around their points.
    Bars {
        /// Width, on the horizontal axis.
        width: f64,
        /// Their upper ends.
        points: Vec<[f64; 2]>,
    },
}

impl Shape {
    /// Returns points without tooltips.
    pub fn dots(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let points = points.into_iter().map(|point| (point, String::new()));
        Self::Dots(points.collect())
    }
}

/// Quantity of an axis.
#[derive(Clone, Debug)]
pub struct AxisLabel {
    name: String,
    unit: String,
}

impl AxisLabel {
    /// Creates the label of a number.
    pub fn number(name: impl Into<String>) -> Self {
        Self::in_unit(name, "")
    }

    /// Creates the label of a quantity in the unit with this symbol; that of ratios is `1`.
    pub fn in_unit(name: impl Into<String>, symbol: &str) -> Self {
        Self {
            name: name.into(),
            unit: if symbol == "1" { "" } else { symbol }.to_owned(),
        }
    }

    /// Returns the name of the quantity.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the prefix for values up to this size, and its factor: 4 ms is not 0.004 s.
    fn prefix(&self, greatest: f64) -> (&'static str, f64) {
        let fits = PREFIXES.iter().find(|(_, factor)| greatest >= *factor);
        match fits {
            Some(&fit) if PREFIXED.contains(&&*self.unit) => fit,
            _ => PREFIXES[0],
        }
    }

    fn text(&self, prefix: &str) -> String {
        match &*self.unit {
            "" => escaped(&self.name),
            unit => escaped(&format!("{}  [{prefix}{unit}]", self.name)),
        }
    }
}

/// Units that take a prefix where values are small, and the prefixes.
const PREFIXED: [&str; 6] = ["s", "m", "N", "V", "J", "W"];
const PREFIXES: [(&str, f64); 4] = [("", 1.0), ("m", 1e-3), ("µ", 1e-6), ("n", 1e-9)];

/// Contents of a plot.
#[derive(Clone, Debug)]
pub struct LinePlot {
    /// Text for readers that do not see it.
    pub title: String,
    /// Width \[px\].
    pub width: f64,
    /// Height \[px\].
    pub height: f64,
    /// Horizontal axis.
    pub x: AxisLabel,
    /// Vertical axis.
    pub y: AxisLabel,
    /// Elements, in the order in which they are drawn.
    pub series: Vec<Series>,
}

/// Margins with room for tick labels beside the name of the axis, and for half of the last one.
const LEFT: f64 = 78.0;
const RIGHT: f64 = 28.0;
const BOTTOM: f64 = 48.0;
const TOP: f64 = 12.0;
/// Radius of a dot.
const DOT: f64 = 2.6;
/// Least distance of ticks \[px\].
const TICK_X: f64 = 80.0;
const TICK_Y: f64 = 40.0;

/// Linear axis between two ticks.
#[derive(Clone, Copy, Debug)]
struct LinearAxis {
    low: f64,
    step: f64,
    ticks: usize,
    /// Positions of the ends \[px\].
    from: f64,
    to: f64,
}

impl LinearAxis {
    /// Creates an axis that contains all finite `values`, with ticks at 1, 2 or 5 times a power of
    /// ten, at least `apart` \[px\] from each other.
    fn around(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64, apart: f64) -> Self {
        let finite = values.filter(|value| value.is_finite());
        let mut low = finite.clone().fold(f64::INFINITY, f64::min);
        let mut high = finite.fold(f64::NEG_INFINITY, f64::max);
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if low == high {
            let around = low.abs().max(1.0);
            (low, high) = (low - around, high + around);
        }
        let least = (high - low) * apart / (to - from).abs();
        let power = libm::pow(10.0, libm::floor(libm::log10(least)));
        let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
        let step = steps.into_iter().find(|&step| step >= least);
        let step = step.unwrap_or(10.0 * power);
        let low = libm::floor(low / step + 1e-9) * step;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive number of ticks; a cast saturates"
        )]
        let ticks = libm::ceil((high - low) / step - 1e-9).max(1.0) as usize;
        Self {
            low,
            step,
            ticks,
            from,
            to,
        }
    }

    /// Returns the position of a value \[px\]; values outside are placed at the nearer end.
    fn at(&self, value: f64) -> f64 {
        let share = (value - self.low) / (self.step * self.ticks as f64);
        let share = if share.is_finite() { share } else { 0.0 };
        self.from + (self.to - self.from) * share.clamp(0.0, 1.0)
    }

    /// Returns the greatest magnitude of the ends.
    fn greatest(&self) -> f64 {
        let high = self.low + self.step * self.ticks as f64;
        self.low.abs().max(high.abs())
    }

    /// Returns the ticks with their labels, in units of `scale`.
    fn ticks(self, scale: f64) -> impl Iterator<Item = (f64, String)> {
        (0..=self.ticks).map(move |tick| {
            let value = self.low + self.step * tick as f64;
            // Rounding of the multiples is not shown.
            let value = if value.abs() < 1e-9 * self.step {
                0.0
            } else {
                value
            };
            (self.at(value), plain(value / scale))
        })
    }
}

impl LinePlot {
    /// Returns the drawing.
    pub fn drawing(&self) -> Drawing {
        Drawing::of_svg(self.svg())
    }

    /// Returns the SVG element.
    pub fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|series| series.shape.points());
        let [bottom, right] = [self.height - BOTTOM, self.width - RIGHT];
        let x = LinearAxis::around(points().map(|point| point[0]), LEFT, right, TICK_X);
        let y = LinearAxis::around(points().map(|point| point[1]), bottom, TOP, TICK_Y);
        let mut out = begin(self.width, self.height, &self.title);
        self.frame(&mut out, x, y);
        for series in &self.series {
            series.draw(&mut out, &x, &y);
        }
        out.push_str("</svg>\n");
        out
    }

    /// Draws grid, ticks and labels.
    fn frame(&self, out: &mut String, x: LinearAxis, y: LinearAxis) {
        let [bottom, right] = [self.height - BOTTOM, self.width - RIGHT];
        let (x_prefix, x_scale) = self.x.prefix(x.greatest());
        let (y_prefix, y_scale) = self.y.prefix(y.greatest());
        // Writing to a `String` cannot fail.
        out.push_str("<g class=\"grid\">");
        for (at, _) in x.ticks(x_scale) {
            let _ = write!(
                out,
                "<line x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{bottom}\"/>"
            );
        }
        for (at, _) in y.ticks(y_scale) {
            let _ = write!(
                out,
                "<line x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{right}\" y2=\"{at:.1}\"/>"
            );
        }
        out.push_str("</g>\n<g class=\"axis\">");
        for (at, label) in x.ticks(x_scale) {
            let below = bottom + 18.0;
            let _ = write!(
                out,
                "<text class=\"middle\" x=\"{at:.1}\" y=\"{below}\">{label}</text>"
            );
        }
        for (at, label) in y.ticks(y_scale) {
            let _ = write!(
                out,
                "<text class=\"end\" x=\"{}\" y=\"{:.1}\">{label}</text>",
                LEFT - 8.0,
                at + 4.0
            );
        }
        let _ = write!(
            out,
            "<text class=\"middle label\" x=\"{}\" y=\"{}\">{}</text>",
            f64::midpoint(LEFT, right),
            self.height - 8.0,
            self.x.text(x_prefix)
        );
        let _ = writeln!(
            out,
            "<text class=\"middle label\" transform=\"translate(13 {:.1}) rotate(-90)\">{}</text></g>",
            f64::midpoint(TOP, bottom),
            self.y.text(y_prefix)
        );
    }
}

impl Shape {
    /// Points that the axes have to contain.
    fn points(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Line(points) | Self::Dashed(points) => points.clone(),
            Self::Dots(points) => points.iter().map(|(point, _)| *point).collect(),
            Self::Band(points) | Self::Errors(points) => points
                .iter()
                .flat_map(|&[x, low, high]| [[x, low], [x, high]])
                .collect(),
            Self::Bars { width, points } => points
                .iter()
                .flat_map(|&[x, y]| [[x - 0.5 * width, 0.0], [x + 0.5 * width, y]])
                .collect(),
        }
    }
}

impl Series {
    fn draw(&self, out: &mut String, x: &LinearAxis, y: &LinearAxis) {
        let place = |&[a, b]: &[f64; 2]| format!("{:.1},{:.1}", x.at(a), y.at(b));
        let joined = |points: &[[f64; 2]]| {
            let places: Vec<String> = points.iter().map(place).collect();
            places.join(" ")
        };
        let dashed = if matches!(self.shape, Shape::Dashed(_)) {
            " dashed"
        } else {
            ""
        };
        let _ = write!(out, "<g class=\"c{}{dashed}\">", self.number % COLOURS);
        match &self.shape {
            Shape::Line(points) | Shape::Dashed(points) => {
                let _ = write!(out, "<polyline points=\"{}\"/>", joined(points));
            }
            Shape::Dots(points) => {
                for ([a, b], title) in points {
                    let (a, b) = (x.at(*a), y.at(*b));
                    let _ = write!(out, "<circle cx=\"{a:.1}\" cy=\"{b:.1}\" r=\"{DOT}\"");
                    let _ = match &**title {
                        "" => write!(out, "/>"),
                        title => write!(out, "><title>{}</title></circle>", escaped(title)),
                    };
                }
            }
            Shape::Band(points) => {
                let upper = points.iter().map(|&[x, _, high]| [x, high]);
                let lower = points.iter().rev().map(|&[x, low, _]| [x, low]);
                let around: Vec<[f64; 2]> = upper.chain(lower).collect();
                let _ = write!(
                    out,
                    "<polygon fill-opacity=\"0.2\" stroke=\"none\" points=\"{}\"/>",
                    joined(&around)
                );
            }
            Shape::Errors(points) => {
                for &[a, low, high] in points {
                    let (a, low, high) = (x.at(a), y.at(low), y.at(high));
                    let _ = write!(
                        out,
                        "<line stroke-opacity=\"0.6\" x1=\"{a:.1}\" y1=\"{low:.1}\" x2=\"{a:.1}\" y2=\"{high:.1}\"/>"
                    );
                }
            }
            Shape::Bars { width, points } => bars(out, *width, points, [x, y]),
        }
        out.push_str("</g>\n");
    }
}

fn bars(out: &mut String, width: f64, points: &[[f64; 2]], [x, y]: [&LinearAxis; 2]) {
    for &[a, b] in points {
        let (left, right) = (x.at(a - 0.5 * width), x.at(a + 0.5 * width));
        let (top, foot) = (y.at(b), y.at(0.0));
        let _ = write!(
            out,
            "<rect fill-opacity=\"0.5\" stroke=\"none\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            right - left,
            (foot - top).max(0.0)
        );
    }
}

#[cfg(test)]
mod tests;
