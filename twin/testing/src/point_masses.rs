//! Robots as point masses: generalised forces by d'Alembert's principle, kinetic energy.
//!
//! Places are computed from coordinates alone; velocities and accelerations are differences of
//! them, so that no equation of motion is used.

use nalgebra::{Rotation3, Vector3};
use twinrig_robot::{GRAVITY, LegMount, Robot};

/// Point mass \[kg\] at a place \[m\].
pub type Point = (f64, Vector3<f64>);

/// Motion of a system with `M` coordinates. `places` returns the point masses at small changes of
/// the coordinates, which are those of the state at zero.
pub struct PointMotion<F, const M: usize> {
    /// Point masses at changes of the coordinates.
    pub places: F,
    /// Rates of the coordinates.
    pub rates: [f64; M],
    /// Their accelerations.
    pub accelerations: [f64; M],
}

impl<F: Fn(&[f64; M]) -> Vec<Point>, const M: usize> PointMotion<F, M> {
    /// Returns the generalised forces beside gravity: Σ m (ẍ − g) ∂x/∂q. Accelerations are
    /// differences of fourth order over 1e-4 s, with errors of 1e-7 m/s² by round-off.
    pub fn forces(&self) -> [f64; M] {
        let h = 1e-4;
        let after = |t: f64| {
            let by = |i: usize| t * self.rates[i] + 0.5 * t * t * self.accelerations[i];
            (self.places)(&std::array::from_fn(by))
        };
        let times = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|steps| after(steps * h));
        std::array::from_fn(|i| {
            let along = |by: f64| {
                let mut change = [0.0; M];
                change[i] = by;
                (self.places)(&change)
            };
            let (less, more) = (along(-h), along(h));
            let points = (0..less.len()).map(|p| {
                let [a, b, c, d, e] = times.each_ref().map(|points| points[p].1);
                let acceleration = ((b + d) * 16.0 - a - e - c * 30.0) / (12.0 * h * h);
                let force = (acceleration + Vector3::z() * GRAVITY) * less[p].0;
                force.dot(&((more[p].1 - less[p].1) / (2.0 * h)))
            });
            points.sum()
        })
    }

    /// Returns the kinetic energy \[J\].
    pub fn kinetic(&self) -> f64 {
        let h = 1e-5;
        let after = |t: f64| (self.places)(&self.rates.map(|rate| t * rate));
        let (before, after) = (after(-h), after(h));
        let points = before.iter().zip(&after);
        points
            .map(|((mass, a), (_, b))| 0.5 * mass * ((b - a) / (2.0 * h)).norm_squared())
            .sum()
    }
}

/// Returns a trunk with its moments of inertia: three pairs of points on its axes.
pub fn trunk(robot: &Robot) -> Vec<Point> {
    let [x, y, z] = robot.trunk.inertia;
    let seconds = [y + z - x, x + z - y, x + y - z].map(|sum| 0.5 * sum);
    let mass = robot.trunk.mass / 6.0;
    let pair = |(axis, second): (usize, f64)| {
        let mut at = Vector3::zeros();
        at[axis] = libm::sqrt(second / (2.0 * mass));
        [(mass, at), (mass, -at)]
    };
    seconds.into_iter().enumerate().flat_map(pair).collect()
}

/// Returns the place in the trunk of a point of a leg, which is at `at` from the hip in the leg's
/// plane, at an angle of abduction \[rad\].
pub fn abducted(mount: &LegMount, angle: f64, at: Vector3<f64>) -> Vector3<f64> {
    let hip = Vector3::from(mount.hip);
    let Some(joint) = mount.leg.abduction else {
        return hip + at;
    };
    let inward = if hip.y > 0.0 {
        -joint.offset
    } else {
        joint.offset
    };
    let axis = hip + Vector3::new(0.0, inward, joint.height);
    axis + Rotation3::from_axis_angle(&Vector3::x_axis(), angle) * (hip + at - axis)
}

/// Returns points of the trunk in the world, at a position and an attitude changed by three
/// displacements in the world and three small rotations in trunk axes.
pub fn in_world(
    points: impl IntoIterator<Item = Point>,
    position: &Vector3<f64>,
    attitude: &Rotation3<f64>,
    by: &[f64],
) -> Vec<Point> {
    let position = position + Vector3::new(by[0], by[1], by[2]);
    let attitude = attitude * Rotation3::new(Vector3::new(by[3], by[4], by[5]));
    let place = |(mass, at)| (mass, position + attitude * at);
    points.into_iter().map(place).collect()
}
