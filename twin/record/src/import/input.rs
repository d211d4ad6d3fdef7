//! Bytes of a log: read in pieces, decompressed, counted and hashed.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::Path;
use std::rc::Rc;

use flate2::bufread::MultiGzDecoder;

use super::error::LogFault;

/// Bytes that are read at once.
const PIECE: usize = 64 * 1024;
/// Beginning of data that are compressed by gzip.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Hash of the bytes of a log as they are on disk.
pub(super) type Hash = Rc<RefCell<blake3::Hasher>>;

/// Reader that hashes what it reads.
struct Hashed<R> {
    inner: R,
    hash: Hash,
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        if let Some(read) = buffer.get(..count) {
            self.hash.borrow_mut().update(read);
        }
        Ok(count)
    }
}

/// A log that is being read, byte by byte.
pub(super) struct Input<'a> {
    source: Box<dyn Read + 'a>,
    buffer: Vec<u8>,
    position: usize,
    filled: usize,
    /// Bytes that may still be read, and their total.
    left: u64,
    most: u64,
    is_compressed: bool,
    /// Line of the next byte, counted from 1.
    pub line: u64,
}

impl<'a> Input<'a> {
    /// Opens the file at `path`, of which at most `most` bytes are read after decompression.
    pub(super) fn open(path: &Path, hash: &Hash, most: u64) -> Result<Self, LogFault> {
        let file = File::open(path).map_err(LogFault::Read)?;
        Self::new(file, hash, most)
    }

    /// Reads `raw`, which may be compressed.
    pub(super) fn new(raw: impl Read + 'a, hash: &Hash, most: u64) -> Result<Self, LogFault> {
        let hash = Rc::clone(hash);
        let mut raw = Hashed { inner: raw, hash };
        let mut start = Vec::with_capacity(GZIP.len());
        let beginning = raw.by_ref().take(GZIP.len() as u64);
        read_to_end(beginning, &mut start)?;
        let is_compressed = start == GZIP;
        let raw = io::Cursor::new(start).chain(raw);
        let source: Box<dyn Read + 'a> = if is_compressed {
            Box::new(MultiGzDecoder::new(BufReader::with_capacity(PIECE, raw)))
        } else {
            Box::new(raw)
        };
        Ok(Self {
            source,
            buffer: vec![0; PIECE],
            position: 0,
            filled: 0,
            left: most,
            most,
            is_compressed,
            line: 1,
        })
    }

    /// Reads bytes that are in memory, and not compressed.
    pub(super) fn of_bytes(bytes: &[u8]) -> Self {
        Self {
            source: Box::new(io::empty()),
            buffer: bytes.to_vec(),
            position: 0,
            filled: bytes.len(),
            left: 0,
            most: 0,
            is_compressed: false,
            line: 1,
        }
    }

    /// Returns the bytes that are at hand, and reads some if there are none; empty at the end.
    pub(super) fn fill(&mut self) -> Result<&[u8], LogFault> {
        if self.position >= self.filled {
            self.position = 0;
            self.filled = loop {
                match self.source.read(&mut self.buffer) {
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(error) => return Err(self.fault(error)),
                    Ok(count) => break count.min(self.buffer.len()),
                }
            };
            let count = self.filled as u64;
            let most = self.most;
            let left = self.left.checked_sub(count);
            self.left = left.ok_or(LogFault::TooLong { most })?;
        }
        Ok(self
            .buffer
            .get(self.position..self.filled)
            .unwrap_or_default())
    }

    /// Marks bytes as read that [`Input::fill`] returned and that have no line break.
    pub(super) fn skip(&mut self, count: usize) {
        self.position += count;
    }

    /// Returns the next byte without reading it; none at the end.
    #[inline]
    pub(super) fn peek(&mut self) -> Result<Option<u8>, LogFault> {
        if let Some(byte) = self.buffer.get(self.position)
            && self.position < self.filled
        {
            return Ok(Some(*byte));
        }
        Ok(self.fill()?.first().copied())
    }

    /// Reads the next byte; none at the end.
    #[inline]
    pub(super) fn next(&mut self) -> Result<Option<u8>, LogFault> {
        let byte = self.peek()?;
        if let Some(byte) = byte {
            self.position += 1;
            self.line += u64::from(byte == b'\n');
        }
        Ok(byte)
    }

    /// Reads `count` bytes in place of those of `into`; `false` if there are fewer. Memory is taken
    /// for bytes that are there only.
    pub(super) fn take(&mut self, mut count: u64, into: &mut Vec<u8>) -> Result<bool, LogFault> {
        into.clear();
        while count > 0 {
            let at_hand = self.fill()?;
            let now =
                usize::try_from(count).map_or(at_hand.len(), |count| count.min(at_hand.len()));
            if now == 0 {
                return Ok(false);
            }
            into.extend(at_hand.get(..now).unwrap_or_default());
            self.position += now;
            count -= now as u64;
        }
        Ok(true)
    }

    /// Passes over `count` bytes; `false` if there are fewer.
    pub(super) fn pass(&mut self, mut count: u64) -> Result<bool, LogFault> {
        while count > 0 {
            let at_hand = self.fill()?.len();
            if at_hand == 0 {
                return Ok(false);
            }
            let now = usize::try_from(count).map_or(at_hand, |count| count.min(at_hand));
            self.position += now;
            count -= now as u64;
        }
        Ok(true)
    }

    fn fault(&self, error: io::Error) -> LogFault {
        match error.kind() {
            ErrorKind::UnexpectedEof if self.is_compressed => LogFault::TruncatedGzip,
            ErrorKind::InvalidInput | ErrorKind::InvalidData if self.is_compressed => {
                LogFault::Gzip(error)
            }
            _ => LogFault::Read(error),
        }
    }
}

