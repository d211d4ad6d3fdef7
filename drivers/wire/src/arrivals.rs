use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

/// Bytes that follow one another at an even pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece<'a> {
    /// When the first of them is complete: its last bit is over.
    pub first: SimTime,
    /// From one byte's end to the next one's; zero if they come all at once.
    pub spacing: SimDuration,
    /// The bytes.
    pub bytes: &'a [u8],
}

impl Piece<'_> {
    /// When byte `index` is complete.
    pub fn at(&self, index: usize) -> SimTime {
        self.first + self.spacing * index as u64
    }

    /// When the last byte is complete; the first one's time if there is none.
    pub fn last(&self) -> SimTime {
        self.at(self.bytes.len().saturating_sub(1))
    }
}

/// Bytes with the instants at which each was complete, in order of time.
///
/// ```
/// use twinrig_kernel::{SimDuration, SimTime};
/// use twinrig_wire::Arrivals;
///
/// let micros = |n| SimTime::ZERO + SimDuration::from_micros(n);
/// let mut arrivals = Arrivals::default();
/// arrivals.push(micros(3), SimDuration::from_micros(3), b"abc");
/// assert_eq!(arrivals.iter().last(), Some((micros(9), b'c')));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Arrivals {
    bytes: Vec<u8>,
    runs: Vec<Run>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Run {
    count: usize,
    first: SimTime,
    spacing: SimDuration,
}

impl Arrivals {
    /// Appends bytes, the first of which was complete at `first`, the others `spacing` later each.
    pub fn push(&mut self, first: SimTime, spacing: SimDuration, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.bytes.extend_from_slice(bytes);
            self.runs.push(Run {
                count: bytes.len(),
                first,
                spacing,
            });
        }
    }

    /// The bytes in stretches of an even pace.
    pub fn pieces(&self) -> impl Iterator<Item = Piece<'_>> {
        let mut rest = &self.bytes[..];
        self.runs.iter().map(move |run| {
            let (bytes, after) = rest.split_at(run.count);
            rest = after;
            Piece {
                first: run.first,
                spacing: run.spacing,
                bytes,
            }
        })
    }

    /// The bytes one by one, with their times.
    pub fn iter(&self) -> impl Iterator<Item = (SimTime, u8)> {
        self.pieces()
            .flat_map(|piece| (0..piece.bytes.len()).map(move |n| (piece.at(n), piece.bytes[n])))
    }

    /// The bytes without their times.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Forgets them all, and keeps the room.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.runs.clear();
    }
}
