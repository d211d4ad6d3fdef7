use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The saved state of a part: bytes (postcard) that bring it back bit for bit, `NaN` payloads and
/// negative zeros included. The layout is private to the part; a snapshot is for the same build.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Snapshot(pub Vec<u8>);

/// A snapshot that does not fit the part it is given to.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SnapshotError {
    /// The bytes are not the state of such a part.
    #[error("the snapshot does not hold a {state}: {why}")]
    Decode {
        /// Type that was to be read.
        state: &'static str,
        /// What the decoder said.
        why: String,
    },
    /// The bytes are a state, but of something of another make.
    #[error("the snapshot was taken of {found}, and is restored into {expected}")]
    Mismatch {
        /// The part that is to be restored.
        expected: String,
        /// The part that was saved.
        found: String,
    },
}

impl Snapshot {
    /// Saves `state`.
    ///
    /// # Panics
    /// If the `Serialize` of the state gives up, which a state made of numbers, strings, vectors and
    /// derived structures never does.
    pub fn of<T: Serialize>(state: &T) -> Self {
        Self(
            postcard::to_allocvec(state)
                .expect("writing to memory fails only in a faulty Serialize"),
        )
    }

    /// Reads back a state of type `T`.
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
    fn floats_come_back_bit_for_bit() {
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
    fn bytes_of_another_shape_are_refused() {
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
