//! Periodic cubic spline through values at even distances.

use std::f64::consts::TAU;

/// Returns the slopes of the spline at its points: the solution of
/// s₋ + 4 s + s₊ = 3 (y₊ − y₋)/h, in which the first point follows the last.
pub(crate) fn slopes(values: &[f64], spacing: f64) -> Vec<f64> {
    let count = values.len();
    let at = |n: usize| values[n % count];
    let right = (0..count).map(|n| 3.0 * (at(n + 1) - at(n + count - 1)) / spacing);
    let right: Vec<f64> = right.collect();
    // The corners of the matrix are a rank-one correction of a tridiagonal one (Sherman–Morrison).
    let corner = |n: usize| if n == 0 || n == count - 1 { 1.0 } else { 0.0 };
    let plain = tridiagonal(&right);
    let of_corner = tridiagonal(&(0..count).map(corner).collect::<Vec<_>>());
    let ends = |x: &[f64]| x[0] + x[count - 1];
    let factor = ends(&plain) / (1.0 + ends(&of_corner));
    let corrected = plain.iter().zip(&of_corner);
    corrected.map(|(x, z)| x - factor * z).collect()
}

/// Solves the system with 4 on the diagonal, 3 at its ends, and 1 beside it.
fn tridiagonal(right: &[f64]) -> Vec<f64> {
    let count = right.len();
    let diagonal = |n: usize| if n == 0 || n == count - 1 { 3.0 } else { 4.0 };
    let mut upper = vec![0.0; count];
    let mut solution = vec![0.0; count];
    for n in 0..count {
        let (before, ratio) = match n {
            0 => (0.0, 0.0),
            n => (solution[n - 1], upper[n - 1]),
        };
        let pivot = diagonal(n) - ratio;
        upper[n] = 1.0 / pivot;
        solution[n] = (right[n] - before) / pivot;
    }
    for n in (0..count - 1).rev() {
        solution[n] -= upper[n] * solution[n + 1];
    }
    solution
}

/// Value, first and second derivative at an angle in 0 … 2π, of a spline over one turn.
pub(crate) fn at(values: &[f64], slopes: &[f64], angle: f64) -> [f64; 3] {
    let count = values.len();
    let spacing = TAU / count as f64;
    let place = angle / spacing;
    let floor = place.floor();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an angle within one turn"
    )]
    let n = floor as usize % count;
    let next = (n + 1) % count;
    let t = place - floor;
    let rise = (values[next] - values[n]) / spacing;
    let (from, to) = (slopes[n], slopes[next]);
    // Hermite form: y + h t (from + t (c + t d)).
    let (c, d) = (3.0 * rise - 2.0 * from - to, from + to - 2.0 * rise);
    [
        values[n] + spacing * t * (from + t * (c + t * d)),
        from + t * (2.0 * c + t * 3.0 * d),
        (2.0 * c + 6.0 * t * d) / spacing,
    ]
}
