use std::ops::RangeInclusive;

/// Addresses of packets to which a node listens: a range, and up to two others.
///
/// ```
/// use twinrig_wire::Addresses;
///
/// let own_and_all = Addresses::one(7).and(0xFE);
/// assert!(own_and_all.contains(7) && own_and_all.contains(0xFE) && !own_and_all.contains(8));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Addresses {
    /// First and last of the range, and the others.
    places: [u16; 4],
}

impl Addresses {
    /// Creates a set of one address.
    #[inline]
    pub fn one(address: u16) -> Self {
        Self {
            places: [address; 4],
        }
    }

    /// Creates a set of a range that is not empty.
    pub fn range(range: RangeInclusive<u16>) -> Self {
        let (first, last) = range.into_inner();
        Self {
            places: [first, last, first, first],
        }
    }

    /// Adds an address; of three, the first is lost.
    #[must_use]
    pub fn and(self, address: u16) -> Self {
        let [first, last, _, other] = self.places;
        Self {
            places: [first, last, other, address],
        }
    }

    /// Whether it is a set of one address.
    #[inline]
    pub(crate) fn is_one(self) -> bool {
        self == Self::one(self.places[0])
    }

    /// Returns whether an address is one of them.
    #[inline]
    pub fn contains(self, address: u16) -> bool {
        let [first, last, one, other] = self.places;
        (first..=last).contains(&address) || one == address || other == address
    }
}
