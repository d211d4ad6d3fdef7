//! Summary at the end of a file: schemas, channels, statistics and indexes.

use std::io::Write;

use mcap::records::op;

use super::encoding::{put, put_bytes, record};
use super::{McapWriter, count, put_schema};

impl<W: Write> McapWriter<W> {
    /// Returns the summary, with the footer and the magic bytes.
    pub(super) fn summary(&self) -> Vec<u8> {
        let (mut bytes, mut offsets) = (Vec::new(), Vec::new());
        let mut group = |opcode: u8, records: &[u8]| {
            if records.is_empty() {
                return;
            }
            record(&mut offsets, op::SUMMARY_OFFSET, |to| {
                to.push(opcode);
                put(to, (self.position + bytes.len() as u64).to_le_bytes());
                put(to, (records.len() as u64).to_le_bytes());
            });
            bytes.extend(records);
        };
        let mut schemas = Vec::new();
        for index in 0..self.schemas.len() {
            put_schema(&mut schemas, index, &self.schemas);
        }
        group(op::SCHEMA, &schemas);
        let mut channels = Vec::new();
        for channel in &self.channels {
            record(&mut channels, op::CHANNEL, |to| to.extend(&channel.content));
        }
        group(op::CHANNEL, &channels);
        group(op::STATISTICS, &self.statistics());
        group(op::CHUNK_INDEX, &self.chunk_indexes.bytes);
        group(op::ATTACHMENT_INDEX, &self.attachment_indexes.bytes);
        group(op::METADATA_INDEX, &self.metadata_indexes.bytes);

        let offsets_start = self.position + bytes.len() as u64;
        bytes.extend(offsets);
        record(&mut bytes, op::FOOTER, |to| {
            put(to, self.position.to_le_bytes());
            put(to, offsets_start.to_le_bytes());
            put(to, [0; 4]);
        });
        // The checksum covers the summary and the beginning of the footer.
        let checked = bytes.len() - 4;
        let checksum = crc32fast::hash(&bytes[..checked]);
        bytes[checked..].copy_from_slice(&checksum.to_le_bytes());
        bytes.extend(mcap::MAGIC);
        bytes
    }

    fn statistics(&self) -> Vec<u8> {
        let mut counts = Vec::new();
        for (id, channel) in (1_u16..).zip(&self.channels) {
            if channel.messages > 0 {
                put(&mut counts, id.to_le_bytes());
                put(&mut counts, channel.messages.to_le_bytes());
            }
        }
        let messages: u64 = self.channels.iter().map(|channel| channel.messages).sum();
        let [first, last] = self.times.unwrap_or_default();
        let mut bytes = Vec::new();
        record(&mut bytes, op::STATISTICS, |to| {
            put(to, messages.to_le_bytes());
            put(to, count(self.schemas.len()).to_le_bytes());
            put(to, u32::from(count(self.channels.len())).to_le_bytes());
            put(to, self.attachment_indexes.records.to_le_bytes());
            put(to, self.metadata_indexes.records.to_le_bytes());
            put(to, self.chunk_indexes.records.to_le_bytes());
            put(to, first.to_le_bytes());
            put(to, last.to_le_bytes());
            put_bytes(to, &counts);
        });
        bytes
    }
}
