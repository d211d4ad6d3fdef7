//! Fingerprint of a run: one hash over its samples, wire traffic and events, in order.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::hash_tree::{BLOCK, HashTree};

/// Fingerprint under construction. It can be serialised, as a part of the state of a run.
///
/// Each item (a sample, a piece of wire traffic, an event) is hashed as a header followed by its
/// bytes. The header contains the time, the kind of item, its number within the kind, and the
/// length, so that different sequences of items yield different bytes. Numbers enter with their
/// exact bits: `0.0` and `-0.0` differ, and so do NaNs with different payloads.
///
/// ```
/// use twinrig_record::Fingerprint;
///
/// let mut a = Fingerprint::new();
/// a.sample(2_000_000, 0, &[0.5, 0.25]);
/// let mut b = Fingerprint::new();
/// b.sample(2_000_000, 0, &[0.5, 0.25_f64.next_up()]);
/// assert_ne!(a.digest(), b.digest());
/// ```
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(into = "SavedFingerprint", try_from = "SavedFingerprint")]
pub struct Fingerprint {
    hashed: HashTree,
    /// Input buffer of two blocks: hashing many kilobytes at once is faster than a few hundred
    /// bytes.
    buffer: Box<[u8]>,
    filled: usize,
}

/// Serialised fingerprint: the hashed blocks, and the bytes behind them.
#[derive(Serialize, Deserialize)]
struct SavedFingerprint {
    hashed: HashTree,
    rest: Vec<u8>,
}

impl From<Fingerprint> for SavedFingerprint {
    fn from(saved: Fingerprint) -> Self {
        Self {
            rest: saved.buffer[..saved.filled].to_vec(),
            hashed: saved.hashed,
        }
    }
}

impl TryFrom<SavedFingerprint> for Fingerprint {
    type Error = &'static str;

    fn try_from(SavedFingerprint { hashed, rest }: SavedFingerprint) -> Result<Self, Self::Error> {
        let is_valid = hashed.is_valid() && (hashed.is_empty() || !rest.is_empty());
        let mut fingerprint = Self::new();
        match fingerprint.buffer.get_mut(..rest.len()) {
            Some(room) if is_valid => room.copy_from_slice(&rest),
            _ => return Err("not the state of a fingerprint"),
        }
        (fingerprint.hashed, fingerprint.filled) = (hashed, rest.len());
        Ok(fingerprint)
    }
}

/// A finished fingerprint: 32 bytes, displayed as 64 hexadecimal digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Digest([u8; 32]);

const KIND_SAMPLE: u32 = 1;
const KIND_WIRE: u32 = 2;
const KIND_EVENT: u32 = 3;

impl Default for Fingerprint {
    fn default() -> Self {
        Self::new()
    }
}

impl Fingerprint {
    /// Creates an empty fingerprint.
    pub fn new() -> Self {
        Self {
            hashed: HashTree::new(),
            buffer: vec![0; 2 * BLOCK].into_boxed_slice(),
            filled: 0,
        }
    }

    /// Adds the `values` of signal group `group` at `time_ns` of simulated time.
    pub fn sample(&mut self, time_ns: u64, group: u32, values: &[f64]) {
        self.header(time_ns, KIND_SAMPLE, group, values.len());
        self.words(values, f64::to_bits);
    }

    /// Adds `bytes` transmitted on wire number `wire` at `time_ns`.
    pub fn wire(&mut self, time_ns: u64, wire: u32, bytes: &[u8]) {
        self.header(time_ns, KIND_WIRE, wire, bytes.len());
        self.bytes(bytes);
    }

    /// Adds an event: its kind as a number, its arguments as `words`.
    #[inline]
    pub fn event(&mut self, time_ns: u64, what: u32, words: &[u64]) {
        self.header(time_ns, KIND_EVENT, what, words.len());
        self.words(words, |word| word);
    }

    #[inline]
    fn header(&mut self, time_ns: u64, kind: u32, which: u32, len: usize) {
        let kind_and_number = u64::from(which) << 32 | u64::from(kind);
        self.words(&[time_ns, kind_and_number, len as u64], |word| word);
    }

    /// Adds the bits of numbers, in little-endian order.
    #[inline]
    fn words<T: Copy>(&mut self, numbers: &[T], bits: impl Fn(T) -> u64) {
        for part in numbers.chunks(BLOCK / 8) {
            let (room, _) = self.room(part.len() * 8).as_chunks_mut();
            for (bytes, number) in room.iter_mut().zip(part) {
                *bytes = bits(*number).to_le_bytes();
            }
        }
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(BLOCK) {
            self.room(part.len()).copy_from_slice(part);
        }
    }

    /// Returns the next `len` bytes of the buffer (at most [`BLOCK`]), for the caller to
    /// fill.
    #[inline]
    fn room(&mut self, len: usize) -> &mut [u8] {
        if self.filled >= BLOCK {
            self.hash_block();
        }
        let start = self.filled;
        self.filled += len;
        &mut self.buffer[start..self.filled]
    }

    /// Hashes the first block of the buffer, behind which there are or will be bytes.
    #[cold]
    fn hash_block(&mut self) {
        if let Some(block) = self.buffer.first_chunk() {
            self.hashed.push(block);
        }
        self.buffer.copy_within(BLOCK..self.filled, 0);
        self.filled -= BLOCK;
    }

    /// Returns the digest of all items so far; more may follow.
    pub fn digest(&self) -> Digest {
        let bytes = &self.buffer[..self.filled];
        let Some((block, end)) = bytes.split_first_chunk().filter(|(_, end)| !end.is_empty())
        else {
            return Digest(self.hashed.finish(bytes));
        };
        let mut hashed = self.hashed.clone();
        hashed.push(block);
        Digest(hashed.finish(end))
    }
}

