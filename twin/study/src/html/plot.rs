//! A log–log plot as SVG.

use std::fmt::Write as _;

use super::axis::Axis;
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
}

/// Points that belong together.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Its colour and the shape of its points.
    pub(crate) number: usize,
    pub(crate) dashed: bool,
    pub(crate) points: Vec<Point>,
    /// Where runs failed along the x axis, and why.
    pub(crate) failed: Vec<(f64, String)>,
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
/// Height of the strip in which failures are shown, and the gap below it.
const STRIP: f64 = 26.0;
const GAP: f64 = 6.0;
/// Each curve that failed has so much of it.
const STRIP_ROW: f64 = 10.0;

impl Plot {
    /// The picture.
    pub(crate) fn svg(&self) -> String {
        let failures = self.failing().count();
        let strip = STRIP.max(STRIP_ROW * failures as f64);
        let top = TOP + if failures > 0 { strip + GAP } else { 0.0 };
        let (x, y) = self.axes(top);
        let mut out = format!(
            "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n",
            self.width,
            self.height,
            escaped(&self.title)
        );
        self.grid(&mut out, &x, &y, top);
        self.marks(&mut out, &x, &y, top);
        if failures > 0 {
            self.strip(&mut out, &x, strip);
        }
        for curve in &self.curves {
            curve.draw(&mut out, &x, &y);
        }
        out.push_str("</svg>\n");
        out
    }

    /// The curves on which something failed.
    fn failing(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|curve| !curve.failed.is_empty())
    }

    fn axes(&self, top: f64) -> (Axis, Axis) {
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
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
        let xs = xs.chain(failed.map(|(x, _)| *x));
        let ys = points().map(|point| point.y).chain(along);
        let ys = ys.chain(self.beside.iter().copied());
        (
            Axis::around(xs, LEFT, self.width - RIGHT),
            Axis::around(ys, self.height - BOTTOM, top),
        )
    }

    fn grid(&self, out: &mut String, x: &Axis, y: &Axis, top: f64) {
        let (left, right, bottom) = (LEFT, self.width - RIGHT, self.height - BOTTOM);
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

    fn marks(&self, out: &mut String, x: &Axis, y: &Axis, top: f64) {
        let (left, right, bottom) = (LEFT, self.width - RIGHT, self.height - BOTTOM);
        out.push_str("<g class=\"marks\">");
        for mark in &self.marks {
            match mark {
                Mark::Across(value, label) => {
                    let at = x.at(*value);
                    line(out, "", [at, top], [at, bottom]);
                    // Beside the line, on the side that has room.
                    let beside = if at - left > 20.0 { -5.0 } else { 14.0 };
                    let _ = write!(
                        out,
                        "<text transform=\"translate({:.1} {:.1}) rotate(-90)\">{}</text>",
                        at + beside,
                        bottom - 34.0,
                        escaped(label)
                    );
                }
                Mark::Along(value, label) => {
                    let at = y.at(*value);
                    line(out, "", [left, at], [right, at]);
                    text(out, "end", [right - 6.0, at - 5.0], label);
                }
                Mark::Below(value, label) if y.holds(*value) => {
                    let at = y.at(*value);
                    let _ = write!(
                        out,
                        "<rect class=\"floor\" x=\"{left}\" y=\"{at:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                        right - left,
                        bottom - at
                    );
                    text(out, "", [left + 8.0, bottom - 8.0], label);
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

    /// What failed stands at the top edge, outside of the scale.
    fn strip(&self, out: &mut String, x: &Axis, strip: f64) {
        let _ = write!(
            out,
            "<g class=\"strip\"><rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{strip:.1}\"/>",
            self.width - RIGHT - LEFT
        );
        text(
            out,
            "end",
            [LEFT - 8.0, TOP + strip / 2.0 + 4.0],
            &self.strip,
        );
        // One row for each curve that failed, so that they do not hide each other.
        let rows = self.failing().count().max(1) as f64;
        for (row, curve) in self.failing().enumerate() {
            let height = TOP + strip * (row as f64 + 0.5) / rows;
            for (at, why) in &curve.failed {
                let _ = write!(
                    out,
                    "<g class=\"c{}\"><title>{}</title>{}</g>",
                    curve.number % COLOURS,
                    escaped(why),
                    cross(x.at(*at), height, (strip / rows / 2.0 - 1.0).min(4.5))
                );
            }
        }
        out.push_str("</g>\n");
    }
}

impl Curve {
    fn draw(&self, out: &mut String, x: &Axis, y: &Axis) {
        let dashed = if self.dashed { " dashed" } else { "" };
        let _ = write!(out, "<g class=\"c{}{dashed}\">", self.number % COLOURS);
        let place = |point: &Point| format!("{:.1},{:.1}", x.at(point.x), y.at(point.y));
        // Zero stands apart: nothing is known between it and the next.
        let path = self.points.iter().filter(|point| point.x > 0.0);
        let path: Vec<String> = path.map(place).collect();
        if path.len() > 1 {
            let _ = write!(out, "<polyline points=\"{}\"/>", path.join(" "));
        }
        for point in &self.points {
            let (class, radius) = match point.look {
                Look::Plain => ("", 3.6),
                Look::Marked => (" class=\"marked\"", 6.4),
                Look::Hollow => (" class=\"hollow\"", 3.8),
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

/// A curve's marker and colour, for a legend.
pub(crate) fn swatch(number: usize, dashed: bool) -> String {
    let dashed = if dashed { " dashed" } else { "" };
    format!(
        "<svg class=\"swatch\" viewBox=\"0 0 34 14\"><g class=\"c{}{dashed}\"><polyline points=\"1,7 33,7\"/>{}</g></svg>",
        number % COLOURS,
        shape(number, 17.0, 7.0, 4.2)
    )
}

/// The figure of a foreign point, for a legend.
pub(crate) fn foreign_swatch() -> String {
    format!(
        "<svg class=\"swatch\" viewBox=\"0 0 34 14\"><g class=\"foreign\">{}</g></svg>",
        star(17.0, 7.0)
    )
}

/// The figure of a curve's points.
fn shape(number: usize, x: f64, y: f64, r: f64) -> String {
    let path = |corners: &[(f64, f64)]| {
        let corner = |(a, b): &(f64, f64)| format!("{:.1} {:.1}", x + a * r, y + b * r);
        let corners: Vec<String> = corners.iter().map(corner).collect();
        format!("<path d=\"M{} Z\"/>", corners.join(" L"))
    };
    match number % 6 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\"/>"),
        1 => path(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
        2 => path(&[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)]),
        3 => path(&[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)]),
        4 => path(&[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)]),
        _ => path(&[
            (-1.2, 0.0),
            (-0.6, -1.05),
            (0.6, -1.05),
            (1.2, 0.0),
            (0.6, 1.05),
            (-0.6, 1.05),
        ]),
    }
}

fn cross(x: f64, y: f64, r: f64) -> String {
    format!(
        "<path class=\"cross\" d=\"M{:.1} {:.1} L{:.1} {:.1} M{:.1} {:.1} L{:.1} {:.1}\"/>",
        x - r,
        y - r,
        x + r,
        y + r,
        x - r,
        y + r,
        x + r,
        y - r
    )
}

fn star(x: f64, y: f64) -> String {
    const R: f64 = 5.5;
    format!(
        "{}<path class=\"cross\" d=\"M{:.1} {y:.1} L{:.1} {y:.1}\"/>",
        cross(x, y, R * 0.8),
        x - R,
        x + R
    )
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
