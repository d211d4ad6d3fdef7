//! Terrain and what it is made of.

use nalgebra::Vector3;

/// Terrain, friction and restitution.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Shape.
    pub terrain: Terrain,
    /// Coulomb coefficient \[1\].
    pub friction: f64,
    /// Newton's coefficient of restitution: share of the approach speed that an impact gives back \[1\].
    pub restitution: f64,
}

/// Height of the ground over the horizontal plane \[m\].
#[derive(Debug, Clone, PartialEq)]
pub enum Terrain {
    /// Height zero everywhere.
    Flat,
    /// Height zero up to `at`, then lower by `drop`. The edge is vertical.
    StepDown {
        /// x of the edge \[m\].
        at: f64,
        /// How much lower the ground is behind it \[m\].
        drop: f64,
    },
    /// Heights on a square grid, continued by its border; smooth in between.
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

/// The ground below a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Distance of the point above the ground, measured along the normal \[m\].
    pub gap: f64,
    /// Upward unit normal.
    pub normal: Vector3<f64>,
}

/// Why a terrain does not exist.
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
    /// A number that has to be positive, or non-negative, or finite, is not.
    #[error("the ground's {what} cannot be {value}")]
    Value {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl Ground {
    /// A ground, checked.
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
        })
    }

    /// Its height at a place \[m\].
    pub fn height(&self, x: f64, y: f64) -> f64 {
        match &self.terrain {
            Terrain::Flat => 0.0,
            Terrain::StepDown { at, drop } => {
                if x < *at {
                    0.0
                } else {
                    -drop
                }
            }
            Terrain::Heights(field) => field.at(x, y)[0],
        }
    }

    /// The ground below a point.
    pub fn below(&self, point: &Vector3<f64>) -> Surface {
        match &self.terrain {
            Terrain::Flat => level(point.z),
            Terrain::StepDown { at, drop } => level(if point.x < *at {
                point.z
            } else {
                point.z + drop
            }),
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

impl Surface {
    /// Two unit vectors in the surface, the first in the vertical plane of x.
    pub fn tangents(&self) -> [Vector3<f64>; 2] {
        let forward = Vector3::new(self.normal.z, 0.0, -self.normal.x).normalize();
        [forward, self.normal.cross(&forward)]
    }
}

fn level(gap: f64) -> Surface {
    Surface {
        gap,
        normal: Vector3::z(),
    }
}

impl HeightField {
    /// A grid of heights, x running fastest, whose first point lies at `origin`.
    ///
    /// # Errors
    /// [`GroundError`] for a grid that cannot be interpolated or a height that is not a number.
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

    /// Where the first point of the grid lies, how far points are apart, and how many there are along x and y \[m\].
    pub fn grid(&self) -> ([f64; 2], f64, [usize; 2]) {
        (self.origin, self.spacing, [self.columns, self.rows])
    }

    /// Height and its slopes along x and y, by uniform cubic B-splines: twice continuously differentiable, so that a foot
    /// that slides over a grid line feels no jolt.
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

/// Grid cell and place within it; the border cell goes on for ever.
#[expect(
    clippy::cast_possible_truncation,
    reason = "clamped to the grid before"
)]
pub(crate) fn cell(place: f64, points: usize) -> (i64, f64) {
    let bounded = place.clamp(-1.0, points as f64);
    let floor = libm::floor(bounded);
    (floor as i64, bounded - floor)
}

/// Index of the k-th of the four points that a cell's spline uses.
pub(crate) fn clamped(cell: i64, k: usize, points: usize) -> usize {
    let index = cell + [-1, 0, 1, 2][k];
    usize::try_from(index).unwrap_or(0).min(points - 1)
}

/// Weights of a uniform cubic B-spline at `s`, and of its derivative.
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
    fn the_gap_along_the_normal_is_that_above_the_height() {
        let field = HeightField::new(
            [-0.2, -0.2],
            0.1,
            5,
            (0..25).map(|n| f64::from(n * n % 7) * 0.01).collect(),
        );
        let terrains = [
            Terrain::Flat,
            Terrain::StepDown { at: 0.1, drop: 0.3 },
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
        fn the_normal_is_the_slope_of_the_height(x in -0.4..0.5_f64, y in -0.4..0.5_f64) {
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
    fn a_step_down_is_level_on_both_sides() {
        let ground = Ground::new(
            Terrain::StepDown {
                at: 1.0,
                drop: 0.02,
            },
            0.6,
            0.0,
        )
        .unwrap();
        assert_eq!(ground.below(&Vector3::new(0.5, 0.0, 0.1)).gap, 0.1);
        assert_eq!(ground.below(&Vector3::new(1.5, 0.0, 0.1)).gap, 0.1 + 0.02);
    }

    #[test]
    fn impossible_grounds_are_refused() {
        assert!(Ground::new(Terrain::Flat, -0.1, 0.0).is_err());
        assert!(Ground::new(Terrain::Flat, 0.1, 1.5).is_err());
        assert!(HeightField::new([0.0; 2], 0.1, 3, vec![0.0; 8]).is_err());
        assert!(HeightField::new([0.0; 2], 0.0, 2, vec![0.0; 4]).is_err());
        assert!(HeightField::new([0.0; 2], 0.1, 2, vec![f64::NAN; 4]).is_err());
    }
}
