//! Root finding for guards within a step, in fractions of the step.

/// Returns the first root with a sign change to negative of the cubic with these values and slopes
/// at 0 and 1.
pub(crate) fn first_root_of_cubic(a: f64, u: f64, b: f64, v: f64) -> Option<f64> {
    // Sampled finely enough that no dip of a cubic lies between samples.
    const INTERVALS: u32 = 8;
    let at = |s: f64| {
        let r = 1.0 - s;
        a * r * r * (1.0 + 2.0 * s) + u * s * r * r + b * s * s * (3.0 - 2.0 * s) - v * s * s * r
    };
    let mut low = 0.0;
    for interval in 1..=INTERVALS {
        let high = f64::from(interval) / f64::from(INTERVALS);
        if at(high) < 0.0 && at(low) >= 0.0 {
            return Some(bisected(at, low, high));
        }
        low = high;
    }
    None
}

/// Returns the first return to zero of the cubic that starts at zero with the positive slope `u`
/// and ends at `b` with slope `v`.
pub(crate) fn first_return_of_cubic(u: f64, b: f64, v: f64) -> Option<f64> {
    const INTERVALS: u32 = 8;
    // The cubic divided by its root at zero.
    let at = |s: f64| {
        let r = 1.0 - s;
        u * r * r + b * s * (3.0 - 2.0 * s) - v * s * r
    };
    let mut low = 0.0;
    for interval in 1..=INTERVALS {
        let high = f64::from(interval) / f64::from(INTERVALS);
        if at(high) < 0.0 {
            return Some(bisected(at, low, high));
        }
        low = high;
    }
    None
}

/// Returns the first root with a sign change to negative of the parabola through these values at 0,
/// 1/2 and 1; the last is negative.
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

/// Bisects an interval with a negative value at its right end down to round-off.
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