fn read_to_end(mut from: impl Read, to: &mut Vec<u8>) -> Result<(), LogFault> {
    from.read_to_end(to).map_err(LogFault::Read)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    fn compressed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn all(bytes: &[u8], most: u64) -> Result<(Vec<u8>, u64), LogFault> {
        let mut input = Input::new(bytes, &Hash::default(), most)?;
        let mut found = Vec::new();
        while let Some(byte) = input.next()? {
            found.push(byte);
        }
        Ok((found, input.line))
    }

    #[test]
    fn plain_and_compressed_bytes_are_the_same() {
        let text: Vec<u8> = (0..200_000_u32).map(|n| (n % 251) as u8).collect();
        let lines = text.split(|&byte| byte == b'\n').count() as u64;
        assert_eq!(all(&text, 200_000).unwrap(), (text.clone(), lines));
        let gzip = compressed(&text);
        assert_eq!(all(&gzip, 200_000).unwrap(), (text.clone(), lines));
        // Several members are one file.
        let twice = [&gzip[..], &gzip].concat();
        assert_eq!(all(&twice, 400_000).unwrap().0, [&text[..], &text].concat());
        assert_eq!(all(b"", 0).unwrap().0, b"");
        assert_eq!(all(b"\x1f", 9).unwrap().0, b"\x1f");
    }

    #[test]
    fn damage_and_length_of_compressed_bytes_are_found() {
        let gzip = compressed(&vec![7; 100_000]);
        assert!(matches!(
            all(&gzip, 99_999),
            Err(LogFault::TooLong { most: 99_999 })
        ));
        for end in [3, 15, gzip.len() / 2, gzip.len() - 1] {
            let fault = all(&gzip[..end], 1 << 20).unwrap_err();
            assert!(matches!(fault, LogFault::TruncatedGzip), "{end}: {fault}");
        }
        let mut damaged = gzip.clone();
        let last = damaged.len() - 5;
        damaged[last] ^= 1;
        assert!(matches!(all(&damaged, 1 << 20), Err(LogFault::Gzip(_))));
    }
}
