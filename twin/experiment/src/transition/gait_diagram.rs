//! Gait diagrams as SVG: footfalls, classes, variable, speed and slip over time.

use std::fmt::Write as _;

use twinrig_report::html::drawing::{Drawing, begin};
use twinrig_report::html::element::escaped;
use twinrig_report::html::marker::COLOURS;

use super::results::TransitionResult;
use super::{GaitCycle, MIXED, STANDING};

/// Part of a run that is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GaitDiagram<'r> {
    pub(crate) result: &'r TransitionResult,
    /// Names of the classes, whose places select colours.
    pub(crate) classes: &'r [String],
    /// Name of the variable with its unit.
    pub(crate) variable: &'r str,
    /// Interval of time \[s\].
    pub(crate) span_s: [f64; 2],
}

const WIDTH: f64 = 1080.0;
const LEFT: f64 = 96.0;
const RIGHT: f64 = 16.0;
/// Height of a row of footfalls, and of its bar \[px\].
const LEG: [f64; 2] = [16.0, 11.0];
/// Height of the band of classes \[px\].
const BAND: f64 = 18.0;
/// Height of a curve, and gap above it \[px\].
const CURVE: [f64; 2] = [54.0, 20.0];
const BOTTOM: f64 = 34.0;
const TOP: f64 = 6.0;
/// Least distance of the ticks of time \[px\].
const TICK: f64 = 70.0;

/// Returns the colour of a class; none for mixed cycles and standing.
pub(crate) fn colour(class: &str, classes: &[String]) -> Option<usize> {
    let named = classes.iter().position(|other| other == class)?;
    (class != MIXED && class != STANDING).then_some(named % COLOURS)
}

impl GaitDiagram<'_> {
    /// Returns the drawing.
    pub(crate) fn drawing(&self) -> Drawing {
        let legs = self.result.run.legs.len() as f64;
        let curves = TOP + legs * LEG[0] + BAND + 6.0;
        let height = curves + 3.0 * (CURVE[0] + CURVE[1]) + BOTTOM;
        let plant = &self.result.case.plant;
        let mut out = begin(WIDTH, height, &format!("gait diagram of {plant}"));
        self.ticks(&mut out, height - BOTTOM);
        self.footfalls(&mut out);
        self.band(&mut out, TOP + legs * LEG[0] + 4.0);
        let end = self.result.run.fell_at_s.unwrap_or(self.result.run.end_s);
        let curves_of = [
            (self.variable, staircase(&self.result.case.values, end)),
            ("speed [m/s]", self.result.speeds.clone()),
            ("slip [m per s]", self.result.slips.clone()),
        ];
        for (row, (label, points)) in curves_of.iter().enumerate() {
            let top = curves + row as f64 * (CURVE[0] + CURVE[1]) + CURVE[1];
            self.curve(&mut out, top, label, points);
        }
        out.push_str("</svg>\n");
        Drawing::of_svg(out)
    }

    /// Returns the position of an instant \[px\].
    fn x(&self, at_s: f64) -> f64 {
        let [from, to] = self.span_s;
        let share = ((at_s - from) / (to - from)).clamp(0.0, 1.0);
        LEFT + share * (WIDTH - LEFT - RIGHT)
    }

    fn overlaps(&self, begin_s: f64, end_s: f64) -> bool {
        end_s > self.span_s[0] && begin_s < self.span_s[1]
    }

    fn ticks(&self, out: &mut String, bottom: f64) {
        let [from, to] = self.span_s;
        let least = (to - from) * TICK / (WIDTH - LEFT - RIGHT);
        let power = libm::pow(10.0, libm::floor(libm::log10(least)));
        let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
        let step = steps.into_iter().find(|step| *step >= least);
        let step = step.unwrap_or(least);
        let mut at = libm::ceil(from / step) * step;
        let (mut lines, mut labels) = (String::new(), String::new());
        while at <= to + 1e-9 * step {
            let x = self.x(at);
            // Writing to a `String` cannot fail.
            let _ = write!(
                lines,
                "<line x1=\"{x:.1}\" y1=\"{TOP}\" x2=\"{x:.1}\" y2=\"{bottom:.1}\"/>"
            );
            let label = twinrig_report::number::plain(at);
            let y = bottom + 14.0;
            let _ = write!(
                labels,
                "<text class=\"middle\" x=\"{x:.1}\" y=\"{y:.1}\">{label}</text>"
            );
            at += step;
        }
        let (x, y) = (f64::midpoint(LEFT, WIDTH - RIGHT), bottom + 29.0);
        let _ = writeln!(
            out,
            "<g class=\"grid\">{lines}</g>\n<g class=\"axis\">{labels}\
             <text class=\"middle label\" x=\"{x:.1}\" y=\"{y:.1}\">time  [s]</text></g>"
        );
    }

    fn footfalls(&self, out: &mut String) {
        let run = &self.result.run;
        for (leg, name) in run.legs.iter().enumerate() {
            let top = TOP + leg as f64 * LEG[0];
            let _ = write!(
                out,
                "<g class=\"c7\"><text stroke=\"none\" x=\"8\" y=\"{:.1}\">{}</text>",
                top + LEG[1],
                escaped(name)
            );
            for step in run.footsteps.iter().filter(|step| step.leg == leg) {
                let end_s = step.lift_off_s.unwrap_or(run.end_s);
                if self.overlaps(step.touch_down_s, end_s) {
                    let (from, to) = (self.x(step.touch_down_s), self.x(end_s));
                    let _ = write!(
                        out,
                        "<rect stroke=\"none\" x=\"{from:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{}\"/>",
                        (to - from).max(0.3),
                        LEG[1]
                    );
                }
            }
            out.push_str("</g>\n");
        }
    }

    /// Draws the classes; cycles of one class in a row are one rectangle.
    fn band(&self, out: &mut String, top: f64) {
        let _ = write!(out, "<text x=\"8\" y=\"{:.1}\">gait</text>", top + 11.0);
        let mut spans: Vec<(&GaitCycle, f64)> = Vec::new();
        for cycle in &self.result.cycles {
            match spans.last_mut() {
                Some((first, end_s))
                    if first.class == cycle.class && cycle.begin_s - *end_s < 1e-6 =>
                {
                    *end_s = cycle.end_s;
                }
                _ => spans.push((cycle, cycle.end_s)),
            }
        }
        for (first, end_s) in spans {
            let colour = colour(&first.class, self.classes);
            if !self.overlaps(first.begin_s, end_s) || first.class == STANDING {
                continue;
            }
            let class = colour.map_or("floor".to_owned(), |colour| format!("c{colour}"));
            let (from, to) = (self.x(first.begin_s), self.x(end_s));
            let _ = write!(
                out,
                "<rect class=\"{class}\" stroke=\"none\" x=\"{from:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                (to - from).max(0.3),
                BAND - 4.0
            );
        }
        out.push('\n');
    }

    fn curve(&self, out: &mut String, top: f64, label: &str, points: &[[f64; 2]]) {
        let drawn = clipped(points, self.span_s);
        let heights = || drawn.iter().map(|point| point[1]);
        let (low, high) = (heights().fold(0.0, f64::min), heights().fold(0.0, f64::max));
        let range = if high > low { high - low } else { 1.0 };
        let y = |value: f64| top + CURVE[0] * (1.0 - (value - low) / range);
        let places = drawn.iter();
        let places = places.map(|&[at, value]| format!("{:.1},{:.1}", self.x(at), y(value)));
        let places: Vec<String> = places.collect();
        let bottom = top + CURVE[0];
        let end = LEFT - 6.0;
        let _ = writeln!(
            out,
            "<g class=\"grid\"><line x1=\"{LEFT}\" y1=\"{bottom:.1}\" x2=\"{:.1}\" y2=\"{bottom:.1}\"/></g>\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>\
             <text class=\"end\" x=\"{end}\" y=\"{:.1}\">{}</text>\
             <text class=\"end\" x=\"{end}\" y=\"{:.1}\">{}</text>\
             <g class=\"c0\"><polyline points=\"{}\"/></g>",
            WIDTH - RIGHT,
            LEFT + 4.0,
            top - 3.0,
            escaped(label),
            top + 8.0,
            twinrig_report::number::plain(high),
            bottom,
            twinrig_report::number::plain(low),
            places.join(" ")
        );
    }
}

