use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

/// Bytes at constant spacing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece<'a> {
    /// Completion time of the first byte: the end of its last bit.
    pub first: SimTime,
    /// Time between the ends of successive bytes; zero if all are complete at once.
    pub spacing: SimDuration,
    /// The bytes.
    pub bytes: &'a [u8],
    /// Whether the stop bits of all these bytes are wrong. A board's UART drops such a byte and
    /// counts it; a USB converter delivers it and flags it.
    pub framing_error: bool,
}

impl Piece<'_> {
    /// Returns the completion time of byte `index`.
    pub fn at(&self, index: usize) -> SimTime {
        self.first + self.spacing * index as u64
    }

    /// Returns the completion time of the last byte; of an empty piece, `first`.
    pub fn last(&self) -> SimTime {
        self.at(self.bytes.len().saturating_sub(1))
    }
}

/// A byte as a UART receives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Octet {
    pub(crate) byte: u8,
    /// Whether the stop bit is wrong.
    pub(crate) framing_error: bool,
}

impl Octet {
    /// A byte without an error.
    pub(crate) const fn good(byte: u8) -> Self {
        Self {
            byte,
            framing_error: false,
        }
    }
}

/// Received bytes with their completion times, in order of time.
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
    framing_error: bool,
}

impl Arrivals {
    /// Appends bytes, the first complete at `first`, each further one `spacing` later.
    pub fn push(&mut self, first: SimTime, spacing: SimDuration, bytes: &[u8]) {
        self.push_piece(Piece {
            first,
            spacing,
            bytes,
            framing_error: false,
        });
    }

    /// Appends bytes with their completion times and their framing error.
    pub fn push_piece(&mut self, piece: Piece<'_>) {
        if !piece.bytes.is_empty() {
            self.bytes.extend_from_slice(piece.bytes);
            self.runs.push(Run {
                count: piece.bytes.len(),
                first: piece.first,
                spacing: piece.spacing,
                framing_error: piece.framing_error,
            });
        }
    }

    /// Appends one byte to the last run if it continues it, else starts a new run.
    pub(crate) fn push_byte(&mut self, at: SimTime, spacing: SimDuration, octet: Octet) {
        if let Some(run) = self.runs.last_mut()
            && run.spacing == spacing
            && run.framing_error == octet.framing_error
            && run.first + spacing * run.count as u64 == at
        {
            run.count += 1;
            self.bytes.push(octet.byte);
        } else {
            self.push_piece(Piece {
                first: at,
                spacing,
                bytes: &[octet.byte],
                framing_error: octet.framing_error,
            });
        }
    }

    /// Number of bytes with a framing error.
    pub(crate) fn framing_errors(&self) -> usize {
        let wrong = self.runs.iter().filter(|run| run.framing_error);
        wrong.map(|run| run.count).sum()
    }

    /// Moves all bytes out of `other`, which keeps its capacity.
    pub fn append(&mut self, other: &mut Self) {
        self.bytes.append(&mut other.bytes);
        self.runs.append(&mut other.runs);
    }

    /// Returns the completion time of byte `index`.
    pub fn at(&self, index: usize) -> Option<SimTime> {
        if index >= self.bytes.len() {
            return None;
        }
        let mut before = 0;
        for run in &self.runs {
            if index < before + run.count {
                return Some(run.first + run.spacing * (index - before) as u64);
            }
            before += run.count;
        }
        None
    }

    /// Returns the completion time of the last byte.
    pub fn last(&self) -> Option<SimTime> {
        let run = self.runs.last()?;
        Some(run.first + run.spacing * (run.count as u64 - 1))
    }

    /// Number of bytes complete by `now`.
    pub fn complete(&self, now: SimTime) -> usize {
        let of_run = |run: &Run| match now.checked_since(run.first) {
            None => 0,
            Some(since) if run.spacing * (run.count as u64 - 1) > since => {
                let spaces = since.as_nanos() / run.spacing.as_nanos();
                usize::try_from(spaces).map_or(run.count, |spaces| spaces + 1)
            }
            Some(_) => run.count,
        };
        self.runs.iter().map(of_run).sum()
    }