impl Digest {
    /// Returns the 32 bytes.
    pub const fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for byte in self.0 {
            write!(f, "{byte:02x}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_kernel::Snapshot;

    use super::*;

    #[derive(Debug, Clone)]
    enum Item {
        Sample(u64, u32, Vec<u64>),
        Wire(u64, u32, Vec<u8>),
        Event(u64, u32, Vec<u64>),
    }

    fn item() -> impl Strategy<Value = Item> {
        let words = || prop::collection::vec(any::<u64>(), 0..200);
        prop_oneof![
            (any::<u64>(), 0..4_u32, words()).prop_map(|(t, g, w)| Item::Sample(t, g, w)),
            (
                any::<u64>(),
                0..4_u32,
                prop::collection::vec(any::<u8>(), 0..2000)
            )
                .prop_map(|(t, g, b)| Item::Wire(t, g, b)),
            (
                any::<u64>(),
                0..4_u32,
                prop::collection::vec(any::<u64>(), 0..4)
            )
                .prop_map(|(t, g, w)| Item::Event(t, g, w)),
        ]
    }

    fn digest(items: &[Item]) -> Digest {
        fingerprint(items).digest()
    }

    fn fingerprint(items: &[Item]) -> Fingerprint {
        let mut print = Fingerprint::new();
        add(&mut print, items);
        print
    }

    fn add(print: &mut Fingerprint, items: &[Item]) {
        for item in items {
            match item {
                Item::Sample(time, group, bits) => {
                    let values: Vec<f64> = bits.iter().map(|&bits| f64::from_bits(bits)).collect();
                    print.sample(*time, *group, &values);
                }
                Item::Wire(time, wire, bytes) => print.wire(*time, *wire, bytes),
                Item::Event(time, what, words) => print.event(*time, *what, words),
            }
        }
    }

    /// The same bytes, hashed at once.
    fn plain_digest(items: &[Item]) -> Digest {
        let mut bytes = Vec::new();
        for item in items {
            let (time, kind, which, len) = match item {
                Item::Sample(time, group, words) => (*time, 1_u32, *group, words.len()),
                Item::Wire(time, wire, bytes) => (*time, 2, *wire, bytes.len()),
                Item::Event(time, what, words) => (*time, 3, *what, words.len()),
            };
            bytes.extend(time.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(which.to_le_bytes());
            bytes.extend((len as u64).to_le_bytes());
            match item {
                Item::Sample(_, _, words) | Item::Event(_, _, words) => {
                    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
                }
                Item::Wire(_, _, raw) => bytes.extend(raw),
            }
        }
        Digest(*blake3::hash(&bytes).as_bytes())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn buffering_changes_no_bit(items in prop::collection::vec(item(), 0..200)) {
            prop_assert_eq!(digest(&items), plain_digest(&items));
        }

        #[test]
        fn saved_fingerprint_continues(
            items in prop::collection::vec(item(), 1..400), save in any::<prop::sample::Index>(),
        ) {
            let (before, after) = items.split_at(save.index(items.len()));
            let saved = Snapshot::of(&fingerprint(before));
            let mut restored: Fingerprint = saved.read().unwrap();
            add(&mut restored, after);
            prop_assert_eq!(restored.digest(), digest(&items));
        }

        #[test]
        fn any_flipped_bit_changes_the_digest(
            bits in prop::collection::vec(any::<u64>(), 1..50), which in any::<prop::sample::Index>(), bit in 0..64,
        ) {
            let mut other = bits.clone();
            other[which.index(bits.len())] ^= 1_u64 << bit;
            prop_assert_ne!(digest(&[Item::Sample(5, 0, bits)]), digest(&[Item::Sample(5, 0, other)]));
        }
    }

    #[test]
    fn items_longer_than_the_buffer_are_hashed_completely() {
        let long = Item::Wire(1, 0, (0..200_001_u32).map(|n| n.to_le_bytes()[0]).collect());
        let wide = Item::Sample(1, 0, (0..20_000).collect());
        let items = [wide, long];
        assert_eq!(digest(&items), plain_digest(&items));
    }

    #[test]
    fn ends_of_blocks_are_hashed_as_by_blake3() {
        for blocks in 1..=9 {
            for length in [blocks * BLOCK - 1, blocks * BLOCK, blocks * BLOCK + 1] {
                let header = 24;
                let bytes = (0..=250).cycle().take(length - header);
                let items = [Item::Wire(1, 0, bytes.collect())];
                assert_eq!(digest(&items), plain_digest(&items), "{length} bytes");
            }
        }
    }

    #[test]
    fn state_that_no_run_has_is_refused() {
        let long = |rest: usize| SavedFingerprint {
            hashed: HashTree::new(),
            rest: vec![0; rest],
        };
        assert!(Fingerprint::try_from(long(2 * BLOCK)).is_ok());
        assert!(Fingerprint::try_from(long(2 * BLOCK + 1)).is_err());
        let mut hashed = HashTree::new();
        hashed.push(vec![0; BLOCK].first_chunk().unwrap());
        let rest = Vec::new();
        assert!(Fingerprint::try_from(SavedFingerprint { hashed, rest }).is_err());
    }

    #[test]
    fn zero_and_minus_zero_differ() {
        let of = |value: f64| digest(&[Item::Sample(0, 0, vec![value.to_bits()])]);
        assert_ne!(of(0.0), of(-0.0));
    }

    #[test]
    fn empty_digest_is_that_of_blake3() {
        assert_eq!(
            Fingerprint::new().digest().to_string(),
            "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262"
        );
    }
}
