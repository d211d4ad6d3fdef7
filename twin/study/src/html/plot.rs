//! A log–log plot as SVG.

use std::fmt::Write as _;

use super::axis::Axis;
use super::shape::{DOUBTFUL, cross, doubtful_swatch, ground_swatch, shape, star};
use super::text::escaped;

/// Curves of more colours than this begin again at the first.
pub(crate) const COLOURS: usize = 8;

/// A point of a curve.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// What is shown when one points at it.
    pub(crate) title: String,
    pub(crate) look: Look,
}

/// How a point looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    Plain,
    /// Larger: the one to look for.
    Marked,
    /// Hollow: there is something wrong with it.
    Hollow,
    /// Hollow and large, in the colour of failures: it contradicts the settings next to it.
    Doubtful,
}

/// Points that belong together.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Its colour and the shape of its points.
    pub(crate) number: usize,
    pub(crate) dashed: bool,
    /// In the order of the settings. A line connects the points of a stretch, which ends where a run has no point.
    stretches: Vec<Vec<Point>>,
    /// Where runs ended early along the x axis, and why.
    failed: Vec<Ended>,
}

/// A setting on a curve.
#[derive(Clone, Debug)]
pub(crate) enum Setting {
    Point(Point),
    /// Its run has no point.
    Ended(Ended),
    /// Nothing is known that has a place on this plot.
    Unknown,
}

impl Setting {
    /// What is known of a setting: its point, or else how it ended.
    pub(crate) fn of(point: Option<Point>, ended: impl FnOnce() -> Option<Ended>) -> Self {
        match point {
            Some(point) => Self::Point(point),
            None => ended().map_or(Self::Unknown, Self::Ended),
        }
    }
}

/// A run that has no point because it did not come to its end.
#[derive(Clone, Debug)]
pub(crate) struct Ended {
    pub(crate) x: f64,
    /// What is shown when one points at it.
    pub(crate) title: String,
    /// For the budget: nothing is known against it.
    pub(crate) cut: bool,
}

/// A line that means something.
#[derive(Clone, Debug)]
pub(crate) enum Mark {
    /// At this x.
    Across(f64, String),
    /// At this y.
    Along(f64, String),
    /// All below this y.
    Below(f64, String),
    /// A foreign point.
    At(f64, f64, String),
}

/// What is plotted.
#[derive(Clone, Debug)]
pub(crate) struct Plot {
    pub(crate) title: String,
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) x_label: String,
    pub(crate) y_label: String,
    pub(crate) curves: Vec<Curve>,
    pub(crate) marks: Vec<Mark>,
    /// Values that the y axis holds, too: so that plots beside each other have the same.
    pub(crate) beside: Vec<f64>,
    /// What the strip of failures is called.
    pub(crate) strip: String,
}

const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 48.0;
const TOP: f64 = 12.0;
/// Height of a strip in which failures are shown, and the gap below it.
const STRIP: f64 = 26.0;
const GAP: f64 = 6.0;
/// Labels of lines stand outside of the frame, where no curve goes: above it and to its right.
const LABELS_ABOVE: f64 = 16.0;
const LABELS_BESIDE: f64 = 92.0;
/// What a letter of a label takes at most.
const LETTER: f64 = 7.0;
/// Each curve that failed has so much of it.
const STRIP_ROW: f64 = 10.0;

