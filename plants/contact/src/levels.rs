//! Ground of two or three levels along x, with vertical edges between them.

use nalgebra::Vector3;

use crate::surface::{Surface, level};

/// Level ground with a step, a hole or a bar along y: height zero before the first edge.
#[derive(Debug, Clone, PartialEq)]
pub struct Levels {
    /// By ascending x; one or two.
    edges: Vec<Edge>,
}

/// Edge between two levels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    /// Place \[m\].
    x: f64,
    /// Height beyond it \[m\].
    height: f64,
}

impl Levels {
    /// Returns ground that is `drop` lower from x = `at` on \[m\].
    pub fn step_down(at: f64, drop: f64) -> Self {
        let edges = vec![Edge {
            x: at,
            height: -drop,
        }];
        Self { edges }
    }

    /// Returns level ground but for a strip of another height from x = `at` on, over a length: a
    /// hole or a bar \[m\].
    pub fn strip(at: f64, length: f64, height: f64) -> Self {
        let end = Edge {
            x: at + length,
            height: 0.0,
        };
        let edges = vec![Edge { x: at, height }, end];
        Self { edges }
    }

    /// Returns the height at x \[m\]; that beyond an edge at the edge itself.
    pub fn height(&self, x: f64) -> f64 {
        self.height_of(self.level_at(x))
    }

    /// Returns the levels: x of begin and end, and height \[m\]. The outer ones are unbounded.
    pub fn levels(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        (0..=self.edges.len()).map(|index| {
            let begin = index
                .checked_sub(1)
                .map_or(f64::NEG_INFINITY, |edge| self.edges[edge].x);
            let end = self.edges.get(index).map_or(f64::INFINITY, |edge| edge.x);
            (begin, end, self.height_of(index))
        })
    }

    fn level_at(&self, x: f64) -> usize {
        let reached = self.edges.iter().take_while(|edge| x >= edge.x);
        reached.count()
    }

    fn height_of(&self, level: usize) -> f64 {
        level
            .checked_sub(1)
            .map_or(0.0, |edge| self.edges[edge].height)
    }

    /// Returns the surface nearest to a point, of the levels and of the walls between them: its
    /// distance is continuous, and the force of a compressed surface conserves energy across an
    /// edge.
    pub(crate) fn nearest(&self, point: &Vector3<f64>) -> Surface {
        let index = self.level_at(point.x);
        let own = self.height_of(index);
        let mut nearest = level(point.z - own);
        let before = index.checked_sub(1).map(|edge| (edge, index - 1, 1.0));
        let beyond = (index < self.edges.len()).then_some((index, index + 1, -1.0));
        // `outward`: sign of x from the wall into this level.
        for (edge, neighbour, outward) in [before, beyond].into_iter().flatten() {
            let (from_edge, other) = (point.x - self.edges[edge].x, self.height_of(neighbour));
            let wall = if point.z >= own {
                higher_neighbour_surface(outward * from_edge, outward, point.z, other, own)
            } else {
                lower_neighbour_surface(outward * from_edge, outward, point.z, other, own)
            };
            match wall {
                // Of equal distances the level counts.
                Some(wall) if wall.gap.abs() < nearest.gap.abs() => nearest = wall,
                _ => {}
            }
        }
        nearest
    }

    /// Returns the height of the level above or below which a point is, where that is the surface
    /// [nearest](Self::nearest) to it because no edge is nearer \[m\]; none elsewhere.
    #[inline]
    pub(crate) fn level_alone(&self, x: f64, z: f64) -> Option<f64> {
        let index = self.level_at(x);
        let own = self.height_of(index);
        let from_level = (z - own).abs();
        let is_clear = |edge: &Edge| (x - edge.x).abs() >= from_level;
        let before = index.checked_sub(1).map(|edge| &self.edges[edge]);
        let beyond = self.edges.get(index);
        (before.is_none_or(is_clear) && beyond.is_none_or(is_clear)).then_some(own)
    }
}

/// Returns the wall and the edge of a higher neighbour, for a point above its own level at the
/// distance `away` from the wall.
fn higher_neighbour_surface(
    away: f64,
    outward: f64,
    z: f64,
    other: f64,
    own: f64,
) -> Option<Surface> {
    if other <= own {
        return None;
    }
    let normal = Vector3::x() * outward;
    if z <= other {
        return Some(Surface { gap: away, normal });
    }
    let from_edge = Vector3::new(away * outward, 0.0, z - other);
    let gap = from_edge.norm();
    let normal = if gap > 0.0 {
        from_edge / gap
    } else {
        Vector3::z()
    };
    Some(Surface { gap, normal })
}

