//! Second-order kinematics of the gap between a moving point and curved ground. With the height
//! h(x, y) the gap is g = κφ and the normal n = κ∇φ. A prime is the derivative along the velocity
//! v; h depends on its horizontal part only:
//!
//! ```text
//!  φ  = z − h         κ  = 1/√(1 + p)               p  = h_x² + h_y²
//!  φ′ = v_z − h′      κ′ = −½ κ³ p′
//!  φ″ = −h″           κ″ = ¾ κ⁵ p′² − ½ κ³ p″       p′ = 2 (h_x h_x′ + h_y h_y′)
//!  g″ = κφ″ + 2κ′φ′ + κ″φ                           p″ = 2 (h_x′² + h_x h_x″ + h_y′² + h_y h_y″)
//! ```

use nalgebra::Vector3;

use crate::ground::{Ground, HeightField, Terrain, cell, clamped, spline};

/// Height and slopes below a point, and their first and second derivatives along a velocity.
struct Jet {
    height: [f64; 3],
    slope_x: [f64; 3],
    slope_y: [f64; 3],
}

impl Ground {
    /// Returns the gradient ∇g of the gap of [`Ground::below`] \[1\]: ġ = ∇g·v. It equals the
    /// normal on the surface, and everywhere on level ground; above or below curved ground it
    /// differs from the normal by the order of gap over radius of curvature.
    pub fn gap_gradient(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let Terrain::Heights(field) = &self.terrain else {
            return Vector3::z();
        };
        let along = |axis: Vector3<f64>| Slope::of(field, point, &axis).gap[1];
        Vector3::new(
            along(Vector3::x()),
            along(Vector3::y()),
            along(Vector3::z()),
        )
    }

    /// Returns the curvature term vᵀ∇²g v of the gap's acceleration \[m/s²\], so that g̈ = ∇g·a +
    /// vᵀ∇²g v. Zero on level ground; an edge contributes nothing.
    pub fn gap_curvature(&self, point: &Vector3<f64>, velocity: &Vector3<f64>) -> f64 {
        match &self.terrain {
            Terrain::Flat | Terrain::Levels(_) => 0.0,
            Terrain::Heights(field) => Slope::of(field, point, velocity).gap[2],
        }
    }

    /// Returns the rate of change ṅ of the normal below a moving point \[1/s\]: the rate n·v
    /// changes by n·a + ṅ·v. For a point that slides on the surface, n·v = 0, ṅ·v equals
    /// [`Ground::gap_curvature`].
    pub fn normal_rate(&self, point: &Vector3<f64>, velocity: &Vector3<f64>) -> Vector3<f64> {
        match &self.terrain {
            Terrain::Flat | Terrain::Levels(_) => Vector3::zeros(),
            Terrain::Heights(field) => Slope::of(field, point, velocity).normal_rate,
        }
    }
}

/// Gap with its first and second derivative along a velocity, and first derivative of the normal.
struct Slope {
    gap: [f64; 3],
    normal_rate: Vector3<f64>,
}

impl Slope {
    fn of(field: &HeightField, point: &Vector3<f64>, velocity: &Vector3<f64>) -> Self {
        let Jet {
            height: h,
            slope_x: x,
            slope_y: y,
        } = field.jet(point, velocity);
        let phi = [point.z - h[0], velocity.z - h[1], -h[2]];
        let p1 = 2.0 * (x[0] * x[1] + y[0] * y[1]);
        let p2 = 2.0 * (x[1] * x[1] + x[0] * x[2] + y[1] * y[1] + y[0] * y[2]);
        let k = 1.0 / libm::sqrt(1.0 + x[0] * x[0] + y[0] * y[0]);
        let cube = k * k * k;
        let kappa = [
            k,
            -0.5 * cube * p1,
            0.75 * cube * k * k * p1 * p1 - 0.5 * cube * p2,
        ];
        Self {
            gap: [
                kappa[0] * phi[0],
                kappa[0] * phi[1] + kappa[1] * phi[0],
                kappa[0] * phi[2] + 2.0 * kappa[1] * phi[1] + kappa[2] * phi[0],
            ],
            normal_rate: kappa[1] * Vector3::new(-x[0], -y[0], 1.0)
                + kappa[0] * Vector3::new(-x[1], -y[1], 0.0),
        }
    }
}

impl HeightField {
    /// Returns the derivatives of the splines of [`HeightField::at`] along the horizontal part of a
    /// velocity. Second derivatives of the slopes are third derivatives of the height, which are
    /// discontinuous at grid lines; they matter only for points off the surface.
    fn jet(&self, point: &Vector3<f64>, velocity: &Vector3<f64>) -> Jet {
        let (i, s) = cell((point.x - self.origin[0]) / self.spacing, self.columns);
        let (j, t) = cell((point.y - self.origin[1]) / self.spacing, self.rows);
        let (bx, by) = (derivatives(s), derivatives(t));
        // Partial derivatives, indexed by the orders in x and in y.
        let mut partial = [[0.0; 4]; 4];
        for (k, l) in (0..4).flat_map(|k| (0..4).map(move |l| (k, l))) {
            let (column, row) = (clamped(i, k, self.columns), clamped(j, l, self.rows));
            let height = self.heights[row * self.columns + column];
            for (by_x, bx) in partial.iter_mut().zip(&bx) {
                for (value, by) in by_x.iter_mut().zip(&by) {
                    *value += height * bx[k] * by[l];
                }
            }
        }
        let (u, v) = (velocity.x / self.spacing, velocity.y / self.spacing);
        // Partial derivative of order (a, b) with its first two derivatives along the velocity.
        let along = |a: usize, b: usize| {
            let p = |c: usize, d: usize| partial[a + c][b + d];
            [
                p(0, 0),
                p(1, 0) * u + p(0, 1) * v,
                p(2, 0) * u * u + 2.0 * p(1, 1) * u * v + p(0, 2) * v * v,
            ]
        };
        Jet {
            height: along(0, 0),
            slope_x: along(1, 0).map(|d| d / self.spacing),
            slope_y: along(0, 1).map(|d| d / self.spacing),
        }
    }
}