    /// Removes the first `count` bytes and passes them to `taken` in runs of constant spacing.
    pub fn take(&mut self, count: usize, mut taken: impl FnMut(Piece<'_>)) {
        let count = count.min(self.bytes.len());
        let (mut from, mut runs) = (0, 0);
        for run in &mut self.runs {
            let part = run.count.min(count - from);
            if part > 0 {
                taken(Piece {
                    first: run.first,
                    spacing: run.spacing,
                    bytes: &self.bytes[from..from + part],
                    framing_error: run.framing_error,
                });
                from += part;
            }
            if part < run.count {
                run.count -= part;
                run.first += run.spacing * part as u64;
                break;
            }
            runs += 1;
        }
        self.bytes.drain(..count);
        self.runs.drain(..runs);
    }

    /// Iterates over the bytes in runs of constant spacing.
    pub fn pieces(&self) -> impl Iterator<Item = Piece<'_>> {
        let mut rest = &self.bytes[..];
        self.runs.iter().map(move |run| {
            let (bytes, after) = rest.split_at(run.count);
            rest = after;
            Piece {
                first: run.first,
                spacing: run.spacing,
                bytes,
                framing_error: run.framing_error,
            }
        })
    }

    /// Iterates over the single bytes with their completion times.
    pub fn iter(&self) -> impl Iterator<Item = (SimTime, u8)> {
        self.pieces()
            .flat_map(|piece| (0..piece.bytes.len()).map(move |n| (piece.at(n), piece.bytes[n])))
    }

    /// The bytes without their times.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Number of bytes.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether there are no bytes.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Removes all bytes and keeps the capacity.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.runs.clear();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn ns(nanos: u64) -> SimTime {
        SimTime::from_nanos(nanos)
    }

    proptest! {
        #[test]
        fn taken_and_remaining_bytes_equal_the_original(
            runs in prop::collection::vec(
                (0_u64..50, 0_u64..9, prop::collection::vec(any::<u8>(), 0..9), any::<bool>()), 0..6,
            ),
            count in 0_usize..40, now in 0_u64..400,
        ) {
            let (mut arrivals, mut first) = (Arrivals::default(), 0);
            for (gap, spacing, bytes, framing_error) in &runs {
                first += gap;
                let spacing = SimDuration::from_nanos(*spacing);
                arrivals.push_piece(Piece {
                    first: ns(first),
                    spacing,
                    bytes,
                    framing_error: *framing_error,
                });
                first += spacing.as_nanos() * bytes.len() as u64;
            }
            let before: Vec<_> = arrivals.iter().collect();
            let wrong = |arrivals: &Arrivals| -> Vec<bool> {
                let pieces = arrivals.pieces();
                pieces.flat_map(|piece| vec![piece.framing_error; piece.bytes.len()]).collect()
            };
            let wrong_before = wrong(&arrivals);
            prop_assert_eq!(arrivals.framing_errors(), wrong_before.iter().filter(|wrong| **wrong).count());
            prop_assert_eq!(arrivals.complete(ns(now)), before.iter().filter(|(at, _)| *at <= ns(now)).count());
            prop_assert_eq!(arrivals.last(), before.last().map(|(at, _)| *at));
            prop_assert_eq!(arrivals.at(count), before.get(count).map(|(at, _)| *at));
            let mut after = Arrivals::default();
            arrivals.take(count, |piece| after.push_piece(piece));
            after.append(&mut arrivals);
            prop_assert!(arrivals.is_empty());
            prop_assert_eq!(wrong(&after), wrong_before);
            prop_assert_eq!(after.iter().collect::<Vec<_>>(), before);
        }
    }
}
