use serde::{Deserialize, Serialize};

/// Newest of the numbers that a device gives to its messages, ascending by one modulo the range of
/// `T`.
///
/// ```
/// use twinrig_wire::SequenceNumber;
///
/// let mut newest = SequenceNumber::<u8>::default();
/// assert_eq!(newest.advance(254), Some(0));
/// assert_eq!(newest.advance(254), None); // repeated
/// assert_eq!(newest.advance(1), Some(2)); // 255 and 0 are missing
/// assert_eq!(newest.advance(0), None); // late
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SequenceNumber<T>(Option<T>);

impl<T: Copy + Into<u64>> SequenceNumber<T> {
    /// Returns the number of messages missing before this one, which becomes the newest. `None` if
    /// it is repeated or late: not ahead of the newest by less than half the range.
    pub fn advance(&mut self, number: T) -> Option<u64> {
        let range_max = u64::MAX >> (u64::BITS as usize - 8 * size_of::<T>());
        let ahead = self
            .0
            .map_or(1, |newest| number.into().wrapping_sub(newest.into()));
        let ahead = ahead & range_max;
        if ahead == 0 || ahead > range_max / 2 {
            return None;
        }
        self.0 = Some(number);
        Some(ahead - 1)
    }
}
