//! Where a guard breaks within a step, as a share of the step.

/// The first root, from above, of the cubic with these values and slopes at 0 and 1, if it has one.
pub(crate) fn first_root_of_cubic(a: f64, u: f64, b: f64, v: f64) -> Option<f64> {
    // The value is looked at often enough that no dip of a cubic hides in between.
    const PIECES: u32 = 8;
    let at = |s: f64| {
        let r = 1.0 - s;
        a * r * r * (1.0 + 2.0 * s) + u * s * r * r + b * s * s * (3.0 - 2.0 * s) - v * s * s * r
    };
    let mut low = 0.0;
    for piece in 1..=PIECES {
        let high = f64::from(piece) / f64::from(PIECES);
        if at(high) < 0.0 && at(low) >= 0.0 {
            return Some(bisected(at, low, high));
        }
        low = high;
    }
    None
}

/// Where the cubic that starts at zero with the positive slope `u`, and ends at `b` with slope `v`, first comes back to zero,
/// if it does.
pub(crate) fn first_return_of_cubic(u: f64, b: f64, v: f64) -> Option<f64> {
    const PIECES: u32 = 8;
    // What is left of the cubic when its root at zero is divided out.
    let at = |s: f64| {
        let r = 1.0 - s;
        u * r * r + b * s * (3.0 - 2.0 * s) - v * s * r
    };
    let mut low = 0.0;
    for piece in 1..=PIECES {
        let high = f64::from(piece) / f64::from(PIECES);
        if at(high) < 0.0 {
            return Some(bisected(at, low, high));
        }
        low = high;
    }
    None
}

/// The first root, from above, of the parabola through these values at 0, 1/2 and 1; the last is negative.
pub(crate) fn first_root_of_quadratic(a: f64, m: f64, b: f64) -> f64 {
    if a <= 0.0 {
        return 0.0;
    }
    let at = |s: f64| {
        a * (1.0 - s) * (1.0 - 2.0 * s) + m * 4.0 * s * (1.0 - s) + b * s * (2.0 * s - 1.0)
    };
    let high = if m < 0.0 { 0.5 } else { 1.0 };
    bisected(at, 0.0, high)
}

/// Halves an interval whose right end is negative until nothing is left of it.
fn bisected(at: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at(middle) < 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
