//! Median of a sample.

/// Returns the median (of an even count the mean of the two middle values); `None` of an empty
/// slice.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    if sorted.len() % 2 == 1 {
        return Some(upper);
    }
    let lower = sorted[sorted.len() / 2 - 1];
    Some(lower + 0.5 * (upper - lower))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn median_of_an_even_count_is_the_mean_of_the_middle_two() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0]), Some(2.5));
        assert_eq!(median(&[9.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[7.0, 1.0, 3.0, 100.0]), Some(5.0));
    }

    proptest! {
        #[test]
        fn equal_numbers_are_above_and_below(values in prop::collection::vec(-1e3..1e3_f64, 1..30)) {
            let median_value = median(&values).unwrap();
            let above = values.iter().filter(|value| **value > median_value).count();
            let below = values.iter().filter(|value| **value < median_value).count();
            prop_assert_eq!(above, below);
            let mirrored: Vec<f64> = values.iter().map(|value| -value).collect();
            // Tolerance: one rounding of a sum below 2000 for either median.
            prop_assert!((median(&mirrored).unwrap() + median_value).abs() < 1e-12);
        }
    }
}
