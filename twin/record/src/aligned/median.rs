//! The middle of several numbers.

/// The median: the middle one in order of size, of an even count the mean of the middle two; none of none.
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
    fn of_an_even_count_it_is_between_the_middle_two() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0]), Some(2.5));
        assert_eq!(median(&[9.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[7.0, 1.0, 3.0, 100.0]), Some(5.0));
    }

    proptest! {
        #[test]
        fn as_many_are_above_as_below(values in prop::collection::vec(-1e3..1e3_f64, 1..30)) {
            let middle = median(&values).unwrap();
            let above = values.iter().filter(|value| **value > middle).count();
            let below = values.iter().filter(|value| **value < middle).count();
            prop_assert_eq!(above, below);
            let mirrored: Vec<f64> = values.iter().map(|value| -value).collect();
            // One rounding of a sum below 2000 either way.
            prop_assert!((median(&mirrored).unwrap() + middle).abs() < 1e-12);
        }
    }
}
