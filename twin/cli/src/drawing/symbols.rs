//! Table of the symbols of a drawing.

use twinrig_kernel::Unit;

use super::canvas::{Canvas, LINE, Px, text_width, truncated};
use crate::robot_facts::{LegKind, shown};

/// Width of the columns symbol, key, value and meaning, in characters.
const COLUMNS: [usize; 4] = [9, 28, 18, 78];

/// A symbol of the drawing or an entry of a leg's table.
struct Symbol {
    /// Empty for entries that the drawing does not name.
    sign: &'static str,
    /// Key below the table of the leg; empty for what follows from others.
    key: &'static str,
    unit: Unit,
    meaning: &'static str,
    /// Returns the value (SI); none for a leg without it.
    value: fn(&LegKind) -> Option<f64>,
}

const fn symbol(
    sign: &'static str,
    key: &'static str,
    unit: Unit,
    meaning: &'static str,
    value: fn(&LegKind) -> Option<f64>,
) -> Symbol {
    Symbol {
        sign,
        key,
        unit,
        meaning,
        value,
    }
}

const M: Unit = Unit::Meter;
const K: Unit = Unit::NewtonPerMeter;
const RAD: Unit = Unit::Radian;
const TORSION: Unit = Unit::NewtonMeterPerRadian;

#[rustfmt::skip]
const SYMBOLS: &[Symbol] = &[
    symbol("l1", "l1", M, "first segment: hip to knee", |k| Some(k.leg.l1)),
    symbol("l2", "l2", M, "second segment: knee to ankle; the parallel rod when closed",
        |k| Some(k.leg.l2)),
    symbol("l3", "l3", M, "third segment: end of the parallel rod, past the ankle, to the foot",
        |k| Some(k.leg.l3)),
    symbol("l_Δ", "l_delta", M, "offset of the rods on segments 1 and 3, above knee and ankle",
        |k| Some(k.leg.l_delta)),
    symbol("q2_ref", "q2_ref", RAD,
        "angle from first to second segment in the extended leg, where q2 = 0",
        |k| Some(k.leg.q2_ref)),
    symbol("k_d", "diagonal.stiffness", K,
        "diagonal spring, rod end on segment 1 to ankle: extends the leg",
        |k| Some(k.leg.diagonal.stiffness)),
    symbol("p_d", "diagonal.preload", M, "its deformation in the extended leg",
        |k| Some(k.leg.diagonal.preload)),
    symbol("l_d,max", "", M, "its length in the extended leg",
        |k| Some(k.pantograph.diagonal_max())),
    symbol("l_d,min", "diagonal_min", M, "its shortest length, where the leg bottoms out",
        |k| Some(k.leg.diagonal_min)),
    symbol("k_p", "parallel.stiffness", K,
        "parallel spring, between the rod ends: keeps segments 1 and 3 parallel",
        |k| Some(k.leg.parallel.stiffness)),
    symbol("p_p", "parallel.preload", M, "its deformation while the pantograph is closed",
        |k| Some(k.leg.parallel.preload)),
    symbol("", "parallel_travel", M, "greatest opening of the parallel rod beyond l2",
        |k| Some(k.leg.parallel_travel)),
    symbol("r", "pulley_radius", M, "pulley that winds the cable from hip to ankle",
        |k| Some(k.leg.pulley_radius)),
    symbol("", "toe.length", M, "segment beyond the foot joint", |k| Some(k.leg.toe?.length)),
    symbol("", "toe.rest", RAD, "its unloaded angle against the third segment",
        |k| Some(k.leg.toe?.rest)),
    symbol("", "toe.stiffness", TORSION, "its torsion spring", |k| Some(k.leg.toe?.stiffness)),
    symbol("L_max", "", M, "hip to foot, extended", |k| Some(k.pantograph.length_max())),
    symbol("L_min", "", M, "hip to foot, diagonal at its stop and pantograph closed",
        |k| Some(k.pantograph.length_min())),
];

/// Returns the rows of a leg: symbol, key of the robot file, value, meaning.
pub(super) fn rows(kind: &LegKind) -> Vec<[String; 4]> {
    let rows = SYMBOLS.iter().filter_map(|symbol| {
        let value = (symbol.value)(kind)?;
        let key = match symbol.key {
            "" => "(follows)".to_owned(),
            key => kind.key(key),
        };
        let value = shown(&[value], symbol.unit);
        Some([
            symbol.sign.to_owned(),
            key,
            value,
            symbol.meaning.to_owned(),
        ])
    });
    rows.collect()
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
