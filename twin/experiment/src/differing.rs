//! Margins that differ visibly between runs.

/// Least difference of margins that a plot that contains 0 shows, as a share of the greatest one.
const VISIBLE: f64 = 0.01;

/// Returns whether margins from `low` to `high` differ in a plot that contains 0.
pub(crate) fn is_visible([low, high]: [f64; 2]) -> bool {
    high - low > VISIBLE * low.abs().max(high.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_differ_relative_to_the_greatest() {
        assert!(is_visible([0.9, 1.0]) && is_visible([-1e-9, 1e-9]));
        assert!(!is_visible([0.995, 1.0]) && !is_visible([2.0, 2.0]) && !is_visible([0.0, 0.0]));
    }
}