/// Returns the weights of a uniform cubic B-spline at `s` and their first three derivatives.
fn derivatives(s: f64) -> [[f64; 4]; 4] {
    let [value, first] = spline(s);
    [
        value,
        first,
        [1.0 - s, 3.0 * s - 2.0, 1.0 - 3.0 * s, s],
        [-1.0, 3.0, -3.0, 1.0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hills(heights: &[f64]) -> Ground {
        let field = HeightField::new([-0.2, -0.3], 0.05, 10, heights.to_vec()).unwrap();
        Ground::new(Terrain::Heights(field), 0.6, 0.0).unwrap()
    }

    fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = Vector3<f64>> {
        proptest::array::uniform3(range).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn derivatives_match_finite_differences(
            heights in proptest::collection::vec(-0.03..0.03_f64, 100),
            point in vector(-0.35..0.35),
            velocity in vector(-1.0..1.0),
        ) {
            // Includes points beyond the border, but excludes motions across a grid line, where
            // third derivatives of the height are discontinuous.
            const H: f64 = 1e-6;
            let ground = hills(&heights);
            let at = |t: f64| point + t * velocity;
            let cells = |t: f64| {
                let position = (at(t) - Vector3::new(-0.2, -0.3, 0.0)) / 0.05;
                (position.x.floor(), position.y.floor())
            };
            prop_assume!(cells(-H) == cells(H));
            let near = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + b.abs());

            let gap = |t: f64| ground.below(&at(t)).gap;
            let rate = |t: f64| ground.gap_gradient(&at(t)).dot(&velocity);
            prop_assert!(near((gap(H) - gap(-H)) / (2.0 * H), rate(0.0)));
            let curvature = ground.gap_curvature(&point, &velocity);
            let difference = (rate(H) - rate(-H)) / (2.0 * H);
            prop_assert!(near(difference, curvature), "{} {}", difference, curvature);
            let normal = |t: f64| ground.below(&at(t)).normal;
            let turning = ground.normal_rate(&point, &velocity);
            let difference = (normal(H) - normal(-H)) / (2.0 * H);
            prop_assert!((difference - turning).norm() < 1e-5 * (1.0 + turning.norm()));
        }

        #[test]
        fn gradient_equals_normal_on_surface(
            heights in proptest::collection::vec(-0.03..0.03_f64, 100),
            point in vector(-0.35..0.35),
            velocity in vector(-1.0..1.0),
        ) {
            let ground = hills(&heights);
            let surface = ground.below(&point);
            // The normal is that of the ground vertically below the point.
            let point = point - Vector3::z() * surface.gap / surface.normal.z;
            let normal = surface.normal;
            prop_assert!((ground.gap_gradient(&point) - normal).norm() < 1e-12);
            let sliding = velocity - normal * normal.dot(&velocity);
            let curvature = ground.gap_curvature(&point, &sliding);
            let turning = ground.normal_rate(&point, &sliding).dot(&sliding);
            prop_assert!((curvature - turning).abs() < 1e-12 * (1.0 + curvature.abs()));
        }
    }

    #[test]
    fn level_ground_has_no_curvature_terms() {
        let step = Terrain::step_down(0.0, 0.02);
        for terrain in [Terrain::Flat, step] {
            let ground = Ground::new(terrain, 0.6, 0.0).unwrap();
            let (point, velocity) = (Vector3::new(0.0, 1.0, 0.1), Vector3::new(3.0, 2.0, 1.0));
            assert_eq!(ground.gap_gradient(&point), Vector3::z());
            assert_eq!(ground.gap_curvature(&point, &velocity), 0.0);
            assert_eq!(ground.normal_rate(&point, &velocity), Vector3::zeros());
        }
    }

    #[test]
    fn curvature_at_trough_bottom_is_v_squared_over_radius() {
        // h = ½ x²/R at the bottom; a cubic spline reproduces the curvature of a parabola exactly.
        let radius = 2.0;
        let heights = (0..100).map(|i| {
            let x = -0.2 + 0.05 * f64::from(i % 10);
            0.5 * x * x / radius
        });
        let ground = hills(&heights.collect::<Vec<_>>());
        let surface = ground.below(&Vector3::zeros());
        let bottom = Vector3::new(0.0, 0.0, -surface.gap);
        let curvature = ground.gap_curvature(&bottom, &Vector3::new(3.0, 0.0, 0.0));
        assert!((curvature + 9.0 / radius).abs() < 1e-12, "{curvature}");
    }
}
