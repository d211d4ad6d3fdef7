use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Serialised state of a part: bytes (postcard) that restore it bit for bit, `NaN` payloads and
/// negative zeros included. The layout is private to the part and valid for the same build only.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Snapshot(pub Vec<u8>);

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
