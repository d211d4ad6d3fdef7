//! Terrain shape and contact parameters.

use nalgebra::Vector3;
use twinrig_kernel::SimTime;

use crate::levels::Levels;
use crate::patch::Patch;
use crate::surface::{Surface, level};

/// Terrain, friction and restitution.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Shape.
    pub terrain: Terrain,
    /// Coulomb coefficient outside of patches \[1\].
    pub friction: f64,
    /// Newton's coefficient of restitution: ratio of separation to approach speed \[1\].
    pub restitution: f64,
    pub(crate) patches: Vec<Patch>,
}

/// Height of the ground over the horizontal plane \[m\].
#[derive(Debug, Clone, PartialEq)]
pub enum Terrain {
    /// Height zero everywhere.
    Flat,
    /// Levels with vertical edges: a step down, a hole or a bar.
    Levels(Levels),
    /// Heights on a square grid, interpolated smoothly and extended beyond its border.
    Heights(HeightField),
}

/// Heights on a square grid.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    pub(crate) origin: [f64; 2],
    pub(crate) spacing: f64,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) heights: Vec<f64>,
}

/// Invalid terrain parameter.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GroundError {
    /// The grid is too small to interpolate, or its size does not match the number of heights.
    #[error(
        "a height field of {columns} × {rows} needs as many heights (not {heights}) and at least 2 × 2"
    )]
    Grid {
        /// Points along x.
        columns: usize,
        /// Points along y.
        rows: usize,
        /// Heights given.
        heights: usize,
    },
    /// A parameter is negative, zero or not finite where this is not allowed.
    #[error("the ground's {what} cannot be {value}")]
    Value {
        /// Name of the parameter.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl Terrain {
    /// Returns ground of height zero, `drop` lower from x = `at` on \[m\].
    pub fn step_down(at: f64, drop: f64) -> Self {
        Self::Levels(Levels::step_down(at, drop))
    }
}

impl Ground {
    /// Creates a ground from validated parameters.
    ///
    /// # Errors
    /// [`GroundError::Value`] for a negative friction or a restitution outside [0, 1].
    pub fn new(terrain: Terrain, friction: f64, restitution: f64) -> Result<Self, GroundError> {
        if !(friction.is_finite() && friction >= 0.0) {
            return Err(GroundError::Value {
                what: "friction",
                value: friction,
            });
        }
        if !(0.0..=1.0).contains(&restitution) {
            return Err(GroundError::Value {
                what: "restitution",
                value: restitution,
            });
        }
        Ok(Self {
            terrain,
            friction,
            restitution,
            patches: Vec::new(),
        })
    }

    /// Returns the height at a position \[m\].
    pub fn height(&self, x: f64, y: f64) -> f64 {
        match &self.terrain {
            Terrain::Flat => 0.0,
            Terrain::Levels(levels) => levels.height(x),
            Terrain::Heights(field) => field.at(x, y)[0],
        }
    }

    /// Returns the ground nearest to a point, and the gradient of its gap, along which a compressed
    /// ground pushes: the gap is continuous, at an edge, too.
    pub fn nearest(&self, point: &Vector3<f64>) -> (Surface, Vector3<f64>) {
        match &self.terrain {
            Terrain::Flat => (level(point.z), Vector3::z()),
            Terrain::Levels(levels) => {
                let surface = levels.nearest(point);
                (surface, surface.normal)
            }
            Terrain::Heights(_) => (self.below(point), self.gap_gradient(point)),
        }
    }

