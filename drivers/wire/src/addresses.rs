use std::ops::RangeInclusive;

/// Addresses of packets to which a node listens: up to three ranges.
///
/// ```
/// use twinrig_wire::Addresses;
///
/// let own_and_all = Addresses::new([7..=7, 0xFE..=0xFE]);
/// assert!(own_and_all.contains(7) && !own_and_all.contains(8));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Addresses([(u16, u16); Self::RANGES]);

impl Addresses {
    const RANGES: usize = 3;

    /// Creates a set of up to three ranges.
    pub fn new<const N: usize>(ranges: [RangeInclusive<u16>; N]) -> Self {
        const { assert!(N <= Self::RANGES) };
        let mut all = [(1, 0); Self::RANGES];
        for (place, range) in all.iter_mut().zip(ranges) {
            *place = range.into_inner();
        }
        Self(all)
    }

    /// Returns whether an address is one of them.
    pub fn contains(self, address: u16) -> bool {
        self.0
            .iter()
            .any(|(first, last)| (*first..=*last).contains(&address))
    }
}
