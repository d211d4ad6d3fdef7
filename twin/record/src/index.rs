//! Index of the contents of a recording within its file.

use std::collections::BTreeMap;
use std::ops::Range;

use mcap::records::{Channel, Record, op};
use twinrig_kernel::SimTime;

use crate::cdr::{self, CdrReader};
use crate::framing::{RawRecord, Records};
use crate::schema::{GROUP_KEY, SIGNALS_KEY, TRACE_KEY};
use crate::{EPOCH, RecordError, Signal, Topic};

/// A group of signals that were sampled together.
#[derive(Debug, Clone)]
pub struct SampledGroup {
    /// Name of the group, e.g. `plant`.
    pub name: String,
    /// Signals, in the order of their values in a sample.
    pub signals: Vec<Signal>,
    /// Number of values per sample.
    pub(crate) width: usize,
    /// Time of each sample and offset of its values in the file.
    pub(crate) samples: Vec<(SimTime, usize)>,
}

impl SampledGroup {
    /// Returns the signal named `name` and the range of its components in a sample.
    pub fn find(&self, name: &str) -> Option<(&Signal, Range<usize>)> {
        let mut start = 0;
        for signal in &self.signals {
            let end = start + signal.size;
            if signal.name == name {
                return Some((signal, start..end));
            }
            start = end;
        }
        None
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}

/// Contents of a file, record by record.
#[derive(Debug, Clone, Default)]
pub(crate) struct Index {
    pub complete: bool,
    pub groups: Vec<SampledGroup>,
    pub wires: Vec<Wire>,
    pub messages: BTreeMap<Topic, Vec<MessageEntry>>,
    pub attachments: Vec<(String, Range<usize>)>,
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    channels: BTreeMap<u16, ChannelRole>,
}

/// Bytes transmitted on a wire in one direction.
#[derive(Debug, Clone)]
pub(crate) struct Wire {
    /// Name of the wire in the run.
    pub name: String,
    /// Time of each piece, and its range in the file.
    pub pieces: Vec<(SimTime, Range<usize>)>,
}

/// A message: log time, encoding and range in the file.
#[derive(Debug, Clone)]
pub(crate) struct MessageEntry {
    pub time: SimTime,
    pub encoding: Encoding,
    pub range: Range<usize>,
}

/// Encoding of messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Encoding {
    Cdr,
    /// Used by earlier builds.
    Json,
}

/// Role of a channel.
#[derive(Debug, Clone, Copy)]
enum ChannelRole {
    Group(usize),
    Messages(Topic, Encoding),
    /// Bytes on a wire, one piece per message.
    Wire(usize),
    /// Bytes on a wire without encoding, as written by earlier builds.
    RawWire(usize),
    Unknown,
}

impl Index {
    /// Indexes `bytes` up to the first incomplete record.
    pub(crate) fn of(bytes: &[u8]) -> Result<Self, RecordError> {
        let mut index = Self::default();
        let body = bytes
            .strip_prefix(mcap::MAGIC)
            .ok_or(RecordError::NotMcap)?;
        let mut records = Records::new(body, mcap::MAGIC.len());
        for record in records.by_ref() {
            match record.opcode {
                op::DATA_END => {}
                op::FOOTER => {
                    index.complete = true;
                    break;
                }
                op::CHUNK => {
                    let mut inside = record.chunk()?;
                    for inner in inside.by_ref() {
                        index.take(&inner)?;
                    }
                    if !inside.rest().is_empty() {
                        return Err(record.damaged("the chunk ends in the middle of a record"));
                    }
                }
                _ => index.take(&record)?,
            }
        }
        index.complete &= records.rest() == mcap::MAGIC;
        Ok(index)
    }

    fn take(&mut self, record: &RawRecord<'_>) -> Result<(), RecordError> {
        match record.opcode {
            op::CHANNEL => {
                if let Record::Channel(channel) = record.parse()? {
                    self.take_channel(&channel)?;
                }
            }
            op::MESSAGE => self.take_message(record)?,
            op::ATTACHMENT => {
                let (name, start, data) = record.attachment()?;
                self.attachments.push((name, start..start + data.len()));
            }
            op::METADATA => {
                if let Record::Metadata(metadata) = record.parse()? {
                    self.metadata
                        .entry(metadata.name)
                        .or_default()
                        .extend(metadata.metadata);
                }
            }
            // Schemas are for other readers; this one uses the metadata of the channels.
            _ => {}
        }
        Ok(())
    }