    /// Returns a height that no place of the ground exceeds \[m\].
    pub fn greatest_height(&self) -> f64 {
        match &self.terrain {
            Terrain::Flat => 0.0,
            Terrain::Levels(levels) => {
                let heights = levels.levels().map(|(_, _, height)| height);
                heights.fold(f64::NEG_INFINITY, f64::max)
            }
            // Splines are within their control points.
            Terrain::Heights(field) => {
                let heights = field.heights.iter().copied();
                heights.fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }

    /// Returns the height of the level above or below which a point is, where that is certainly the
    /// ground [nearest](Self::nearest) to it \[m\]; none elsewhere, and on ground without levels.
    #[inline]
    pub fn level_alone(&self, x: f64, z: f64) -> Option<f64> {
        match &self.terrain {
            Terrain::Flat => Some(0.0),
            Terrain::Levels(levels) => levels.level_alone(x, z),
            Terrain::Heights(_) => None,
        }
    }

    /// The ground below a point.
    pub fn below(&self, point: &Vector3<f64>) -> Surface {
        match &self.terrain {
            Terrain::Flat => level(point.z),
            Terrain::Levels(levels) => level(point.z - levels.height(point.x)),
            Terrain::Heights(field) => {
                let [height, by_x, by_y] = field.at(point.x, point.y);
                let normal = Vector3::new(-by_x, -by_y, 1.0);
                let steepness = normal.norm();
                Surface {
                    gap: (point.z - height) / steepness,
                    normal: normal / steepness,
                }
            }
        }
    }
}

impl Ground {
    /// Returns the ground with patches, of which the last that applies at a place and a time has
    /// effect; outside of all of them the coefficient is that of the ground.
    ///
    /// # Errors
    /// [`GroundError::Value`] for a negative friction, an empty extent or an empty time.
    pub fn with_patches(mut self, patches: Vec<Patch>) -> Result<Self, GroundError> {
        for patch in &patches {
            let error = |what, value| Err(GroundError::Value { what, value });
            if !(patch.friction.is_finite() && patch.friction >= 0.0) {
                return error("friction of a patch", patch.friction);
            }
            let length = patch.extent.end - patch.extent.start;
            if length.is_nan() || length <= 0.0 {
                return error("length of a patch", length);
            }
            if patch.end.is_some_and(|end| end <= patch.begin) {
                return error("duration of a patch", 0.0);
            }
        }
        self.patches = patches;
        Ok(self)
    }

    /// Returns whether the friction differs between places or times.
    pub fn has_patches(&self) -> bool {
        !self.patches.is_empty()
    }

    /// Returns the coefficient of friction at a place at a time.
    pub fn friction_at(&self, x: f64, now: SimTime) -> f64 {
        let mut patches = self.patches.iter().rev();
        let patch = patches.find(|patch| patch.applies(x, now));
        patch.map_or(self.friction, |patch| patch.friction)
    }

    /// Returns the first instant after `now` at which the friction changes with time.
    pub fn next_change(&self, now: SimTime) -> Option<SimTime> {
        let ends = self.patches.iter().filter_map(|patch| patch.end);
        let begins = self.patches.iter().map(|patch| patch.begin);
        begins.chain(ends).filter(|at| *at > now).min()
    }
}

impl HeightField {
    /// Creates a height field, x varying fastest, whose first point lies at `origin`.
    ///
    /// # Errors
    /// [`GroundError`] for a grid that cannot be interpolated or a height that is not finite.
    pub fn new(
        origin: [f64; 2],
        spacing: f64,
        columns: usize,
        heights: Vec<f64>,
    ) -> Result<Self, GroundError> {
        let rows = heights.len().checked_div(columns).unwrap_or(0);
        if columns < 2 || rows < 2 || columns * rows != heights.len() {
            return Err(GroundError::Grid {
                columns,
                rows,
                heights: heights.len(),
            });
        }
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(GroundError::Value {
                what: "spacing",
                value: spacing,
            });
        }
        if let Some(&value) = heights.iter().find(|h| !h.is_finite()) {
            return Err(GroundError::Value {
                what: "height",
                value,
            });
        }
        Ok(Self {
            origin,
            spacing,
            columns,
            rows,
            heights,
        })
    }

    /// Returns the origin of the grid, its spacing \[m\], and the numbers of points along x and y.
    pub fn grid(&self) -> ([f64; 2], f64, [usize; 2]) {
        (self.origin, self.spacing, [self.columns, self.rows])
    }

    /// Returns the height and its slopes along x and y, by uniform cubic B-splines: twice
    /// continuously differentiable, so that forces on a foot sliding across a grid line are
    /// continuous.
    fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let (i, s) = cell((x - self.origin[0]) / self.spacing, self.columns);
        let (j, t) = cell((y - self.origin[1]) / self.spacing, self.rows);
        let ([bx, dx], [by, dy]) = (spline(s), spline(t));
        let mut sum = [0.0; 3];
        for k in 0..4 {
            for l in 0..4 {
                let (column, row) = (clamped(i, k, self.columns), clamped(j, l, self.rows));
                let height = self.heights[row * self.columns + column];
                sum[0] += height * bx[k] * by[l];
                sum[1] += height * dx[k] * by[l];
                sum[2] += height * bx[k] * dy[l];
            }
        }
        [sum[0], sum[1] / self.spacing, sum[2] / self.spacing]
    }
}