/// Returns the part of a curve within a span, with its ends on the straight lines between points.
fn clipped(points: &[[f64; 2]], [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let mut found = Vec::new();
    for (place, &[x, y]) in points.iter().enumerate() {
        let before = place.checked_sub(1).map(|before| points[before]);
        if let Some([x0, y0]) = before {
            let crossed = [from, to]
                .into_iter()
                .filter(|edge| x0 < *edge && *edge < x);
            found.extend(crossed.map(|edge| [edge, y0 + (y - y0) * (edge - x0) / (x - x0)]));
        }
        if (from..=to).contains(&x) {
            found.push([x, y]);
        }
    }
    found.retain(|point| point[1].is_finite());
    found
}

/// Returns the corners of a staircase up to `end_s`.
fn staircase(values: &[[f64; 2]], end_s: f64) -> Vec<[f64; 2]> {
    let ends = values.iter().skip(1).map(|it| it[0]).chain([end_s]);
    let steps = values.iter().zip(ends);
    steps
        .flat_map(|(&[from, value], to)| [[from, value], [to.max(from), value]])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_is_clipped_on_its_lines() {
        let curve = [[0.0, 0.0], [4.0, 8.0], [4.0, 2.0], [10.0, 2.0]];
        let ends = [[1.0, 2.0], [4.0, 8.0], [4.0, 2.0], [5.0, 2.0]];
        assert_eq!(clipped(&curve, [1.0, 5.0]), ends);
        assert_eq!(clipped(&curve, [6.0, 7.0]), [[6.0, 2.0], [7.0, 2.0]]);
        assert_eq!(clipped(&curve, [11.0, 12.0]), [[0.0; 2]; 0]);
    }

    #[test]
    fn staircase_has_a_corner_at_each_change() {
        let steps = staircase(&[[0.0, 1.0], [3.0, 2.0]], 5.0);
        assert_eq!(steps, [[0.0, 1.0], [3.0, 1.0], [3.0, 2.0], [5.0, 2.0]]);
    }
}
