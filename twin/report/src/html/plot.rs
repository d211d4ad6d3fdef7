//! Log–log plots as SVG.

use std::fmt::Write as _;

use super::axis::Axis;
use super::drawing::{Drawing, begin};
use super::element::{class_attribute, escaped};
use super::marker::{COLOURS, DOUBTFUL, cross, marker, star};

/// Point of a curve.
#[derive(Clone, Debug)]
pub struct Point {
    /// Place on the horizontal axis.
    pub x: f64,
    /// Place on the vertical axis.
    pub y: f64,
    /// Tooltip.
    pub title: String,
    /// Style.
    pub look: Look,
}

/// Style of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// As other points.
    Plain,
    /// Larger, for the settings of interest.
    Marked,
    /// Hollow, for results with a reservation.
    Hollow,
    /// Hollow, large and in the colour of failures: the result contradicts those of the
    /// neighbouring settings.
    Doubtful,
}

/// Curve of a series.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Number that selects colour and marker.
    pub number: usize,
    /// Whether its line is dashed.
    pub dashed: bool,
    /// Points in the order of the settings. A line connects the points of a stretch, which ends at
    /// a run without a point.
    stretches: Vec<Vec<Point>>,
    /// Runs that ended early, with position and reason.
    failed: Vec<EndedRun>,
}

/// Setting on a curve.
#[derive(Clone, Debug)]
pub enum Setting {
    /// Point.
    Point(Point),
    /// Run that ended early.
    Ended(EndedRun),
    /// Nothing to show on this plot.
    Unknown,
}

impl Setting {
    /// Returns the point of a setting, otherwise how its run ended.
    pub fn of(point: Option<Point>, ended: impl FnOnce() -> Option<EndedRun>) -> Self {
        match point {
            Some(point) => Self::Point(point),
            None => ended().map_or(Self::Unknown, Self::Ended),
        }
    }
}

/// Run without a point because it ended early.
#[derive(Clone, Debug)]
pub struct EndedRun {
    /// Place on the horizontal axis.
    pub x: f64,
    /// Tooltip.
    pub title: String,
    /// Truncated by the budget, which is not a failure of the method.
    pub cut: bool,
}

/// Annotation of a plot.
#[derive(Clone, Debug)]
pub enum Mark {
    /// Vertical line at this x.
    Across(f64, String),
    /// Horizontal line at this y.
    Along(f64, String),
    /// Shaded region below this y.
    Below(f64, String),
    /// Point from another source.
    At(f64, f64, String),
}

/// Contents of a plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Text for readers that do not see it.
    pub title: String,
    /// Width \[px\].
    pub width: f64,
    /// Height \[px\].
    pub height: f64,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Label of the vertical axis.
    pub y_label: String,
    /// Curves.
    pub curves: Vec<Curve>,
    /// Annotations.
    pub marks: Vec<Mark>,
    /// Further values that the y axis contains, so that adjacent plots share one scale.
    pub shared_y: Vec<f64>,
    /// Label of the strip of failures.
    pub strip: String,
}

const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 48.0;
const TOP: f64 = 12.0;
/// Height of a strip of failures, and the gap below it.
const STRIP: f64 = 26.0;
const GAP: f64 = 6.0;
/// Margins for labels of lines, above and to the right of the frame, where no curve runs.
const LABELS_ABOVE: f64 = 16.0;
const LABELS_RIGHT: f64 = 92.0;
/// Greatest width of a letter of a label.
const LETTER: f64 = 7.0;
/// Height of the row of one curve in a strip.
const STRIP_ROW: f64 = 10.0;

impl Plot {
    /// Returns the drawing.
    pub fn drawing(&self) -> Drawing {
        Drawing::of_svg(self.svg())
    }

    /// Returns the SVG element.
    pub fn svg(&self) -> String {
        let strips: Vec<f64> = [false, true].map(|cut| self.strip_height(cut)).into();
        let top = self.above() + strips.iter().sum::<f64>();
        let (x, y) = self.axes(top);
        let mut out = begin(self.width, self.height, &self.title);
        self.grid(&mut out, &x, &y, top);
        self.marks(&mut out, &x, &y);
        let mut from = self.above();
        for (cut, height) in [false, true].into_iter().zip(strips) {
            if height > 0.0 {
                self.strip(&mut out, &x, cut, from, height - GAP);
            }
            from += height;
        }
        for curve in &self.curves {
            curve.draw(&mut out, &x, &y);
        }
        out.push_str("</svg>\n");
        out
    }

    /// Returns the curves with failed runs, or with runs that were `cut`.
    fn failing(&self, cut: bool) -> impl Iterator<Item = &Curve> {
        let ended = move |curve: &&Curve| curve.failed.iter().any(|ended| ended.cut == cut);
        self.curves.iter().filter(ended)
    }