/// Returns the grid cell and the position within it; the border cell extends to infinity.
#[expect(
    clippy::cast_possible_truncation,
    reason = "clamped to the grid before"
)]
pub(crate) fn cell(position: f64, points: usize) -> (i64, f64) {
    let bounded = position.clamp(-1.0, points as f64);
    let floor = libm::floor(bounded);
    (floor as i64, bounded - floor)
}

/// Returns the index of the k-th of the four support points of a cell's spline.
pub(crate) fn clamped(cell: i64, k: usize, points: usize) -> usize {
    let index = cell + [-1, 0, 1, 2][k];
    usize::try_from(index).unwrap_or(0).min(points - 1)
}

/// Returns the weights of a uniform cubic B-spline at `s` and their first derivatives.
pub(crate) fn spline(s: f64) -> [[f64; 4]; 2] {
    let r = 1.0 - s;
    [
        [
            r * r * r / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            (-3.0 * s * s * s + 3.0 * s * s + 3.0 * s + 1.0) / 6.0,
            s * s * s / 6.0,
        ],
        [
            -0.5 * r * r,
            (3.0 * s * s - 4.0 * s) / 2.0,
            (-3.0 * s * s + 2.0 * s + 1.0) / 2.0,
            0.5 * s * s,
        ],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hills() -> Ground {
        let heights = (0..100)
            .map(|i| 0.01 * libm::sin(0.7 * f64::from(i)))
            .collect();
        let field = HeightField::new([-0.2, -0.3], 0.05, 10, heights).unwrap();
        Ground::new(Terrain::Heights(field), 0.6, 0.0).unwrap()
    }

    #[test]
    fn gap_along_normal_matches_vertical_height() {
        let field = HeightField::new(
            [-0.2, -0.2],
            0.1,
            5,
            (0..25).map(|n| f64::from(n * n % 7) * 0.01).collect(),
        );
        let terrains = [
            Terrain::Flat,
            Terrain::step_down(0.1, 0.3),
            Terrain::Heights(field.unwrap()),
        ];
        for terrain in terrains {
            let ground = Ground::new(terrain, 0.5, 0.0).unwrap();
            for (x, y) in [(0.0, 0.0), (0.13, -0.07), (-0.31, 0.22), (0.1, 0.0)] {
                let surface = ground.below(&Vector3::new(x, y, 0.7));
                let above = surface.gap / surface.normal.z;
                assert!(
                    (above - (0.7 - ground.height(x, y))).abs() < 1e-12,
                    "{ground:?}"
                );
            }
        }
    }

    proptest! {
        #[test]
        fn normal_matches_slope_of_height(x in -0.4..0.5_f64, y in -0.4..0.5_f64) {
            let (ground, h) = (hills(), 1e-6);
            let height = |x: f64, y: f64| {
                let below = ground.below(&Vector3::new(x, y, 0.0));
                -below.gap / below.normal.z
            };
            let surface = ground.below(&Vector3::new(x, y, 0.0));
            let slope = (height(x + h, y) - height(x - h, y)) / (2.0 * h);
            prop_assert!((slope + surface.normal.x / surface.normal.z).abs() < 1e-6);
            let [a, b] = surface.tangents();
            prop_assert!(a.dot(&surface.normal).abs() < 1e-15 && a.dot(&b).abs() < 1e-15);
            prop_assert!((a.cross(&b) - surface.normal).norm() < 1e-15);
        }
    }

    #[test]
    fn step_down_is_level_on_both_sides() {
        let ground = Ground::new(Terrain::step_down(1.0, 0.02), 0.6, 0.0).unwrap();
        assert_eq!(ground.below(&Vector3::new(0.5, 0.0, 0.1)).gap, 0.1);
        assert_eq!(ground.below(&Vector3::new(1.5, 0.0, 0.1)).gap, 0.1 + 0.02);
    }

    #[test]
    fn invalid_grounds_are_rejected() {
        assert!(Ground::new(Terrain::Flat, -0.1, 0.0).is_err());
        assert!(Ground::new(Terrain::Flat, 0.1, 1.5).is_err());
        assert!(HeightField::new([0.0; 2], 0.1, 3, vec![0.0; 8]).is_err());
        assert!(HeightField::new([0.0; 2], 0.0, 2, vec![0.0; 4]).is_err());
        assert!(HeightField::new([0.0; 2], 0.1, 2, vec![f64::NAN; 4]).is_err());
    }
}
