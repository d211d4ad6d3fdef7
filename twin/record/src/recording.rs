//! The reading side: an MCAP file becomes signals, messages and files again.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use mcap::records::{Record, op};
use serde::de::DeserializeOwned;
use twinrig_document::read_file;
use twinrig_kernel::{SimTime, near_misses};

use crate::framing::{RawRecord, Records};
use crate::schema::CDR_HEADER;
use crate::{EPOCH, RecordError, Signal, Topic};

/// A recording in memory.
///
/// A file that ends in the middle is read up to its last whole record; [`Recording::is_complete`] tells.
#[derive(Debug, Clone)]
pub struct Recording {
    bytes: Vec<u8>,
    index: Index,
}

#[derive(Debug, Clone, Default)]
struct Index {
    complete: bool,
    groups: Vec<SampledGroup>,
    texts: BTreeMap<Topic, Vec<(SimTime, Range<usize>)>>,
    attachments: Vec<(String, Range<usize>)>,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    channels: BTreeMap<u16, Use>,
}

/// What a channel is to us.
#[derive(Debug, Clone, Copy)]
enum Use {
    Group(usize),
    Text(Topic),
    Unknown,
}

/// Signals that were sampled together.
#[derive(Debug, Clone)]
pub struct SampledGroup {
    /// Its name, `plant`.
    pub name: String,
    /// Its signals, in the order in which their values follow one another.
    pub signals: Vec<Signal>,
    /// Number of values of a sample.
    width: usize,
    /// When each sample was taken, and where in the file its values start.
    samples: Vec<(SimTime, usize)>,
}

/// One sample of a group.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
    /// When it was taken.
    pub time: SimTime,
    bytes: &'a [u8],
}

/// All samples of one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The signal.
    pub signal: Signal,
    /// When it was sampled.
    pub times: Vec<SimTime>,
    /// Its values: `signal.size` components a sample, one sample after the other.
    pub values: Vec<f64>,
}

impl Recording {
    /// Reads the file at `path`: of one that is no regular file, no more than [`twinrig_document::STREAM_MOST`].
    ///
    /// # Errors
    /// A file that cannot be read, for which there is no memory, is no MCAP, or is damaged other than by being cut off.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let bytes = read_file(path, u64::MAX).map_err(|source| RecordError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::from_bytes(bytes)
    }

    /// Reads a recording that is in memory already.
    ///
    /// # Errors
    /// Bytes that are no MCAP, or damaged other than by being cut off.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, RecordError> {
        let mut index = Index::default();
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
        Ok(Self { bytes, index })
    }

    /// Whether the file was closed properly; if not, the run was cut off.
    pub fn is_complete(&self) -> bool {
        self.index.complete
    }

    /// The groups of signals, in the order in which they were declared.
    pub fn groups(&self) -> &[SampledGroup] {
        &self.index.groups
    }

    /// The group of that name.
    pub fn group(&self, name: &str) -> Option<&SampledGroup> {
        self.index.groups.iter().find(|group| group.name == name)
    }

    /// The samples of `group`, which must be one of this recording, in order of time.
    pub fn samples<'a>(
        &'a self,
        group: &'a SampledGroup,
    ) -> impl ExactSizeIterator<Item = Sample<'a>> {
        group.samples.iter().map(|&(time, start)| {
            // The index was made for these bytes; those of another recording give an empty sample.
            let bytes = self
                .bytes
                .get(start..start + 8 * group.width)
                .unwrap_or_default();
            Sample { time, bytes }
        })
    }

    /// The time of the last sample that it holds, of whatever group; none if it holds none.
    pub fn last_sample(&self) -> Option<SimTime> {
        let groups = self.index.groups.iter();
        groups
            .filter_map(|group| group.samples.last().map(|&(time, _)| time))
            .max()
    }

    /// All samples of the first signal called `name`, looking through the groups in order.
    ///
    /// # Errors
    /// [`RecordError::UnknownSignal`] with the nearest name there is.
    pub fn series(&self, name: &str) -> Result<Series, RecordError> {
        let found = self
            .index
            .groups
            .iter()
            .find_map(|group| Some((group, group.find(name)?)));
        let Some((group, (signal, range))) = found else {
            let names = self
                .index
                .groups
                .iter()
                .flat_map(|group| &group.signals)
                .map(|signal| signal.name.as_str());
            let nearest = near_misses(name, names)
                .first()
                .map(|&near| near.to_owned());
            return Err(RecordError::UnknownSignal {
                name: name.to_owned(),
                nearest,
            });
        };
        let mut series = Series {
            signal: signal.clone(),
            times: Vec::new(),
            values: Vec::new(),
        };
        for sample in self.samples(group) {
            series.times.push(sample.time);
            series.values.extend(sample.values(range.clone()));
        }
        Ok(series)
    }

    /// The messages of `topic`, read as `T`, with the time at which they were written.
    ///
    /// # Errors
    /// [`RecordError::Decode`] for the first one that is no `T`.
    pub fn messages<T: DeserializeOwned>(
        &self,
        topic: Topic,
    ) -> Result<Vec<(SimTime, T)>, RecordError> {
        let texts = self.index.texts.get(&topic).map_or(&[][..], Vec::as_slice);
        let read = |(index, (time, range)): (usize, &(SimTime, Range<usize>))| {
            let message = serde_json::from_slice(&self.bytes[range.clone()]).map_err(|source| {
                RecordError::Decode {
                    topic: topic.name(),
                    index,
                    source,
                }
            })?;
            Ok((*time, message))
        };
        texts.iter().enumerate().map(read).collect()
    }

    /// The files the run was made from, with their names.
    pub fn attachments(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.index
            .attachments
            .iter()
            .map(|(name, range)| (name.as_str(), &self.bytes[range.clone()]))
    }

    /// The file of that name.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments()
            .find_map(|(other, text)| (other == name).then_some(text))
    }

    /// What is noted under `key` about the run: `seed`, `build`, and whatever else its maker noted.
    pub fn note(&self, key: &str) -> Option<&str> {
        self.index.metadata.get("run")?.get(key).map(String::as_str)
    }

    /// Everything that is noted about the run.
    pub fn notes(&self) -> impl Iterator<Item = (&str, &str)> {
        let run = self.index.metadata.get("run").into_iter().flatten();
        run.map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// The seed of the run.
    pub fn seed(&self) -> Option<u64> {
        self.note("seed")?.parse().ok()
    }

    /// The fingerprint of the run, if it came to its end.
    pub fn fingerprint(&self) -> Option<&str> {
        self.index
            .metadata
            .get("result")?
            .get("fingerprint")
            .map(String::as_str)
    }

    /// The simulated time the run reached, if it came to its end.
    pub fn reached(&self) -> Option<SimTime> {
        let nanos = self
            .index
            .metadata
            .get("result")?
            .get("simulated_ns")?
            .parse()
            .ok()?;
        Some(SimTime::from_nanos(nanos))
    }
}

