//! Error norm that `rk4` and `rodas4` compare with the tolerance.

use crate::model::Model;
use crate::model::real::Lanes;
use crate::model::state::Slope;

/// Returns an upper bound on the displacement of a foot or the trunk by an error of the state
/// \[m\]: directly by positions and, with `velocities`, by velocities over the time constant of
/// a pendulum of leg length.
pub(crate) fn error_norm<const N: usize>(
    model: &Model<N>,
    error: &Slope<Lanes, N>,
    velocities: bool,
) -> Lanes {
    let attitude = 2.0 * norm(&error.attitude);
    let at_once = displacement(model, error.position, attitude, &error.angles, error.pulley);
    if !velocities {
        return at_once;
    }
    let turning = norm(&error.turning);
    let speed = displacement(
        model,
        error.velocity,
        turning,
        &error.rates,
        error.pulley_rate,
    );
    at_once.max(speed * Lanes::splat(model.pendulum))
}

fn displacement<const N: usize>(
    model: &Model<N>,
    position: [f64; 3],
    rotation: f64,
    angles: &[Lanes; N],
    pulley: Lanes,
) -> Lanes {
    let infinity = Lanes::splat(f64::INFINITY);
    let reach = Lanes::splat(model.reach);
    let mut most = pulley.abs() * model.side_by_side.pulley_radius;
    for angle in angles {
        // A sum propagates NaN; a maximum may not.
        most += angle.abs() * reach;
    }
    if !model.is_free() {
        return most.simd_lt(infinity).bitselect(most, infinity);
    }
    let legs = &most.to_array()[..model.legs.len()];
    let all =
        legs.iter().fold(0.0, |sum, leg| sum + leg) + norm(&position) + rotation * model.reach;
    Lanes::splat(if all.is_finite() { all } else { f64::INFINITY })
}

fn norm(vector: &[f64]) -> f64 {
    libm::sqrt(vector.iter().map(|x| x * x).sum::<f64>())
}