    /// Returns the height of the strip of failed or `cut` runs, with the gap below it.
    fn strip_height(&self, cut: bool) -> f64 {
        match self.failing(cut).count() {
            0 => 0.0,
            curves => STRIP.max(STRIP_ROW * curves as f64) + GAP,
        }
    }

    /// Returns the top of the first strip, or of the frame without strips.
    fn above(&self) -> f64 {
        let across = |mark: &Mark| matches!(mark, Mark::Across(..));
        TOP + if self.marks.iter().any(across) {
            LABELS_ABOVE
        } else {
            0.0
        }
    }

    /// Returns the right edge of the frame.
    fn right(&self) -> f64 {
        let along = |mark: &Mark| matches!(mark, Mark::Along(..));
        let labelled = self.marks.iter().any(along);
        self.width - if labelled { LABELS_RIGHT } else { RIGHT }
    }

    /// Returns the label of the shaded region for the legend: in the frame curves would hide it.
    pub fn floor_label(&self) -> Option<String> {
        let (_, y) = self.axes(TOP);
        self.marks.iter().find_map(|mark| match mark {
            Mark::Below(value, label) if y.contains(*value) => Some(label.clone()),
            _ => None,
        })
    }

    /// Returns whether there are points that contradict their neighbours.
    pub fn has_doubtful(&self) -> bool {
        let mut points = self.curves.iter().flat_map(Curve::points);
        points.any(|point| point.look == Look::Doubtful)
    }

    fn axes(&self, top: f64) -> (Axis, Axis) {
        let points = || self.curves.iter().flat_map(Curve::points);
        let failed = self.curves.iter().flat_map(|curve| &curve.failed);
        let marks = || self.marks.iter();
        let across = marks().filter_map(|mark| match mark {
            Mark::Across(x, _) | Mark::At(x, _, _) => Some(*x),
            _ => None,
        });
        let along = marks().filter_map(|mark| match mark {
            Mark::Along(y, _) | Mark::At(_, y, _) => Some(*y),
            _ => None,
        });
        let xs = points().map(|point| point.x).chain(across);
        let xs = xs.chain(failed.map(|ended| ended.x));
        let ys = points().map(|point| point.y).chain(along);
        let ys = ys.chain(self.shared_y.iter().copied());
        (
            Axis::around(xs, LEFT, self.right()),
            Axis::around(ys, self.height - BOTTOM, top),
        )
    }

    fn grid(&self, out: &mut String, x: &Axis, y: &Axis, top: f64) {
        let (left, right, bottom) = (LEFT, self.right(), self.height - BOTTOM);
        out.push_str("<g class=\"grid\">");
        for at in x.lines() {
            line(out, "fine", [at, top], [at, bottom]);
        }
        for at in y.lines() {
            line(out, "fine", [left, at], [right, at]);
        }
        for (at, _) in x.ticks(1.0) {
            line(out, "", [at, top], [at, bottom]);
        }
        for (at, _) in y.ticks(1.0) {
            line(out, "", [left, at], [right, at]);
        }
        out.push_str("</g>\n<g class=\"axis\">");
        for (at, label) in x.ticks(44.0) {
            text(out, "middle", [at, bottom + 18.0], &label);
        }
        for (at, label) in y.ticks(18.0) {
            text(out, "end", [left - 8.0, at + 4.0], &label);
        }
        let middle = f64::midpoint(left, right);
        text(
            out,
            "middle label",
            [middle, self.height - 8.0],
            &self.x_label,
        );
        let height = f64::midpoint(top, bottom);
        let _ = write!(
            out,
            "<text class=\"middle label\" transform=\"translate(14 {height:.1}) rotate(-90)\">{}</text>",
            escaped(&self.y_label)
        );
        out.push_str("</g>\n");
    }

    fn marks(&self, out: &mut String, x: &Axis, y: &Axis) {
        let (left, right, bottom) = (LEFT, self.right(), self.height - BOTTOM);
        out.push_str("<g class=\"marks\">");
        for mark in &self.marks {
            match mark {
                Mark::Across(value, label) => {
                    let at = x.at(*value);
                    let above = self.above();
                    line(out, "", [at, above - 3.0], [at, bottom]);
                    // Labels stay inside the picture.
                    let half = 0.5 * LETTER * label.chars().count() as f64;
                    let middle = at.clamp(half, self.width - half);
                    text(out, "middle", [middle, above - 7.0], label);
                }
                Mark::Along(value, label) => {
                    let at = y.at(*value);
                    line(out, "", [left, at], [right, at]);
                    text(out, "", [right + 6.0, at + 4.0], label);
                }
                Mark::Below(value, _) if y.contains(*value) => {
                    let at = y.at(*value);
                    let _ = write!(
                        out,
                        "<rect class=\"floor\" x=\"{left}\" y=\"{at:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                        right - left,
                        bottom - at
                    );
                }
                Mark::Below(..) => {}
                Mark::At(a, b, title) => {
                    let (a, b) = (x.at(*a), y.at(*b));
                    let _ = write!(
                        out,
                        "<g class=\"foreign\"><title>{}</title>{}</g>",
                        escaped(title),
                        star(a, b)
                    );
                }
            }
        }
        out.push_str("</g>\n");
    }

