use std::cell::RefCell;
use std::collections::BTreeSet;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};

/// Named stream of random numbers (`ChaCha8`), serialised with the part that draws from it.
///
/// The conversions to floating point and to ranges are implemented here, so that no release of
/// another crate changes the results of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Stream {
    numbers: ChaCha8Rng,
    name: Box<str>,
    /// Whether a number was drawn, since it was created or restored.
    #[serde(skip)]
    is_drawn: bool,
}

/// Streams with the same next numbers are equal.
impl PartialEq for Stream {
    fn eq(&self, other: &Self) -> bool {
        self.numbers == other.numbers
    }
}

impl Eq for Stream {}

thread_local! {
    /// Names of the streams that were drawn from, within [`drawn_streams`].
    static DRAWN: RefCell<Option<BTreeSet<String>>> = const { RefCell::new(None) };
}

/// Returns the result of `run` and the names of the streams whose first number it drew, or the
/// first one after they were restored from a saved state, sorted. Draws of other threads are not
/// counted.
///
/// ```
/// use twinrig_kernel::{drawn_streams, stream};
/// let (_, drawn) = drawn_streams(|| {
///     let (mut used, _unused) = (stream(1, "noise"), stream(1, "jitter"));
///     used.unit()
/// });
/// assert_eq!(drawn, ["noise"]);
/// ```
pub fn drawn_streams<T>(run: impl FnOnce() -> T) -> (T, Vec<String>) {
    /// Restores the names of the caller's own census, also after a panic.
    struct Outer(Option<BTreeSet<String>>);
    impl Drop for Outer {
        fn drop(&mut self) {
            DRAWN.set(self.0.take());
        }
    }
    let mut outer = Outer(DRAWN.replace(Some(BTreeSet::new())));
    let result = run();
    let drawn = DRAWN.take().unwrap_or_default();
    let names = drawn.iter().cloned().collect();
    if let Some(outer) = &mut outer.0 {
        outer.extend(drawn);
    }
    (result, names)
}

/// Returns the stream of `name` under `seed`. Its key is the BLAKE3 hash of both: adding a stream
/// does not change the numbers of another, and no two names share numbers.
///
/// ```
/// use twinrig_kernel::stream;
/// let mut jitter = stream(1, "wire/sbcp/usb");
/// assert_ne!(jitter.bits(), stream(2, "wire/sbcp/usb").bits());
/// ```
pub fn stream(seed: u64, name: &str) -> Stream {
    let mut hasher = blake3::Hasher::new_derive_key("twinrig random stream, version 1");
    hasher.update(&seed.to_le_bytes());
    hasher.update(name.as_bytes());
    Stream {
        numbers: ChaCha8Rng::from_seed(*hasher.finalize().as_bytes()),
        name: name.into(),
        is_drawn: false,
    }
}

impl Stream {
    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        if !self.is_drawn {
            self.is_drawn = true;
            note_draw(&self.name);
        }
        self.numbers.next_u64()
    }

    /// Returns a uniform number in [0, 1), a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Returns a uniform integer in `min..=max`, without bias.
    ///
    /// # Panics
    /// If `min` is greater than `max`.
    pub fn between(&mut self, min: u64, max: u64) -> u64 {
        assert!(min <= max, "empty range: {min}..={max}");
        let Some(count) = (max - min).checked_add(1) else {
            return self.bits();
        };
        // Products whose low half is below 2⁶⁴ mod count are rejected (Lemire): they would bias
        // the result.
        let biased = count.wrapping_neg() % count;
        loop {
            let wide = u128::from(self.bits()) * u128::from(count);
            #[expect(clippy::cast_possible_truncation, reason = "low and high half")]
            if wide as u64 >= biased {
                return min + (wide >> 64) as u64;
            }
        }
    }

    /// Returns a standard normal number (Marsaglia's polar method; the second number of each pair
    /// is discarded, so that the state of the stream is its position).
    pub fn normal(&mut self) -> f64 {
        loop {
            let (x, y) = (2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0);
            let square = x * x + y * y;
            if square > 0.0 && square < 1.0 {
                return x * (-2.0 * libm::log(square) / square).sqrt();
            }
        }
    }
}

