use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Serialised state of a part: bytes (postcard) that restore it bit for bit, `NaN` payloads and
/// negative zeros included. The layout is private to the part and valid for the same build only.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Snapshot(pub Vec<u8>);

/// Length of the hash in front of checked bytes.
const HASH_BYTES: usize = blake3::OUT_LEN;

/// A snapshot that does not match the part it is restored into.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SnapshotError {
    /// The bytes do not decode as the state of such a part.
    #[error("the snapshot does not hold a {state}: {why}")]
    Decode {
        /// Expected type.
        state: &'static str,
        /// Message of the decoder.
        why: String,
    },
    /// The hash in front of the bytes is not theirs.
    #[error("the bytes were changed, cut off, or saved by another one")]
    Damaged,
    /// The bytes are the state of a part of another model or configuration.
    #[error("the snapshot was taken of {found}, and is restored into {expected}")]
    Mismatch {
        /// The part to be restored.
        expected: String,
        /// The part of which the snapshot was taken.
        found: String,
    },
    /// The part does not save its state.
    #[error("{part} cannot be restored: it does not implement `save` and `restore`")]
    Unsupported {
        /// The part.
        part: String,
    },
    /// The part is made of a model without this capability.
    #[error("{part} cannot be saved and restored: it lacks `{capability}`")]
    Lacking {
        /// The part.
        part: String,
        /// The capability, by the name that the makers of the model know.
        capability: String,
    },
}

impl Snapshot {
    /// Serialises `state`.
    ///
    /// # Panics
    /// If `Serialize` of the state fails, which it does not for numbers, strings, vectors and
    /// derived structures.
    pub fn of<T: Serialize>(state: &T) -> Self {
        Self(
            postcard::to_allocvec(state)
                .expect("writing to memory fails only in a faulty Serialize"),
        )
    }

    /// Returns the bytes behind a keyed hash of them: every state that leaves a rig has one, since
    /// a changed bit may be the state of another motion. States of different `key` are no states
    /// of each other.
    #[must_use]
    pub fn checked(&self, key: &[u8; 32]) -> Vec<u8> {
        let hash = blake3::keyed_hash(key, &self.0);
        [hash.as_bytes(), self.0.as_slice()].concat()
    }

    /// Returns the snapshot of the bytes of [`Snapshot::checked`].
    ///
    /// # Errors
    /// [`SnapshotError::Damaged`] for any other bytes.
    pub fn verified(bytes: &[u8], key: &[u8; 32]) -> Result<Self, SnapshotError> {
        let (hash, state) = bytes.split_at_checked(HASH_BYTES).unwrap_or((bytes, &[]));
        if hash == blake3::keyed_hash(key, state).as_bytes() {
            return Ok(Self(state.to_vec()));
        }
        Err(SnapshotError::Damaged)
    }

    /// Deserialises a state of type `T`.
    ///
    /// # Errors
    /// [`SnapshotError::Decode`] if the bytes are not exactly one `T`.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, SnapshotError> {
        let fail = |why: String| SnapshotError::Decode {
            state: std::any::type_name::<T>(),
            why,
        };
        let (state, rest) =
            postcard::take_from_bytes(&self.0).map_err(|error| fail(error.to_string()))?;
        if rest.is_empty() {
            Ok(state)
        } else {
            Err(fail(format!("{} bytes are left over", rest.len())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_are_restored_bit_for_bit() {
        let odd = [
            0.1,
            -0.0,
            f64::from_bits(0x7ff8_0000_dead_beef),
            f64::MIN_POSITIVE / 2.0,
            f64::INFINITY,
        ];
        let back: [f64; 5] = Snapshot::of(&odd).read().unwrap();
        assert_eq!(odd.map(f64::to_bits), back.map(f64::to_bits));
    }

    #[test]
    fn every_change_of_checked_bytes_is_refused() {
        let (snapshot, key) = (Snapshot::of(&[1_u64, 2, 300]), [7; 32]);
        let bytes = snapshot.checked(&key);
        assert_eq!(Snapshot::verified(&bytes, &key), Ok(snapshot));
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(
                Snapshot::verified(&flipped, &key),
                Err(SnapshotError::Damaged)
            );
        }
        for length in 0..bytes.len() {
            assert!(Snapshot::verified(&bytes[..length], &key).is_err());
        }
        assert!(Snapshot::verified(&bytes, &[8; 32]).is_err());
    }

    #[test]
    fn bytes_of_another_type_are_rejected() {
        let snapshot = Snapshot::of(&(1_u64, 2.0_f64));
        assert!(matches!(
            snapshot.read::<u64>(),
            Err(SnapshotError::Decode { .. })
        ));
        assert!(matches!(
            snapshot.read::<[f64; 9]>(),
            Err(SnapshotError::Decode { .. })
        ));
    }
}
