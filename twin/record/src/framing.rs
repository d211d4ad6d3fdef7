//! Framing of MCAP files: records of an opcode, a length and a body.
//!
//! Records are read in place, without copies, up to the first incomplete record, at which the
//! recording of a killed run ends.

use mcap::records::{ChunkHeader, op};

use crate::RecordError;

/// A complete record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawRecord<'a> {
    /// Offset from the start of the file \[bytes\].
    pub offset: usize,
    pub opcode: u8,
    pub body: &'a [u8],
}

/// Iterator over the complete records of `bytes`, which begin at offset `base` of the file.
#[derive(Debug, Clone)]
pub(crate) struct Records<'a> {
    bytes: &'a [u8],
    base: usize,
    position: usize,
}

impl<'a> Records<'a> {
    pub(crate) fn new(bytes: &'a [u8], base: usize) -> Self {
        Self {
            bytes,
            base,
            position: 0,
        }
    }

    /// Returns the bytes after the last complete record.
    pub(crate) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.position..]
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = RawRecord<'a>;

    fn next(&mut self) -> Option<RawRecord<'a>> {
        let mut reader = Reader(self.rest());
        let opcode = reader.take(1)?[0];
        let len = usize::try_from(reader.u64()?).ok()?;
        let body = reader.take(len)?;
        let offset = self.base + self.position;
        self.position += 9 + len;
        Some(RawRecord {
            offset,
            opcode,
            body,
        })
    }
}

impl<'a> RawRecord<'a> {
    /// Creates an error about this record.
    pub(crate) fn damaged(&self, why: impl Into<String>) -> RecordError {
        RecordError::Damaged {
            offset: self.offset,
            why: why.into(),
        }
    }

    /// Returns the offset in the file of a position in the body.
    fn offset_of(&self, body_position: usize) -> usize {
        self.offset + 9 + body_position
    }

    /// Parses a schema, channel, header or metadata record.
    pub(crate) fn parse(&self) -> Result<mcap::records::Record<'a>, RecordError> {
        mcap::parse_record(self.opcode, self.body).map_err(|error| self.damaged(chain(&error)))
    }

    /// Returns the records inside a chunk.
    pub(crate) fn chunk(&self) -> Result<Records<'a>, RecordError> {
        debug_assert_eq!(self.opcode, op::CHUNK);
        let mcap::records::Record::Chunk { header, .. } = self.parse()? else {
            return Err(self.damaged("not a chunk"));
        };
        let ChunkHeader {
            uncompressed_crc,
            compression,
            compressed_size,
            ..
        } = header;
        if !compression.is_empty() {
            return Err(RecordError::Compressed {
                offset: self.offset,
                compression,
            });
        }
        // Start and end time, size, checksum, compression name (empty) and compressed size precede
        // the data.
        let data_start = 8 + 8 + 8 + 4 + 4 + 8;
        let data = usize::try_from(compressed_size)
            .ok()
            .and_then(|size| self.body.get(data_start..)?.get(..size))
            .ok_or_else(|| self.damaged("a chunk longer than its record"))?;
        if uncompressed_crc != 0 && crc32fast::hash(data) != uncompressed_crc {
            return Err(self.damaged("the checksum of the chunk is wrong"));
        }
        Ok(Records::new(data, self.offset_of(data_start)))
    }

    /// Returns channel, log time and data of a message, and the offset of the data in the file.
    pub(crate) fn message(&self) -> Result<(u16, u64, usize, &'a [u8]), RecordError> {
        let mut reader = Reader(self.body);
        let read = |reader: &mut Reader<'a>| {
            let channel = reader.u16()?;
            reader.take(4)?; // sequence
            let log_time = reader.u64()?;
            reader.take(8)?; // publish time
            Some((channel, log_time))
        };
        let (channel, log_time) =
            read(&mut reader).ok_or_else(|| self.damaged("a message without a header"))?;
        let data_start = self.body.len() - reader.0.len();
        Ok((channel, log_time, self.offset_of(data_start), reader.0))
    }

    /// Returns name and content of an attachment, and the offset of the content in the file.
    pub(crate) fn attachment(&self) -> Result<(String, usize, &'a [u8]), RecordError> {
        let mut reader = Reader(self.body);
        let read = |reader: &mut Reader<'a>| {
            reader.take(16)?; // log time, time of creation
            let name = reader.string()?;
            reader.string()?; // media type
            let len = usize::try_from(reader.u64()?).ok()?;
            let data_start = self.body.len() - reader.0.len();
            let data = reader.take(len)?;
            let checksum = reader.u32()?;
            Some((name, data_start, data, checksum))
        };
        let (name, data_start, data, checksum) = read(&mut reader)
            .ok_or_else(|| self.damaged("an attachment longer than its record"))?;
        if checksum != 0 && crc32fast::hash(&self.body[..data_start + data.len()]) != checksum {
            return Err(self.damaged("the checksum of the attachment is wrong"));
        }
        Ok((name, self.offset_of(data_start), data))
    }
}

/// Reader of successive little-endian numbers; `None` past the end.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*taken)
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn string(&mut self) -> Option<String> {
        let len = usize::try_from(self.u32()?).ok()?;
        String::from_utf8(self.take(len)?.to_vec()).ok()
    }
}

/// Formats an error with all its causes in one line.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        text.push_str(": ");
        text.push_str(&inner.to_string());
        cause = inner.source();
    }
    text
}
