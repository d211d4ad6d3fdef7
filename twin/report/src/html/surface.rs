//! Surfaces over two axes as SVG, seen obliquely from above.

use std::fmt::Write as _;

use super::drawing::{Drawing, begin};
use super::element::escaped;

/// Surface over a grid of values.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Text for readers that do not see it.
    pub title: String,
    /// Labels of the axes: first, second and height.
    pub labels: [String; 3],
    /// Values on the first axis, in order, with their texts.
    pub first: Vec<(f64, String)>,
    /// Values on the second axis, likewise.
    pub second: Vec<(f64, String)>,
    /// Heights, one row for each value on the first axis; NaN where there is none.
    pub heights: Vec<Vec<f64>>,
}

const WIDTH: f64 = 540.0;
const HEIGHT: f64 = 400.0;
/// Length of the first and of the second axis on the page: right and down \[px\].
const FIRST: [f64; 2] = [250.0, 105.0];
const SECOND: [f64; 2] = [-190.0, 100.0];
/// Length of the vertical axis \[px\].
const VERTICAL: f64 = 130.0;
/// Least distance of labels, across and down \[px\].
const LABEL: [f64; 2] = [16.0, 14.0];
/// Far corner of the floor \[px\].
const ORIGIN: [f64; 2] = [240.0, 150.0];

/// Projection of shares of the three axes onto the page.
fn place([a, b, c]: [f64; 3]) -> [f64; 2] {
    [
        ORIGIN[0] + a * FIRST[0] + b * SECOND[0],
        ORIGIN[1] + a * FIRST[1] + b * SECOND[1] - c * VERTICAL,
    ]
}

impl Surface {
    /// Returns the drawing.
    pub fn drawing(&self) -> Drawing {
        Drawing::of_svg(self.svg())
    }

    /// Returns the SVG element; empty without two values on each axis.
    pub fn svg(&self) -> String {
        let heights = self.heights.iter().flatten().filter(|it| it.is_finite());
        let low = heights.clone().copied().fold(0.0, f64::min);
        let high = heights.copied().fold(0.0, f64::max);
        if self.first.len() < 2 || self.second.len() < 2 || low == high {
            return String::new();
        }
        let mut out = begin(WIDTH, HEIGHT, &self.title);
        let scale = Scale { low, high };
        self.walls(&mut out, scale);
        self.patches(&mut out, scale);
        self.labels(&mut out, scale);
        out.push_str("</svg>\n");
        out
    }

    /// Draws the frame behind the surface, and the line of zero on it.
    fn walls(&self, out: &mut String, scale: Scale) {
        out.push_str("<g class=\"grid\">");
        let mut line = |from: [f64; 3], to: [f64; 3]| {
            let ([x1, y1], [x2, y2]) = (place(from), place(to));
            // Writing to a `String` cannot fail.
            let _ = write!(
                out,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>"
            );
        };
        for (value, _) in &self.first {
            let a = share(*value, &self.first);
            line([a, 0.0, 0.0], [a, 1.0, 0.0]);
            line([a, 0.0, 0.0], [a, 0.0, 1.0]);
        }
        for (value, _) in &self.second {
            let b = share(*value, &self.second);
            line([0.0, b, 0.0], [1.0, b, 0.0]);
            line([0.0, b, 0.0], [0.0, b, 1.0]);
        }
        for height in [scale.low, 0.0, scale.high] {
            let c = scale.share(height);
            line([0.0, 0.0, c], [1.0, 0.0, c]);
            line([0.0, 0.0, c], [0.0, 1.0, c]);
        }
        out.push_str("</g>\n");
    }

    /// Draws the patches of the surface from the far corner to the near one.
    fn patches(&self, out: &mut String, scale: Scale) {
        let rows = self.first.len() - 1;
        let columns = self.second.len() - 1;
        for diagonal in 0..rows + columns {
            for row in 0..rows {
                let Some(column) = diagonal.checked_sub(row).filter(|it| *it < columns) else {
                    continue;
                };
                self.patch(out, scale, row, column);
            }
        }
    }

