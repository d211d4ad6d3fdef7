//! Terrain in MuJoCo: a plane, boxes, or a height field, which is flat in triangles between
//! samples.

use core::fmt::Write;

use nalgebra::Vector3;
use twinrig_contact::Ground;

use super::sections::{Sections, line};
use crate::model::{Area, FOOT_RADIUS, GroundModel};

/// Extent of a terrain of boxes from its edge \[m\].
const EXTENT: f64 = 100.0;

/// Writes the ground, lowered by the radius of a foot, so that a foot in contact has its centre on
/// the ground.
pub(super) fn write(ground_model: &GroundModel, to: &mut Sections) {
    // MuJoCo takes the greater of the coefficients of foot and ground: that of the foot, with
    // patches.
    let friction = if ground_model.ground.has_patches() {
        0.0
    } else {
        ground_model.ground.friction
    };
    let contact = format!("friction=\"{friction} 0 0\" contype=\"0\" conaffinity=\"1\"");
    match &ground_model.area {
        Area::Flat { height } => {
            let z = height - FOOT_RADIUS;
            line!(
                to.world,
                "    <geom name=\"ground\" type=\"plane\" size=\"0 0 1\" pos=\"0 0 {z}\" {contact}/>"
            );
        }
        Area::Levels(levels) => boxes(levels, &contact, to),
        Area::Heights {
            from,
            to: end,
            points,
        } => field(&ground_model.ground, *from, *end, *points, &contact, to),
    }
}

/// Writes a box for each level.
fn boxes(levels: &[(f64, f64, f64)], contact: &str, to: &mut Sections) {
    let heights = levels.iter().map(|(_, _, height)| height.abs());
    let low = heights.fold(0.0, f64::max) + 1.0;
    let outer = 0.5 * EXTENT;
    for (index, (begin, end, top)) in levels.iter().enumerate() {
        let (x, half) = match (begin.is_finite(), end.is_finite()) {
            (false, _) => (end - outer, outer),
            (_, false) => (begin + outer, outer),
            _ => (0.5 * (begin + end), 0.5 * (end - begin)),
        };
        let name = match index {
            0 => "ground".to_owned(),
            _ => format!("ground_{index}"),
        };
        let z = top - FOOT_RADIUS - 0.5 * low;
        line!(
            to.world,
            "    <geom name=\"{name}\" type=\"box\" size=\"{half} {outer} {}\" pos=\"{x} 0 {z}\" {contact}/>",
            0.5 * low
        );
    }
}

/// Writes samples of the ground, row by row.
fn field(
    ground: &Ground,
    from: [f64; 2],
    end: [f64; 2],
    [columns, rows]: [usize; 2],
    contact: &str,
    to: &mut Sections,
) {
    let at = |axis: usize, i: usize, count: usize| {
        from[axis] + (end[axis] - from[axis]) * i as f64 / (count - 1) as f64
    };
    let mut heights = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let point = Vector3::new(at(0, column, columns), at(1, row, rows), 0.0);
            let below = ground.below(&point);
            heights.push(-below.gap / below.normal.z);
        }
    }
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // MuJoCo requires a positive height, which a level field does not have.
    let height_range = (highest - lowest).max(1e-6);
    let half = [0, 1].map(|axis| 0.5 * (end[axis] - from[axis]));
    let middle = [0, 1].map(|axis| 0.5 * (end[axis] + from[axis]));
    let mut words = String::with_capacity(9 * heights.len());
    for height in &heights {
        // MuJoCo stores single precision.
        let _ = write!(words, " {:.8}", (height - lowest) / height_range);
    }
    line!(
        to.assets,
        "    <hfield name=\"ground\" nrow=\"{rows}\" ncol=\"{columns}\" size=\"{} {} {height_range} 1\" elevation=\"{}\"/>",
        half[0],
        half[1],
        words.trim_start()
    );
    line!(
        to.world,
        "    <geom name=\"ground\" type=\"hfield\" hfield=\"ground\" pos=\"{} {} {}\" {contact}/>",
        middle[0],
        middle[1],
        lowest - FOOT_RADIUS
    );
}
