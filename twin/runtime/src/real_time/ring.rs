use rtrb::{Consumer, Producer, RingBuffer};
use twinrig_kernel::HostTime;

/// Header of a record: kind, source, payload size and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) kind: u8,
    /// Index of a byte trace or group.
    pub(super) source: u16,
    /// Size of the payload \[bytes\].
    pub(super) bytes: u32,
    pub(super) at: HostTime,
}

const HEAD_WORDS: usize = 2;
const WORD_BYTES: usize = 8;
/// Words reserved for two records without payload: a task may end and then fail before the queue is
/// read.
const RESERVED_WORDS: usize = 2 * HEAD_WORDS;

/// Writing end of a bounded queue between two threads; wait-free and without allocation.
pub(super) struct RingWriter {
    words: Producer<u64>,
    /// Number of records lost because the queue was full.
    lost: u64,
}

/// Reading end of the queue.
pub(super) struct RingReader {
    words: Consumer<u64>,
    payload: Vec<u64>,
}

/// Creates a queue of `words` words of 8 bytes.
pub(super) fn ring(words: usize) -> (RingWriter, RingReader) {
    let (producer, consumer) = RingBuffer::new(words);
    (
        RingWriter {
            words: producer,
            lost: 0,
        },
        RingReader {
            words: consumer,
            payload: Vec::with_capacity(1024),
        },
    )
}

fn payload_words(bytes: usize) -> usize {
    bytes.div_ceil(WORD_BYTES)
}

impl RingWriter {
    /// Appends a record as a whole, or drops and counts it if fewer than `reserve` words would stay
    /// free.
    fn push(&mut self, head: Head, reserve: usize, payload: impl Iterator<Item = u64>) {
        let words = HEAD_WORDS + payload_words(head.bytes as usize);
        if self.words.slots() < words + reserve {
            self.lost += 1;
            return;
        }
        if let Ok(chunk) = self.words.write_chunk_uninit(words) {
            let first =
                u64::from(head.kind) << 56 | u64::from(head.source) << 32 | u64::from(head.bytes);
            chunk.fill_from_iter([first, head.at.as_nanos()].into_iter().chain(payload));
        }
    }

    /// Appends a record of words.
    pub(super) fn push_words(
        &mut self,
        kind: u8,
        source: u16,
        at: HostTime,
        words: impl ExactSizeIterator<Item = u64>,
    ) {
        let Ok(bytes) = u32::try_from(words.len() * WORD_BYTES) else {
            self.lost += 1;
            return;
        };
        let head = Head {
            kind,
            source,
            bytes,
            at,
        };
        self.push(head, RESERVED_WORDS, words);
    }

    /// Appends a record of bytes.
    pub(super) fn push_bytes(&mut self, kind: u8, source: u16, at: HostTime, bytes: &[u8]) {
        let Ok(len) = u32::try_from(bytes.len()) else {
            self.lost += 1;
            return;
        };
        let head = Head {
            kind,
            source,
            bytes: len,
            at,
        };
        let words = bytes.chunks(WORD_BYTES).map(|chunk| {
            let mut word = [0; WORD_BYTES];
            word[..chunk.len()].copy_from_slice(chunk);
            u64::from_le_bytes(word)
        });
        self.push(head, RESERVED_WORDS, words);
    }

    /// Appends a record without payload, which may use the reserved words.
    pub(super) fn push_mark(&mut self, kind: u8, source: u16, at: HostTime) {
        let head = Head {
            kind,
            source,
            bytes: 0,
            at,
        };
        self.push(head, 0, std::iter::empty());
    }

    /// Returns the number of lost records.
    pub(super) fn lost(&self) -> u64 {
        self.lost
    }
}

impl RingReader {
    /// Returns the header of the next record without removing it.
    pub(super) fn peek(&mut self) -> Option<Head> {
        let chunk = self.words.read_chunk(HEAD_WORDS).ok()?;
        let (a, b) = chunk.as_slices();
        let mut words = a.iter().chain(b).copied();
        let (first, at) = (words.next()?, words.next()?);
        let [kind, _, source_high, source_low, rest @ ..] = first.to_be_bytes();
        Some(Head {
            kind,
            source: u16::from_be_bytes([source_high, source_low]),
            bytes: u32::from_be_bytes(rest),
            at: HostTime::from_nanos(at),
        })
    }

    /// Removes and returns the next record with its payload.
    pub(super) fn pop(&mut self) -> Option<(Head, &[u64])> {
        let head = self.peek()?;
        let words = HEAD_WORDS + payload_words(head.bytes as usize);
        let chunk = self.words.read_chunk(words).ok()?;
        let (a, b) = chunk.as_slices();
        self.payload.clear();
        self.payload.extend(a.iter().chain(b).skip(HEAD_WORDS));
        chunk.commit_all();
        Some((head, &self.payload))
    }

    /// Returns whether the writing end is dropped. Its records can still be read.
    pub(super) fn is_abandoned(&self) -> bool {
        self.words.is_abandoned()
    }
}

/// Unpacks the bytes from the words of a record.
pub(super) fn unpack(head: Head, words: &[u64], bytes: &mut Vec<u8>) {
    bytes.clear();
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.truncate(head.bytes as usize);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn records_are_returned_in_order_and_losses_are_counted(
            records in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 1..60),
            pops in prop::collection::vec(0_usize..4, 60),
        ) {
            let (mut writer, mut reader) = ring(24);
            let (mut expected, mut received, mut bytes) = (Vec::new(), Vec::new(), Vec::new());
            for (n, (record, pops)) in records.iter().zip(pops).enumerate() {
                let lost = writer.lost();
                let at = HostTime::from_nanos(n as u64);
                writer.push_bytes(3, 0x1234, at, record);
                if writer.lost() == lost {
                    expected.push((at, record.clone()));
                }
                for _ in 0..pops {
                    if let Some((head, words)) = reader.pop() {
                        prop_assert_eq!((head.kind, head.source), (3, 0x1234));
                        unpack(head, words, &mut bytes);
                        received.push((head.at, bytes.clone()));
                    }
                }
            }
            while let Some((head, words)) = reader.pop() {
                unpack(head, words, &mut bytes);
                received.push((head.at, bytes.clone()));
            }
            prop_assert_eq!(writer.lost(), (records.len() - expected.len()) as u64);
            prop_assert_eq!(received, expected);
        }
    }

    #[test]
    fn full_ring_has_space_for_two_marks() {
        let (mut writer, mut reader) = ring(16);
        let at = HostTime::from_nanos(1);
        while writer.lost() == 0 {
            writer.push_bytes(0, 0, at, &[1]);
        }
        writer.push_mark(2, 0, at);
        writer.push_mark(3, 0, at);
        assert_eq!(writer.lost(), 1);
        let kinds: Vec<u8> =
            std::iter::from_fn(|| reader.pop().map(|(head, _)| head.kind)).collect();
        assert_eq!(kinds, [0, 0, 0, 0, 2, 3]);
    }
}
