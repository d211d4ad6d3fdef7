//! Mass and inertia of shapes.

use core::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;
use twinrig_document::Problem;

use super::{Reader, upright};
use crate::tree::{Frame, Inertial};

/// Density of shapes without mass \[kg/m³\].
const DENSITY: f64 = 1000.0;

/// A shape of a body.
pub(super) struct Shape<'n> {
    pub(super) kind: &'n str,
    pub(super) frame: Frame,
    /// Radius and half length, or half edges \[m\].
    pub(super) size: [f64; 3],
}

impl<'n, 't: 'n> Reader<'n, 't> {
    pub(super) fn shape(&self, node: Node<'n, 't>, class: &str) -> Result<Shape<'n>, Problem> {
        let kind = self.word(node, class, "type").unwrap_or("sphere");
        let mut frame = self.frame(node, class)?;
        let listed = match self.holder(node, class, "size") {
            Some(holder) => self.text.list(holder, "size")?.unwrap_or_default(),
            None => Vec::new(),
        };
        let mut size = [0.0; 3];
        for (to, from) in size.iter_mut().zip(listed) {
            *to = from;
        }
        if let Some([a, b, c, d, e, f]) = self.numbers(node, class, "fromto")? {
            let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            let length = (to - from).norm();
            if length <= 0.0 {
                return Err(self.text.problem(node, "the shape has no length", ""));
            }
            frame = Frame {
                rotation: upright((to - from) / length),
                position: (from + to) * 0.5,
            };
            size[if kind == "box" { 2 } else { 1 }] = 0.5 * length;
        }
        Ok(Shape { kind, frame, size })
    }

    /// Returns mass and inertia of a shape.
    pub(super) fn of_shape(
        &self,
        node: Node<'n, 't>,
        class: &str,
        shape: &Shape<'n>,
    ) -> Result<Inertial, Problem> {
        let mass = self.numbers(node, class, "mass")?.map(|[mass]| mass);
        if mass == Some(0.0) {
            return Ok(Inertial::none());
        }
        let density = self
            .numbers(node, class, "density")?
            .map_or(DENSITY, |[density]| density);
        let Some((volume, per_mass)) = solid(shape.kind, shape.size) else {
            let message = format!("the mass of the {} is not known", shape.kind);
            let help =
                "give its body an <inertial>: MuJoCo writes it into the models that it saves";
            return Err(self.text.problem(node, message, help));
        };
        let mass = mass.unwrap_or(density * volume);
        if mass < 0.0 {
            return Err(self.text.problem(node, "the mass is negative", ""));
        }
        let own = Inertial {
            mass,
            centre: Vector3::zeros(),
            inertia: Matrix3::from_diagonal(&(per_mass * mass)),
        };
        Ok(own.seen_from(&shape.frame))
    }
}

/// Returns the volume \[m³\] of a solid, and its moments of inertia per mass \[m²\].
fn solid(kind: &str, size: [f64; 3]) -> Option<(f64, Vector3<f64>)> {
    let [r, h, _] = size;
    let round = |across: f64, axial: f64| Vector3::new(across, across, axial);
    match kind {
        "sphere" => Some((4.0 / 3.0 * PI * r * r * r, Vector3::repeat(0.4 * r * r))),
        "box" | "ellipsoid" => {
            let [x, y, z] = size.map(|half| half * half);
            let moments = Vector3::new(y + z, x + z, x + y);
            let volume = size.iter().product::<f64>();
            Some(match kind {
                "box" => (8.0 * volume, moments / 3.0),
                _ => (4.0 / 3.0 * PI * volume, moments / 5.0),
            })
        }
        "cylinder" => {
            let volume = 2.0 * PI * r * r * h;
            Some((volume, round(r * r / 4.0 + h * h / 3.0, 0.5 * r * r)))
        }
        "capsule" => {
            // A cylinder between two halves of a ball, whose centres of mass are 3/8 r beyond its
            // ends.
            let (tube, ball) = (2.0 * PI * r * r * h, 4.0 / 3.0 * PI * r * r * r);
            let volume = tube + ball;
            let (tube, ball) = (tube / volume, ball / volume);
            let across =
                tube * (r * r / 4.0 + h * h / 3.0) + ball * (0.4 * r * r + h * h + 0.75 * h * r);
            Some((
                volume,
                round(across, tube * 0.5 * r * r + ball * 0.4 * r * r),
            ))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half the number of cells of a grid along each axis.
    const CELLS: i32 = 40;

    #[test]
    fn solids_match_sums_over_cells() {
        let size = [0.3, 0.5, 0.4];
        let [a, b, c] = size;
        let ball = |x: f64, y: f64, z: f64| x * x + y * y + z * z;
        let inside = |kind: &str, x: f64, y: f64, z: f64| match kind {
            "sphere" => ball(x, y, z) <= a * a,
            "box" => x.abs() <= a && y.abs() <= b && z.abs() <= c,
            "ellipsoid" => ball(x / a, y / b, z / c) <= 1.0,
            "cylinder" => ball(x, y, 0.0) <= a * a && z.abs() <= b,
            _ => ball(x, y, (z.abs() - b).max(0.0)) <= a * a,
        };
        for kind in ["sphere", "box", "ellipsoid", "cylinder", "capsule"] {
            let cell = 0.8 / f64::from(CELLS);
            let at = |n: i32| (f64::from(n) + 0.5) * cell;
            let (mut volume, mut moments) = (0.0, Vector3::zeros());
            for index in 0..8 * CELLS * CELLS * CELLS {
                let (i, j, k) = (
                    index % (2 * CELLS),
                    index / (2 * CELLS) % (2 * CELLS),
                    index / (4 * CELLS * CELLS),
                );
                let (x, y, z) = (at(i - CELLS), at(j - CELLS), at(k - CELLS));
                if inside(kind, x, y, z) {
                    volume += cell * cell * cell;
                    moments += Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y);
                }
            }
            let moments = moments * (cell * cell * cell) / volume;
            let (ours, per_mass) = solid(kind, size).unwrap();
            // Cells at the surface: their share is the edge over the size.
            assert!(
                (volume / ours - 1.0).abs() < 0.02,
                "{kind}: {volume}, not {ours}"
            );
            let deviation = (moments - per_mass).norm() / per_mass.norm();
            assert!(deviation < 0.02, "{kind}: {moments}, not {per_mass}");
        }
    }
}