impl Plot {
    /// The picture.
    pub(crate) fn svg(&self) -> String {
        let strips: Vec<f64> = [false, true].map(|cut| self.strip_height(cut)).into();
        let top = self.above() + strips.iter().sum::<f64>();
        let (x, y) = self.axes(top);
        let mut out = format!(
            "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
            self.width,
            self.height,
            escaped(&self.title)
        );
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

    /// The curves on which something failed, or was `cut`.
    fn failing(&self, cut: bool) -> impl Iterator<Item = &Curve> {
        let ended = move |curve: &&Curve| curve.failed.iter().any(|ended| ended.cut == cut);
        self.curves.iter().filter(ended)
    }

    /// Of the strip of what failed, or was `cut`, and the gap below it.
    fn strip_height(&self, cut: bool) -> f64 {
        match self.failing(cut).count() {
            0 => 0.0,
            curves => STRIP.max(STRIP_ROW * curves as f64) + GAP,
        }
    }

    /// Where strips begin, or the frame if there is none.
    fn above(&self) -> f64 {
        let across = |mark: &Mark| matches!(mark, Mark::Across(..));
        TOP + if self.marks.iter().any(across) {
            LABELS_ABOVE
        } else {
            0.0
        }
    }

    /// Where the frame ends on the right.
    fn right(&self) -> f64 {
        let along = |mark: &Mark| matches!(mark, Mark::Along(..));
        let beside = self.marks.iter().any(along);
        self.width - if beside { LABELS_BESIDE } else { RIGHT }
    }

    /// What the shaded ground means, for a legend: in the frame it would lie under curves.
    pub(crate) fn ground(&self) -> Option<(String, String)> {
        let (_, y) = self.axes(TOP);
        self.marks.iter().find_map(|mark| match mark {
            Mark::Below(value, label) if y.holds(*value) => Some((ground_swatch(), label.clone())),
            _ => None,
        })
    }

    /// What a point that contradicts its neighbours means, for a legend.
    pub(crate) fn doubtful(&self) -> Option<(String, String)> {
        let mut points = self.curves.iter().flat_map(Curve::points);
        let any = points.any(|point| point.look == Look::Doubtful);
        any.then(|| {
            let text = "contradicts the settings next to it".to_owned();
            (doubtful_swatch(), text)
        })
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
        let ys = ys.chain(self.beside.iter().copied());
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
                    // No label leaves the picture.
                    let half = 0.5 * LETTER * label.chars().count() as f64;
                    let middle = at.clamp(half, self.width - half);
                    text(out, "middle", [middle, above - 7.0], label);
                }
                Mark::Along(value, label) => {
                    let at = y.at(*value);
                    line(out, "", [left, at], [right, at]);
                    text(out, "", [right + 6.0, at + 4.0], label);
                }
                Mark::Below(value, _) if y.holds(*value) => {
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

    /// What failed stands at the top edge, outside of the scale; what was cut, in a strip of its own and grey.
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
        // One row for each curve that failed, so that they do not hide each other.
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
    /// The curve of settings in their order.
    pub(crate) fn through(
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

    /// Its points, in the order of the settings.
    pub(crate) fn points(&self) -> impl Iterator<Item = &Point> {
        self.stretches.iter().flatten()
    }

    /// How many settings have a place on the plot.
    pub(crate) fn len(&self) -> usize {
        self.points().count() + self.failed.len()
    }

    fn draw(&self, out: &mut String, x: &Axis, y: &Axis) {
        let dashed = if self.dashed { " dashed" } else { "" };
        let _ = write!(out, "<g class=\"c{}{dashed}\">", self.number % COLOURS);
        let place = |point: &Point| format!("{:.1},{:.1}", x.at(point.x), y.at(point.y));
        for stretch in &self.stretches {
            // Zero stands apart: nothing is known between it and the next.
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
                shape(self.number, x.at(point.x), y.at(point.y), radius)
            );
        }
        out.push_str("</g>\n");
    }
}

fn line(out: &mut String, class: &str, from: [f64; 2], to: [f64; 2]) {
    let class = if class.is_empty() {
        String::new()
    } else {
        format!(" class=\"{class}\"")
    };
    let _ = write!(
        out,
        "<line{class} x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
        from[0], from[1], to[0], to[1]
    );
}

fn text(out: &mut String, class: &str, at: [f64; 2], text: &str) {
    let class = if class.is_empty() {
        String::new()
    } else {
        format!(" class=\"{class}\"")
    };
    let _ = write!(
        out,
        "<text{class} x=\"{:.1}\" y=\"{:.1}\">{}</text>",
        at[0],
        at[1],
        escaped(text)
    );
}
