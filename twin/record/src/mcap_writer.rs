//! Writing of MCAP files without compression (<https://mcap.dev/spec>).
//!
//! The writer of the crate `mcap` passes each field of a message through three buffers and two
//! checksums. This one appends messages to a chunk in memory, which is checked and written at once.

mod encoding;
mod summary;

use std::collections::BTreeMap;
use std::io::{self, Write};

use crc32fast::Hasher;
use mcap::records::op;

use crate::sink::{ChannelId, Sink};

use self::encoding::{put, put_bytes, put_map, put_text, record};

/// Writer of one file. After an error nothing more is written.
pub(crate) struct McapWriter<W: Write> {
    /// None after an error and at the end.
    out: Option<W>,
    /// Number of bytes written, and their checksum.
    position: u64,
    checksum: Hasher,
    /// Records of the present chunk.
    chunk: Vec<u8>,
    chunk_times: Option<[u64; 2]>,
    /// Records of the schemas, without their numbers.
    schemas: Vec<Vec<u8>>,
    channels: Vec<Channel>,
    times: Option<[u64; 2]>,
    chunk_indexes: Section,
    attachment_indexes: Section,
    metadata_indexes: Section,
}

/// A channel and its messages.
struct Channel {
    /// Content of its record.
    content: Vec<u8>,
    messages: u64,
    /// Times and offsets of the messages in the present chunk.
    index: Vec<u8>,
}

/// Records of one kind.
#[derive(Default)]
struct Section {
    bytes: Vec<u8>,
    records: u32,
}

/// File that is stored in a recording.
pub(crate) struct Attachment<'a> {
    pub name: &'a str,
    pub media_type: &'a str,
    pub time: u64,
    pub data: &'a [u8],
}

impl<W: Write> McapWriter<W> {
    /// Starts a file.
    pub(crate) fn new(out: W, profile: &str, library: &str) -> io::Result<Self> {
        let mut writer = Self {
            out: Some(out),
            position: 0,
            checksum: Hasher::new(),
            chunk: Vec::new(),
            chunk_times: None,
            schemas: Vec::new(),
            channels: Vec::new(),
            times: None,
            chunk_indexes: Section::default(),
            attachment_indexes: Section::default(),
            metadata_indexes: Section::default(),
        };
        let mut start = mcap::MAGIC.to_vec();
        record(&mut start, op::HEADER, |to| {
            put_text(to, profile);
            put_text(to, library);
        });
        writer.write(&start)?;
        Ok(writer)
    }

    /// Returns the size of the present chunk \[bytes\].
    pub(crate) fn chunk_bytes(&self) -> usize {
        self.chunk.len()
    }

    /// Writes the present chunk, so that its contents survive a crash of the process.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.finish_chunk()?;
        self.out.as_mut().map_or(Ok(()), Write::flush)
    }

    /// Writes an attachment.
    pub(crate) fn attach(&mut self, attachment: &Attachment<'_>) -> io::Result<()> {
        self.finish_chunk()?;
        let Attachment {
            name,
            media_type,
            time,
            data,
        } = *attachment;
        let mut bytes = Vec::with_capacity(data.len() + 256);
        record(&mut bytes, op::ATTACHMENT, |to| {
            let start = to.len();
            put(to, time.to_le_bytes());
            put(to, time.to_le_bytes());
            put_text(to, name);
            put_text(to, media_type);
            put(to, (data.len() as u64).to_le_bytes());
            to.extend(data);
            let checksum = crc32fast::hash(&to[start..]);
            put(to, checksum.to_le_bytes());
        });
        self.attachment_indexes.add(op::ATTACHMENT_INDEX, |to| {
            put(to, self.position.to_le_bytes());
            put(to, (bytes.len() as u64).to_le_bytes());
            put(to, time.to_le_bytes());
            put(to, time.to_le_bytes());
            put(to, (data.len() as u64).to_le_bytes());
            put_text(to, name);
            put_text(to, media_type);
        });
        self.write(&bytes)
    }

    /// Writes metadata.
    pub(crate) fn metadata(
        &mut self,
        name: &str,
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<()> {
        self.finish_chunk()?;
        let mut bytes = Vec::new();
        record(&mut bytes, op::METADATA, |to| {
            put_text(to, name);
            put_map(to, metadata);
        });
        self.metadata_indexes.add(op::METADATA_INDEX, |to| {
            put(to, self.position.to_le_bytes());
            put(to, (bytes.len() as u64).to_le_bytes());
            put_text(to, name);
        });
        self.write(&bytes)
    }

    /// Writes the end of the file and returns the output.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.finish_file()?;
        let ended = || io::Error::other("an earlier write failed");
        self.out.take().ok_or_else(ended)
    }

    fn finish_file(&mut self) -> io::Result<()> {
        self.finish_chunk()?;
        let mut end = Vec::new();
        let checksum = self.checksum.clone().finalize();
        record(&mut end, op::DATA_END, |to| put(to, checksum.to_le_bytes()));
        self.write(&end)?;
        let summary = self.summary();
        self.write(&summary)?;
        self.out.as_mut().map_or(Ok(()), Write::flush)
    }

    fn finish_chunk(&mut self) -> io::Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        let mut content = Hasher::new();
        content.update(&self.chunk);
        let [first, last] = self.chunk_times.take().unwrap_or_default();
        let size = (self.chunk.len() as u64).to_le_bytes();
        let mut header = vec![op::CHUNK];
        put(
            &mut header,
            (CHUNK_HEADER + self.chunk.len() as u64).to_le_bytes(),
        );
        put(&mut header, first.to_le_bytes());
        put(&mut header, last.to_le_bytes());
        put(&mut header, size);
        put(&mut header, content.clone().finalize().to_le_bytes());
        put_text(&mut header, "");
        put(&mut header, size);
        let start = self.position;
        self.write(&header)?;
        // The checksum of the file follows from that of the chunk.
        self.checksum.combine(&content);
        let chunk = std::mem::take(&mut self.chunk);
        self.write_unchecked(&chunk)?;
        self.chunk = chunk;
        self.chunk.clear();
        let end = self.position;

        let (mut indexes, mut offsets) = (Vec::new(), Vec::new());
        for (id, channel) in (1_u16..).zip(&mut self.channels) {
            if channel.index.is_empty() {
                continue;
            }
            put(&mut offsets, id.to_le_bytes());
            put(&mut offsets, (end + indexes.len() as u64).to_le_bytes());
            record(&mut indexes, op::MESSAGE_INDEX, |to| {
                put(to, id.to_le_bytes());
                put_bytes(to, &channel.index);
            });
            channel.index.clear();
        }
        self.write(&indexes)?;
        if !offsets.is_empty() {
            let [earliest, latest] = self.times.unwrap_or([first, last]);
            self.times = Some([earliest.min(first), latest.max(last)]);
        }
        self.chunk_indexes.add(op::CHUNK_INDEX, |to| {
            put(to, first.to_le_bytes());
            put(to, last.to_le_bytes());
            put(to, start.to_le_bytes());
            put(to, (end - start).to_le_bytes());
            put_bytes(to, &offsets);
            put(to, (indexes.len() as u64).to_le_bytes());
            put_text(to, "");
            put(to, size);
            put(to, size);
        });
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.checksum.update(bytes);
        self.write_unchecked(bytes)
    }

    fn write_unchecked(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Some(out) = &mut self.out else {
            return Ok(());
        };
        let written = out.write_all(bytes);
        self.position += bytes.len() as u64;
        if written.is_err() {
            self.out = None;
        }
        written
    }
}

