//! Table of the symbols of a drawing.

use twinrig_kernel::Unit;

use super::canvas::{Canvas, LINE, Px, text_width, truncated};
use crate::robot_facts::{LegKind, shown};

/// Width of the columns symbol, key, value and meaning, in characters.
const COLUMNS: [usize; 4] = [9, 28, 18, 78];

/// Returns the rows of a leg: symbol, key of the robot file, value, meaning.
pub(super) fn rows(kind: &LegKind) -> Vec<[String; 4]> {
    let (leg, mechanism) = (&kind.leg, &kind.pantograph);
    let mut rows = Vec::new();
    let mut row = |symbol: &str, key: &str, value: f64, unit: Unit, meaning: &str| {
        let key = match key {
            "" => "(follows)".to_owned(),
            key => kind.key(key),
        };
        let value = shown(&[value], unit);
        rows.push([symbol.to_owned(), key, value, meaning.to_owned()]);
    };
    let m = Unit::Meter;
    row("l1", "l1", leg.l1, m, "first segment: hip to knee");
    row(
        "l2",
        "l2",
        leg.l2,
        m,
        "second segment: knee to ankle; the parallel rod when closed",
    );
    row(
        "l3",
        "l3",
        leg.l3,
        m,
        "third segment: end of the parallel rod, past the ankle, to the foot",
    );
    row(
        "l_Δ",
        "l_delta",
        leg.l_delta,
        m,
        "offset of the rods on segments 1 and 3, above knee and ankle",
    );
    let angle = "angle from first to second segment in the extended leg, where q2 = 0";
    row("q2_ref", "q2_ref", leg.q2_ref, Unit::Radian, angle);
    let k = Unit::NewtonPerMeter;
    let (diagonal, parallel) = (&leg.diagonal, &leg.parallel);
    row(
        "k_d",
        "diagonal.stiffness",
        diagonal.stiffness,
        k,
        "diagonal spring, rod end on segment 1 to ankle: extends the leg",
    );
    row(
        "p_d",
        "diagonal.preload",
        diagonal.preload,
        m,
        "its deformation in the extended leg",
    );
    row(
        "l_d,max",
        "",
        mechanism.diagonal_max(),
        m,
        "its length in the extended leg",
    );
    row(
        "l_d,min",
        "diagonal_min",
        leg.diagonal_min,
        m,
        "its shortest length, where the leg bottoms out",
    );
    row(
        "k_p",
        "parallel.stiffness",
        parallel.stiffness,
        k,
        "parallel spring, between the rod ends: keeps segments 1 and 3 parallel",
    );
    row(
        "p_p",
        "parallel.preload",
        parallel.preload,
        m,
        "its deformation while the pantograph is closed",
    );
    row(
        "",
        "parallel_travel",
        leg.parallel_travel,
        m,
        "greatest opening of the parallel rod beyond l2",
    );
    row(
        "r",
        "pulley_radius",
        leg.pulley_radius,
        m,
        "pulley that winds the cable from hip to ankle",
    );
    if let Some(toe) = leg.toe {
        row(
            "",
            "toe.length",
            toe.length,
            m,
            "segment beyond the foot joint",
        );
        row(
            "",
            "toe.rest",
            toe.rest,
            Unit::Radian,
            "its unloaded angle against the third segment",
        );
        let stiffness = "its torsion spring";
        row(
            "",
            "toe.stiffness",
            toe.stiffness,
            Unit::NewtonMeterPerRadian,
            stiffness,
        );
    }
    row(
        "L_max",
        "",
        mechanism.length_max(),
        m,
        "hip to foot, extended",
    );
    row(
        "L_min",
        "",
        mechanism.length_min(),
        m,
        "hip to foot, diagonal at its stop and pantograph closed",
    );
    rows
}

/// Writes a table with its upper left corner at `at` and returns its height \[px\].
pub(super) fn draw(canvas: &mut Canvas, at: Px, rows: &[[String; 4]]) -> f64 {
    let header = ["symbol", "key", "value", "meaning"].map(str::to_owned);
    let mut y = at[1];
    for (n, row) in std::iter::once(&header).chain(rows).enumerate() {
        y += LINE;
        let mut x = at[0];
        for (text, width) in row.iter().zip(COLUMNS) {
            let class = if n == 0 { "title" } else { "label" };
            if !text.is_empty() {
                canvas.label(class, [x, y], &truncated(text, width - 1));
            }
            x += text_width(&"m".repeat(width));
        }
    }
    y + LINE - at[1]
}