/// Returns the wall towards a lower neighbour, or the crease at its foot, for a point below its own
/// level at the distance `away` from the wall. A foot pressed into the lower level touches the
/// crease.
fn lower_neighbour_surface(
    away: f64,
    outward: f64,
    z: f64,
    other: f64,
    own: f64,
) -> Option<Surface> {
    if other >= own {
        return None;
    }
    let towards = Vector3::x() * -outward;
    if z >= other {
        return Some(Surface {
            gap: -away,
            normal: towards,
        });
    }
    let to_crease = Vector3::new(-outward * away, 0.0, other - z);
    let distance = to_crease.norm();
    Some(Surface {
        gap: -distance,
        normal: to_crease / distance,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{Ground, Terrain};

    fn ground(levels: &Levels) -> Ground {
        Ground::new(Terrain::Levels(levels.clone()), 0.6, 0.0).unwrap()
    }

    /// Distance of a point to a profile of boxes, by sampling of its outline.
    fn sampled_distance(levels: &Levels, point: &Vector3<f64>) -> f64 {
        let mut least = f64::INFINITY;
        let mut near = |x: f64, z: f64| {
            let (dx, dz) = (point.x - x, point.z - z);
            least = least.min((dx * dx + dz * dz).sqrt());
        };
        let steps = 4000;
        for (begin, end, height) in levels.levels() {
            let (begin, end) = (begin.max(-3.0), end.min(3.0));
            for i in 0..=steps {
                near(
                    begin + (end - begin) * f64::from(i) / f64::from(steps),
                    height,
                );
            }
        }
        for pair in levels.levels().collect::<Vec<_>>().windows(2) {
            let ((_, x, low), (_, _, high)) = (pair[0], pair[1]);
            for i in 0..=steps {
                near(x, low + (high - low) * f64::from(i) / f64::from(steps));
            }
        }
        least
    }

    fn shapes() -> impl Strategy<Value = Levels> {
        prop_oneof![
            (0.01..0.1_f64).prop_map(|drop| Levels::step_down(0.2, drop)),
            (0.1..0.3_f64, -0.1..0.1_f64)
                .prop_map(|(length, height)| Levels::strip(0.2, length, height)),
        ]
    }

    proptest! {
        #[test]
        fn level_alone_is_the_nearest_surface(
            x in -0.5..1.0_f64, z in -0.2..0.2_f64, height in -0.1..0.1_f64, is_strip in any::<bool>(),
        ) {
            let levels = if is_strip {
                Levels::strip(0.0, 0.3, height)
            } else {
                Levels::step_down(0.0, -height)
            };
            let nearest = levels.nearest(&Vector3::new(x, 0.0, z));
            if let Some(own) = levels.level_alone(x, z) {
                prop_assert_eq!(own, levels.height(x));
                prop_assert_eq!(nearest, level(z - own));
            } else {
                let edges = levels.edges.iter().map(|edge| (x - edge.x).abs());
                prop_assert!(edges.fold(f64::INFINITY, f64::min) < (z - levels.height(x)).abs());
            }
        }
    }

    proptest! {
        #[test]
        fn gap_is_the_distance_to_the_outline(
            levels in shapes(), x in -0.1..0.8_f64, above in -0.12..0.1_f64,
        ) {
            let point = Vector3::new(x, 0.3, levels.height(x) + above);
            let surface = levels.nearest(&point);
            let expected = sampled_distance(&levels, &point);
            prop_assert!((surface.gap.abs() - expected).abs() < 2e-3, "{surface:?} for {expected}");
            prop_assert_eq!(surface.gap < 0.0, above < 0.0);
            prop_assert!((surface.normal.norm() - 1.0).abs() < 1e-12);
        }

        /// A jump of the gap would create energy.
        #[test]
        fn gap_changes_by_no_more_than_the_way(
            levels in shapes(), x in -0.1..0.8_f64, above in -0.12..0.1_f64,
            way in prop::array::uniform2(-0.02..0.02_f64),
        ) {
            let point = Vector3::new(x, 0.0, levels.height(x) + above);
            let other = point + Vector3::new(way[0], 0.0, way[1]);
            let change = levels.nearest(&other).gap - levels.nearest(&point).gap;
            prop_assert!(change.abs() <= (other - point).norm() + 1e-12, "{change}");
        }

        /// The normal is the gradient of the gap, away from the creases where the nearest surface
        /// changes.
        #[test]
        fn normal_is_the_gradient_of_the_gap(
            levels in shapes(), x in -0.1..0.8_f64, above in -0.12..0.1_f64,
        ) {
            let point = Vector3::new(x, 0.0, levels.height(x) + above);
            let h = 1e-7;
            let gap = |dx: f64, dz: f64| levels.nearest(&(point + Vector3::new(dx, 0.0, dz))).gap;
            let slopes = [
                [gap(h, 0.0) - gap(0.0, 0.0), gap(0.0, 0.0) - gap(-h, 0.0)],
                [gap(0.0, h) - gap(0.0, 0.0), gap(0.0, 0.0) - gap(0.0, -h)],
            ];
            prop_assume!(slopes.iter().all(|[a, b]| (a - b).abs() < 1e-3 * h));
            let normal = levels.nearest(&point).normal;
            prop_assert!((slopes[0][0] / h - normal.x).abs() < 1e-3);
            prop_assert!((slopes[1][0] / h - normal.z).abs() < 1e-3);
        }
    }

    #[test]
    fn hole_and_bar_are_mirror_images_below_a_point() {
        let (hole, bar) = (
            Levels::strip(1.0, 0.2, -0.03),
            Levels::strip(1.0, 0.2, 0.03),
        );
        for (x, depth) in [(0.9, 0.0), (1.0, 0.03), (1.1, 0.03), (1.2, 0.0), (1.3, 0.0)] {
            let point = Vector3::new(x, 0.0, 0.1);
            assert_eq!(ground(&hole).below(&point).gap, 0.1 + depth);
            assert_eq!(ground(&bar).below(&point).gap, 0.1 - depth);
            assert_eq!(ground(&hole).height(x, 5.0), -ground(&bar).height(x, -5.0));
        }
    }
}