impl<W: Write> Sink for McapWriter<W> {
    fn add_channel(
        &mut self,
        topic: &str,
        message_encoding: &str,
        [message_type, schema_encoding, definition]: [&str; 3],
        metadata: &BTreeMap<String, String>,
    ) -> ChannelId {
        let mut schema = Vec::new();
        put_text(&mut schema, message_type);
        put_text(&mut schema, schema_encoding);
        put_text(&mut schema, definition);
        let known = self.schemas.iter().position(|known| *known == schema);
        let schema_index = known.unwrap_or_else(|| {
            self.schemas.push(schema);
            put_schema(&mut self.chunk, self.schemas.len() - 1, &self.schemas);
            self.schemas.len() - 1
        });
        let index = self.channels.len();
        let mut content = Vec::new();
        put(&mut content, id(index).to_le_bytes());
        put(&mut content, id(schema_index).to_le_bytes());
        put_text(&mut content, topic);
        put_text(&mut content, message_encoding);
        put_map(&mut content, metadata);
        record(&mut self.chunk, op::CHANNEL, |to| to.extend(&content));
        self.channels.push(Channel {
            content,
            messages: 0,
            index: Vec::new(),
        });
        ChannelId(index)
    }

    #[inline]
    fn message(
        &mut self,
        channel: ChannelId,
        time: u64,
        size: usize,
        fill: impl FnOnce(&mut [u8]),
    ) {
        let offset = self.chunk.len();
        let slot = &mut self.channels[channel.0];
        put(&mut slot.index, time.to_le_bytes());
        put(&mut slot.index, (offset as u64).to_le_bytes());
        #[expect(clippy::cast_possible_truncation, reason = "the sequence number wraps")]
        let sequence = slot.messages as u32;
        slot.messages += 1;
        let [first, last] = self.chunk_times.unwrap_or([time; 2]);
        self.chunk_times = Some([first.min(time), last.max(time)]);

        let mut header = [0; 9 + MESSAGE_HEADER];
        header[0] = op::MESSAGE;
        header[1..9].copy_from_slice(&((MESSAGE_HEADER + size) as u64).to_le_bytes());
        header[9..11].copy_from_slice(&id(channel.0).to_le_bytes());
        header[11..15].copy_from_slice(&sequence.to_le_bytes());
        header[15..23].copy_from_slice(&time.to_le_bytes());
        header[23..31].copy_from_slice(&time.to_le_bytes());
        self.chunk.extend_from_slice(&header);
        let start = self.chunk.len();
        self.chunk.resize(start + size, 0);
        fill(&mut self.chunk[start..]);
    }
}

impl<W: Write> Drop for McapWriter<W> {
    fn drop(&mut self) {
        if self.out.is_some() {
            let _ = self.finish_file();
        }
    }
}

impl Section {
    fn add(&mut self, opcode: u8, content: impl FnOnce(&mut Vec<u8>)) {
        record(&mut self.bytes, opcode, content);
        self.records += 1;
    }
}

/// Channel, sequence number, two times.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;
/// Two times, size, checksum, empty name of the compression, compressed size.
const CHUNK_HEADER: u64 = 8 + 8 + 8 + 4 + 4 + 8;

fn put_schema(to: &mut Vec<u8>, index: usize, schemas: &[Vec<u8>]) {
    record(to, op::SCHEMA, |to| {
        put(to, id(index).to_le_bytes());
        to.extend(&schemas[index]);
    });
}

/// Returns the number in the file of a schema or channel; 0 stands for no schema.
fn id(index: usize) -> u16 {
    count(index + 1)
}

/// Converts a number of schemas or channels, of which a recording has a few dozen.
fn count(number: usize) -> u16 {
    u16::try_from(number).expect("a recording has fewer than 2^16 schemas and channels")
}

#[cfg(test)]
mod tests;