    fn patch(&self, out: &mut String, scale: Scale, row: usize, column: usize) {
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
        let corners = corners.map(|(i, j)| (row + i, column + j));
        let height = |(i, j): (usize, usize)| self.heights.get(i)?.get(j).copied();
        let heights = corners.map(|corner| height(corner).unwrap_or(f64::NAN));
        let mean = heights.iter().sum::<f64>() / 4.0;
        if !mean.is_finite() {
            return;
        }
        let mut points = String::new();
        for ((i, j), height) in corners.into_iter().zip(heights) {
            let a = share(self.first[i].0, &self.first);
            let b = share(self.second[j].0, &self.second);
            let [x, y] = place([a, b, scale.share(height)]);
            let _ = write!(points, "{x:.1},{y:.1} ");
        }
        let points = points.trim_end();
        // The sign is a colour, the size its opacity, on a patch that hides those behind it.
        let colour = i32::from(mean > 0.0);
        let opacity = 0.15 + 0.75 * (mean / scale.low.abs().max(scale.high)).abs();
        let _ = writeln!(
            out,
            "<polygon points=\"{points}\" fill=\"var(--card)\" stroke=\"none\"/>\
             <polygon class=\"c{colour}\" points=\"{points}\" fill-opacity=\"{opacity:.2}\" \
             stroke-width=\"0.6\"/>"
        );
    }

    fn labels(&self, out: &mut String, scale: Scale) {
        out.push_str("<g class=\"axis\">");
        let mut text = |class: &str, [x, y]: [f64; 2], text: &str| {
            let _ = write!(
                out,
                "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>",
                escaped(text)
            );
        };
        let mut last = f64::NEG_INFINITY;
        for (value, label) in &self.first {
            let at = share(*value, &self.first);
            let [x, y] = place([at, 1.0, 0.0]);
            if x - last >= LABEL[0] {
                text("end", [x - 5.0, y + 12.0], label);
                last = x;
            }
        }
        for (value, label) in &self.second {
            let [x, y] = place([1.0, share(*value, &self.second), 0.0]);
            text("", [x + 6.0, y + 12.0], label);
        }
        let mut labelled: Vec<f64> = Vec::new();
        for height in [scale.low, scale.high, 0.0] {
            let [x, y] = place([1.0, 0.0, scale.share(height)]);
            if labelled.iter().all(|other| (y - other).abs() >= LABEL[1]) {
                text("", [x + 6.0, y - 3.0], &format!("{height:.0}"));
                labelled.push(y);
            }
        }
        let [x, y] = place([0.5, 1.0, 0.0]);
        text("end label", [x - 44.0, y + 26.0], &self.labels[0]);
        let [x, y] = place([1.0, 0.5, 0.0]);
        text("label", [x + 24.0, y + 26.0], &self.labels[1]);
        text("end label", [WIDTH - 4.0, 16.0], &self.labels[2]);
        out.push_str("</g>\n");
    }
}

/// Vertical axis between two heights.
#[derive(Clone, Copy, Debug)]
struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    fn share(self, height: f64) -> f64 {
        (height - self.low) / (self.high - self.low)
    }
}

/// Returns the share of an axis at which a value is.
fn share(value: f64, axis: &[(f64, String)]) -> f64 {
    let (Some((from, _)), Some((to, _))) = (axis.first(), axis.last()) else {
        return 0.0;
    };
    (value - from) / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(values: &[f64]) -> Vec<(f64, String)> {
        values.iter().map(|it| (*it, it.to_string())).collect()
    }

    fn surface(heights: Vec<Vec<f64>>) -> Surface {
        Surface {
            title: "a <surface>".to_owned(),
            labels: ["x", "y", "z"].map(str::to_owned),
            first: axis(&[-1.0, -2.0, -4.0]),
            second: axis(&[1.0, 2.0]),
            heights,
        }
    }

    #[test]
    fn patches_have_the_colour_of_their_sign_and_gaps_have_none() {
        let svg = surface(vec![vec![3.0, 2.0], vec![1.0, 1.0], vec![-9.0, -9.0]]).svg();
        assert_eq!(svg.matches("class=\"c1\"").count(), 1);
        assert_eq!(svg.matches("class=\"c0\"").count(), 1);
        assert!(svg.contains("a &lt;surface&gt;"));
        // A mean of -4, where the greatest magnitude is 9.
        assert!(svg.contains("fill-opacity=\"0.48\""));
        // The first axis has its labels in front, where the second one ends.
        assert!(svg.contains("x=\"295.0\" y=\"367.0\">-4<"));
        let gap = surface(vec![vec![3.0, 2.0], vec![1.0, f64::NAN], vec![-9.0, -9.0]]).svg();
        assert_eq!(gap.matches("class=\"c").count(), 0);
        assert_eq!(surface(vec![vec![0.0; 2]; 3]).svg(), "");
    }
}