/// Counts streams that were drawn from before, as while parts were built, for [`drawn_streams`].
pub fn count_drawn(names: &[String]) {
    for name in names {
        note_draw(name);
    }
}

#[cold]
fn note_draw(name: &str) {
    DRAWN.with_borrow_mut(|drawn| {
        if let Some(drawn) = drawn {
            drawn.insert(name.to_owned());
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Snapshot;

    #[test]
    fn numbers_of_a_name_are_stable_across_releases() {
        let mut usb = stream(1, "wire/sbcp/usb");
        assert_eq!(
            [usb.bits(), usb.bits()],
            [8_088_239_063_633_572_354, 10_207_175_362_287_427_495]
        );
        assert_eq!(
            stream(1, "process/compute").normal().to_bits(),
            0xbff7_8a9a_c917_5035
        );
        assert_eq!(stream(u64::MAX, "").unit().to_bits(), 0x3fef_37cc_7cc1_d5e3);
    }

    #[test]
    fn seed_and_name_are_hashed_unambiguously() {
        // The seed is hashed first, always as eight bytes.
        let seed = u64::from_le_bytes(*b"abcdefgh");
        assert_ne!(
            stream(seed, "x").bits(),
            stream(u64::from_le_bytes(*b"abcdefg\0"), "hx").bits()
        );
    }

    #[test]
    fn restored_stream_continues_bit_for_bit() {
        let mut stream = stream(7, "any");
        for _ in 0..37 {
            stream.bits();
        }
        let mut restored: Stream = Snapshot::of(&stream).read().unwrap();
        for _ in 0..100 {
            assert_eq!(restored.bits(), stream.bits());
        }
    }

    #[test]
    fn nested_census_belongs_to_the_outer_one_and_a_panic_ends_its_own() {
        let draw = |name: &str| stream(1, name).bits();
        let (inner, outer) = drawn_streams(|| {
            draw("before");
            let (_, inner) = drawn_streams(|| draw("inner"));
            let panicked = std::panic::catch_unwind(|| drawn_streams(|| panic!("in a run")));
            assert!(panicked.is_err());
            draw("after");
            inner
        });
        assert_eq!(inner, ["inner"]);
        assert_eq!(outer, ["after", "before", "inner"]);
        // Outside of a census a draw is forgotten.
        let mut early = stream(1, "early");
        early.bits();
        let names = ["built".to_owned()];
        let (_, drawn) = drawn_streams(|| (early.bits(), count_drawn(&names)));
        assert_eq!(drawn, names);
        // A restored stream is counted anew.
        let (_, drawn) = drawn_streams(|| {
            let mut restored: Stream = Snapshot::of(&early).read().unwrap();
            restored.bits()
        });
        assert_eq!(drawn, ["early"]);
    }

    #[test]
    fn sample_moments_match_the_distributions() {
        let mut stream = stream(3, "moments");
        let count = 100_000;
        let normal: Vec<f64> = (0..count).map(|_| stream.normal()).collect();
        let mean = normal.iter().sum::<f64>() / f64::from(count);
        let variance =
            normal.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / f64::from(count);
        assert!(
            mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02,
            "{mean} {variance}"
        );
        let mut counts = [0_u32; 6];
        for _ in 0..count {
            counts[usize::try_from(stream.between(1, 6) - 1).unwrap()] += 1;
        }
        assert!(
            counts.iter().all(|&n| (15_900..17_500).contains(&n)),
            "{counts:?}"
        );
        assert_eq!(stream.between(5, 5), 5);
        stream.between(0, u64::MAX);
    }
}