    fn take_channel(&mut self, channel: &Channel) -> Result<(), RecordError> {
        if self.channels.contains_key(&channel.id) {
            return Ok(()); // repeated in the summary section
        }
        let encoding = channel.message_encoding.as_str();
        let role = if let Some(signals) = channel.metadata.get(SIGNALS_KEY) {
            self.groups.push(group(channel, signals)?);
            ChannelRole::Group(self.groups.len() - 1)
        } else if let Some(trace) = channel.metadata.get(TRACE_KEY) {
            ChannelRole::Wire(self.add_wire(trace))
        } else if let ("bytes", Some(trace)) = (encoding, channel.topic.strip_prefix("/wire/")) {
            ChannelRole::RawWire(self.add_wire(trace))
        } else {
            match (Topic::of_channel(&channel.topic), encoding) {
                (Some(topic), "cdr") => ChannelRole::Messages(topic, Encoding::Cdr),
                (Some(topic), "json") => ChannelRole::Messages(topic, Encoding::Json),
                _ => ChannelRole::Unknown,
            }
        };
        self.channels.insert(channel.id, role);
        Ok(())
    }

    fn add_wire(&mut self, name: &str) -> usize {
        let name = name.to_owned();
        let pieces = Vec::new();
        self.wires.push(Wire { name, pieces });
        self.wires.len() - 1
    }

    fn take_message(&mut self, record: &RawRecord<'_>) -> Result<(), RecordError> {
        let (channel, log_time, start, data) = record.message()?;
        let role = *self
            .channels
            .get(&channel)
            .ok_or_else(|| record.damaged("a message on an undeclared channel"))?;
        if matches!(role, ChannelRole::Unknown) {
            return Ok(());
        }
        let nanos = log_time
            .checked_sub(EPOCH.as_nanos())
            .ok_or_else(|| record.damaged("a message from before the start of the run"))?;
        let time = SimTime::from_nanos(nanos);
        let range = start..start + data.len();
        match role {
            ChannelRole::Group(group) => {
                let group = &mut self.groups[group];
                if data.len() != cdr::HEADER.len() + 8 * group.width
                    || !data.starts_with(&cdr::HEADER)
                {
                    return Err(record.damaged(format!(
                        "a sample of `{}` with the wrong length",
                        group.name
                    )));
                }
                group.samples.push((time, start + cdr::HEADER.len()));
            }
            ChannelRole::Messages(topic, encoding) => {
                self.messages.entry(topic).or_default().push(MessageEntry {
                    time,
                    encoding,
                    range,
                });
            }
            ChannelRole::Wire(wire) => {
                let length =
                    octets(data).ok_or_else(|| record.damaged("truncated bytes of a wire"))?;
                // They are at the end of the message.
                let range = range.end - length..range.end;
                self.wires[wire].pieces.push((time, range));
            }
            ChannelRole::RawWire(wire) => self.wires[wire].pieces.push((time, range)),
            ChannelRole::Unknown => {}
        }
        Ok(())
    }
}

/// Creates the group of signals of a channel.
fn group(channel: &Channel, signals: &str) -> Result<SampledGroup, RecordError> {
    let foreign = |why: String| RecordError::Foreign {
        channel: channel.topic.clone(),
        why,
    };
    let signals: Vec<Signal> =
        serde_json::from_str(signals).map_err(|error| foreign(error.to_string()))?;
    let width = signals
        .iter()
        .try_fold(0_usize, |sum, signal| sum.checked_add(signal.size))
        .filter(|&width| width <= usize::MAX / 16)
        .ok_or_else(|| foreign("its signals are too large".to_owned()))?;
    // Earlier builds named the channel after the group.
    let name = channel.metadata.get(GROUP_KEY).map(String::as_str);
    let name = name.unwrap_or(channel.topic.trim_start_matches('/'));
    Ok(SampledGroup {
        name: name.to_owned(),
        signals,
        width,
        samples: Vec::new(),
    })
}

/// Returns the number of bytes in a message that contains a single byte sequence.
fn octets(message: &[u8]) -> Option<usize> {
    let mut reader = CdrReader::new(message)?;
    let octets = reader.octets()?;
    reader.is_at_end().then_some(octets.len())
}
