//! Terrain as MuJoCo has it: a plane, boxes, or a field of heights between which it is flat in triangles.

use core::fmt::Write;

use nalgebra::Vector3;
use twinrig_contact::Ground;

use super::{Sections, line};
use crate::model::{Area, FOOT_RADIUS, Relief};

/// How far a terrain of boxes reaches from where it changes \[m\].
const FAR: f64 = 100.0;

/// Writes the ground, lower by the radius of a foot: so the foot's centre is on the ground where the foot touches.
pub(super) fn write(relief: &Relief, to: &mut Sections) {
    let touching = format!(
        "friction=\"{} 0 0\" contype=\"0\" conaffinity=\"1\"",
        relief.ground.friction
    );
    match &relief.area {
        Area::Flat { height } => {
            let z = height - FOOT_RADIUS;
            line!(
                to.world,
                "    <geom name=\"ground\" type=\"plane\" size=\"0 0 1\" pos=\"0 0 {z}\" {touching}/>"
            );
        }
        Area::StepDown { at, drop } => {
            let (half, low) = (0.5 * FAR, drop.abs() + 1.0);
            for (name, x, top) in [
                ("ground", at - half, 0.0),
                ("ground_below", at + half, -drop),
            ] {
                let z = top - FOOT_RADIUS - 0.5 * low;
                line!(
                    to.world,
                    "    <geom name=\"{name}\" type=\"box\" size=\"{half} {half} {}\" pos=\"{x} 0 {z}\" {touching}/>",
                    0.5 * low
                );
            }
        }
        Area::Heights {
            from,
            to: until,
            points,
        } => field(&relief.ground, *from, *until, *points, &touching, to),
    }
}

/// Samples of the ground, row by row.
fn field(
    ground: &Ground,
    from: [f64; 2],
    until: [f64; 2],
    [columns, rows]: [usize; 2],
    touching: &str,
    to: &mut Sections,
) {
    let at = |axis: usize, i: usize, count: usize| {
        from[axis] + (until[axis] - from[axis]) * i as f64 / (count - 1) as f64
    };
    let mut heights = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let point = Vector3::new(at(0, column, columns), at(1, row, rows), 0.0);
            let below = ground.below(&point);
            heights.push(-below.gap / below.normal.z);
        }
    }
    let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let most = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // MuJoCo wants some height; a level field has none.
    let tall = (most - least).max(1e-6);
    let half = [0, 1].map(|axis| 0.5 * (until[axis] - from[axis]));
    let middle = [0, 1].map(|axis| 0.5 * (until[axis] + from[axis]));
    let mut words = String::with_capacity(9 * heights.len());
    for height in &heights {
        // Single precision is what MuJoCo keeps.
        let _ = write!(words, " {:.8}", (height - least) / tall);
    }
    line!(
        to.assets,
        "    <hfield name=\"ground\" nrow=\"{rows}\" ncol=\"{columns}\" size=\"{} {} {tall} 1\" elevation=\"{}\"/>",
        half[0],
        half[1],
        words.trim_start()
    );
    line!(
        to.world,
        "    <geom name=\"ground\" type=\"hfield\" hfield=\"ground\" pos=\"{} {} {}\" {touching}/>",
        middle[0],
        middle[1],
        least - FOOT_RADIUS
    );
}
