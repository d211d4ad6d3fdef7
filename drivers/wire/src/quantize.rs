use std::ops::RangeInclusive;

/// Returns the integer nearest to `exact` in `range`, as an analog-to-digital converter with this
/// range of counts does, and whether it was saturated. NaN becomes 0, marked as saturated. A
/// converter that rounds down gets the `floor` of the exact count.
///
/// ```
/// use twinrig_wire::quantize;
///
/// assert_eq!(quantize(12.6, 0..=1023_u16), (13, false));
/// assert_eq!(quantize(-7000.0, -6000..=6000_i16), (-6000, true));
/// assert_eq!(quantize(f64::NAN, -6000..=6000_i16), (0, true));
/// ```
pub fn quantize<T>(exact: f64, range: RangeInclusive<T>) -> (T, bool)
where
    T: Copy + Default + Into<f64> + TryFrom<i64>,
{
    let nearest = exact.round();
    let count = nearest.clamp((*range.start()).into(), (*range.end()).into());
    #[expect(
        clippy::cast_possible_truncation,
        reason = "in the range of a T; NaN becomes 0"
    )]
    let integer = count as i64;
    #[expect(clippy::float_cmp, reason = "clamping changes a number or leaves it")]
    let saturated = count != nearest;
    (T::try_from(integer).unwrap_or_default(), saturated)
}
