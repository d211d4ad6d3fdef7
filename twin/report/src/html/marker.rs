//! Markers of plots and legends.

/// Number of colours; further curves reuse them from the first.
pub const COLOURS: usize = 8;

/// Radius of the marker of a contradicting point.
pub const DOUBTFUL: f64 = 5.4;

/// Returns the legend swatch of a curve.
pub(crate) fn swatch(number: usize, dashed: bool) -> String {
    let dashed = if dashed { " dashed" } else { "" };
    format!(
        "<svg class=\"swatch\" viewBox=\"0 0 34 14\"><g class=\"c{}{dashed}\"><polyline points=\"1,7 33,7\"/>{}</g></svg>",
        number % COLOURS,
        marker(number, 17.0, 7.0, 4.2)
    )
}

/// Returns the legend swatch of a point from another source.
pub(crate) fn foreign_swatch() -> String {
    format!(
        "<svg class=\"swatch\" viewBox=\"0 0 34 14\"><g class=\"foreign\">{}</g></svg>",
        star(17.0, 7.0)
    )
}

/// Returns the legend swatch of a contradicting point.
pub(crate) fn doubtful_swatch() -> String {
    format!(
        "<svg class=\"swatch\" viewBox=\"0 0 34 14\"><g class=\"doubtful\">{}</g></svg>",
        marker(0, 17.0, 7.0, DOUBTFUL)
    )
}

/// Returns the legend swatch of the shaded region.
pub(crate) fn floor_swatch() -> String {
    "<svg class=\"swatch\" viewBox=\"0 0 34 14\"><rect class=\"floor\" x=\"0\" y=\"0\" width=\"34\" height=\"14\"/></svg>".to_owned()
}

/// Returns the marker of a curve's points.
pub fn marker(number: usize, x: f64, y: f64, r: f64) -> String {
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

/// Returns the mark of a run that ended early.
pub fn cross(x: f64, y: f64, r: f64) -> String {
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

/// Returns the mark of a point from another source.
pub fn star(x: f64, y: f64) -> String {
    const R: f64 = 5.5;
    format!(
        "{}<path class=\"cross\" d=\"M{:.1} {y:.1} L{:.1} {y:.1}\"/>",
        cross(x, y, R * 0.8),
        x - R,
        x + R
    )
}