    /// Draws failed runs in a strip above the scale, and truncated ones in a separate grey strip.
    fn strip(&self, out: &mut String, x: &Axis, cut: bool, from: f64, height: f64) {
        let (class, name) = if cut {
            ("strip cut", "cut")
        } else {
            ("strip", &*self.strip)
        };
        let _ = write!(
            out,
            "<g class=\"{class}\"><rect x=\"{LEFT}\" y=\"{from:.1}\" width=\"{:.1}\" height=\"{height:.1}\"/>",
            self.right() - LEFT
        );
        text(out, "end", [LEFT - 8.0, from + height / 2.0 + 4.0], name);
        // One row for each curve with failures, so that their marks do not overlap.
        let rows = self.failing(cut).count().max(1) as f64;
        for (row, curve) in self.failing(cut).enumerate() {
            let middle = from + height * (row as f64 + 0.5) / rows;
            for ended in curve.failed.iter().filter(|ended| ended.cut == cut) {
                let colour = if cut {
                    "grey".to_owned()
                } else {
                    format!("c{}", curve.number % COLOURS)
                };
                let _ = write!(
                    out,
                    "<g class=\"{colour}\"><title>{}</title>{}</g>",
                    escaped(&ended.title),
                    cross(x.at(ended.x), middle, (height / rows / 2.0 - 1.0).min(4.5))
                );
            }
        }
        out.push_str("</g>\n");
    }
}

impl Curve {
    /// Creates a curve from settings in their order.
    pub fn through(
        number: usize,
        dashed: bool,
        settings: impl IntoIterator<Item = Setting>,
    ) -> Self {
        let mut curve = Self {
            number,
            dashed,
            stretches: Vec::new(),
            failed: Vec::new(),
        };
        let mut stretch = Vec::new();
        for setting in settings {
            match setting {
                Setting::Point(point) => {
                    stretch.push(point);
                    continue;
                }
                Setting::Ended(ended) => curve.failed.push(ended),
                Setting::Unknown => {}
            }
            curve.stretches.push(std::mem::take(&mut stretch));
        }
        curve.stretches.push(stretch);
        curve
    }

    /// Returns the points, in the order of the settings.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.stretches.iter().flatten()
    }

    /// Returns the number of settings that have a place on the plot.
    pub fn len(&self) -> usize {
        self.points().count() + self.failed.len()
    }

    /// Returns whether no setting has a place on the plot.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn draw(&self, out: &mut String, x: &Axis, y: &Axis) {
        let dashed = if self.dashed { " dashed" } else { "" };
        let _ = write!(out, "<g class=\"c{}{dashed}\">", self.number % COLOURS);
        let place = |point: &Point| format!("{:.1},{:.1}", x.at(point.x), y.at(point.y));
        for stretch in &self.stretches {
            // No line to zero, which is not on the logarithmic scale.
            let path = stretch.iter().filter(|point| point.x > 0.0);
            let path: Vec<String> = path.map(place).collect();
            if path.len() > 1 {
                let _ = write!(out, "<polyline points=\"{}\"/>", path.join(" "));
            }
        }
        for point in self.points() {
            let (class, radius) = match point.look {
                Look::Plain => ("", 3.6),
                Look::Marked => (" class=\"marked\"", 6.4),
                Look::Hollow => (" class=\"hollow\"", 3.8),
                Look::Doubtful => (" class=\"doubtful\"", DOUBTFUL),
            };
            let _ = write!(
                out,
                "<g{class}><title>{}</title>{}</g>",
                escaped(&point.title),
                marker(self.number, x.at(point.x), y.at(point.y), radius)
            );
        }
        out.push_str("</g>\n");
    }
}

fn line(out: &mut String, class: &str, from: [f64; 2], to: [f64; 2]) {
    let class = class_attribute(class);
    let _ = write!(
        out,
        "<line{class} x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
        from[0], from[1], to[0], to[1]
    );
}

fn text(out: &mut String, class: &str, at: [f64; 2], text: &str) {
    let class = class_attribute(class);
    let _ = write!(
        out,
        "<text{class} x=\"{:.1}\" y=\"{:.1}\">{}</text>",
        at[0],
        at[1],
        escaped(text)
    );
}