impl SampledGroup {
    /// The signal called `name`, and where its components lie in a sample.
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

    /// The number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}

impl<'a> Sample<'a> {
    /// The values at `range` of the sample; what lies outside it is left out.
    pub fn values(&self, range: Range<usize>) -> impl Iterator<Item = f64> + use<'a> {
        let bytes = self.bytes;
        range.map_while(move |component| {
            let raw = bytes.get(component.checked_mul(8)?..)?.first_chunk::<8>()?;
            Some(f64::from_bits(u64::from_le_bytes(*raw)))
        })
    }

    /// All values.
    pub fn all(&self) -> impl Iterator<Item = f64> + use<'a> {
        self.values(0..self.bytes.len() / 8)
    }
}

impl Index {
    fn take(&mut self, record: &RawRecord<'_>) -> Result<(), RecordError> {
        match record.opcode {
            op::CHANNEL => self.take_channel(record),
            op::MESSAGE => self.take_message(record),
            op::ATTACHMENT => {
                let (name, start, data) = record.attachment()?;
                self.attachments.push((name, start..start + data.len()));
                Ok(())
            }
            op::METADATA => {
                if let Record::Metadata(metadata) = record.parse()? {
                    self.metadata
                        .entry(metadata.name)
                        .or_default()
                        .extend(metadata.metadata);
                }
                Ok(())
            }
            // Schemas are for other readers: ours are in the metadata of the channels.
            _ => Ok(()),
        }
    }

    fn take_channel(&mut self, record: &RawRecord<'_>) -> Result<(), RecordError> {
        let Record::Channel(channel) = record.parse()? else {
            return Ok(());
        };
        if self.channels.contains_key(&channel.id) {
            return Ok(()); // the summary says everything again
        }
        let text = Topic::ALL
            .into_iter()
            .find(|topic| topic.name() == channel.topic);
        let role = match (channel.metadata.get("signals"), text) {
            (Some(signals), _) => {
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
                let name = channel.topic.trim_start_matches('/').to_owned();
                self.groups.push(SampledGroup {
                    name,
                    signals,
                    width,
                    samples: Vec::new(),
                });
                Use::Group(self.groups.len() - 1)
            }
            (None, Some(topic)) if channel.message_encoding == "json" => Use::Text(topic),
            _ => Use::Unknown,
        };
        self.channels.insert(channel.id, role);
        Ok(())
    }

    fn take_message(&mut self, record: &RawRecord<'_>) -> Result<(), RecordError> {
        let (channel, log_time, start, data) = record.message()?;
        let role = *self
            .channels
            .get(&channel)
            .ok_or_else(|| record.damaged("a message on an undeclared channel"))?;
        if matches!(role, Use::Unknown) {
            return Ok(());
        }
        let nanos = log_time
            .checked_sub(EPOCH.as_nanos())
            .ok_or_else(|| record.damaged("a message from before the start of the run"))?;
        let time = SimTime::from_nanos(nanos);
        match role {
            Use::Group(group) => {
                let group = &mut self.groups[group];
                if data.len() != CDR_HEADER.len() + 8 * group.width
                    || data[..CDR_HEADER.len()] != CDR_HEADER
                {
                    return Err(record.damaged(format!(
                        "a sample of `{}` with the wrong length",
                        group.name
                    )));
                }
                group.samples.push((time, start + CDR_HEADER.len()));
            }
            Use::Text(topic) => self
                .texts
                .entry(topic)
                .or_default()
                .push((time, start..start + data.len())),
            Use::Unknown => {}
        }
        Ok(())
    }
}
