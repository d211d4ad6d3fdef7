//! Reading of MCAP files.

use std::ops::Range;
use std::path::Path;

use twinrig_document::read_file;
use twinrig_kernel::{SimTime, near_misses};

use crate::cdr::CdrReader;
use crate::index::{Encoding, Index, MessageEntry, SampledGroup, Wire};
use crate::{FrameSeries, Message, RecordError, Signal, Topic};

/// A recording in memory.
///
/// A truncated file is read up to its last complete record; see [`Recording::is_complete`].
#[derive(Debug, Clone)]
pub struct Recording {
    bytes: Vec<u8>,
    index: Index,
}

/// One sample of a group.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
    /// Time of the sample.
    pub time: SimTime,
    bytes: &'a [u8],
}

/// All samples of one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Description of the signal.
    pub signal: Signal,
    /// Times of the samples.
    pub times: Vec<SimTime>,
    /// Values: `signal.size` components per sample, sample by sample.
    pub values: Vec<f64>,
}

impl Recording {
    /// Reads the file at `path`; if it is not a regular file, at most
    /// [`twinrig_document::STREAM_MOST`] bytes.
    ///
    /// # Errors
    /// The file cannot be read, memory is insufficient, it is not MCAP, or it is damaged other than
    /// by truncation.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let bytes = read_file(path, u64::MAX).map_err(|source| RecordError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::from_bytes(bytes)
    }

    /// Reads a recording from memory.
    ///
    /// # Errors
    /// The bytes are not MCAP, or damaged other than by truncation.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, RecordError> {
        let index = Index::of(&bytes)?;
        Ok(Self { bytes, index })
    }

    /// Whether the file was closed properly; otherwise the run was interrupted.
    pub fn is_complete(&self) -> bool {
        self.index.complete
    }

    /// Groups of signals, in the order of declaration.
    pub fn groups(&self) -> &[SampledGroup] {
        &self.index.groups
    }

    /// Returns the group named `name`.
    pub fn group(&self, name: &str) -> Option<&SampledGroup> {
        self.index.groups.iter().find(|group| group.name == name)
    }

    /// Returns the samples of `group`, which must belong to this recording, in order of time.
    pub fn samples<'a>(
        &'a self,
        group: &'a SampledGroup,
    ) -> impl ExactSizeIterator<Item = Sample<'a>> {
        group.samples.iter().map(|&(time, start)| {
            // The index refers to these bytes; a group of another recording yields empty samples.
            let bytes = self
                .bytes
                .get(start..start + 8 * group.width)
                .unwrap_or_default();
            Sample { time, bytes }
        })
    }

    /// Returns the names of the byte traces, in the order of declaration.
    pub fn traces(&self) -> impl Iterator<Item = &str> {
        self.index.wires.iter().map(|wire| wire.name.as_str())
    }

    /// Returns the bytes of the trace named `name`, in order of time; none of an unknown one.
    pub fn bytes(&self, name: &str) -> impl Iterator<Item = (SimTime, &[u8])> {
        let wire = self.wire(name);
        wire.into_iter().flat_map(|wire| self.pieces(wire))
    }

    /// Wires whose bytes are recorded, in the order of declaration.
    pub(crate) fn wires(&self) -> &[Wire] {
        &self.index.wires
    }

    /// Returns the wire named `name`.
    pub(crate) fn wire(&self, name: &str) -> Option<&Wire> {
        self.index.wires.iter().find(|wire| wire.name == name)
    }

    /// Returns the bytes transmitted on `wire`, which must belong to this recording, in order of
    /// time.
    pub(crate) fn pieces<'a>(
        &'a self,
        wire: &'a Wire,
    ) -> impl Iterator<Item = (SimTime, &'a [u8])> {
        let pieces = wire.pieces.iter();
        pieces.map(|(time, range)| (*time, self.bytes.get(range.clone()).unwrap_or_default()))
    }

    /// Time of the last sample of any group; `None` if there are no samples.
    pub fn last_sample(&self) -> Option<SimTime> {
        let groups = self.index.groups.iter();
        groups
            .filter_map(|group| group.samples.last().map(|&(time, _)| time))
            .max()
    }

    /// Returns all samples of the first signal named `name`, searching the groups in order.
    ///
    /// # Errors
    /// [`RecordError::UnknownSignal`] with the nearest recorded name.
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

    /// Returns all messages of the topic of `M`, with their times.
    ///
    /// # Errors
    /// [`RecordError::Decode`] for the first message that is not an `M`.
    pub fn messages<M: Message>(&self) -> Result<Vec<(SimTime, M)>, RecordError> {
        let written = self.index.messages.get(&M::TOPIC);
        let written = written.map_or(&[][..], Vec::as_slice);
        let read = |(index, written): (usize, &MessageEntry)| {
            let bytes = &self.bytes[written.range.clone()];
            let message = match written.encoding {
                Encoding::Cdr => of_cdr(bytes).ok_or_else(|| "invalid CDR".to_owned()),
                Encoding::Json => serde_json::from_slice(bytes).map_err(|error| error.to_string()),
            };
            let message = message.map_err(|why| RecordError::Decode {
                topic: M::TOPIC.name(),
                index,
                why,
            })?;
            Ok((written.time, message))
        };
        written.iter().enumerate().map(read).collect()
    }

    /// Returns the coordinate frames over time; none are recorded with `[record] frames = "0 Hz"`.
    ///
    /// # Errors
    /// [`RecordError::Decode`] for the first message that is not a set of the same frames.
    pub fn frames(&self) -> Result<FrameSeries, RecordError> {
        let written = self.index.messages.get(&Topic::Frames);
        let written = written.map_or(&[][..], Vec::as_slice);
        let mut series = FrameSeries::default();
        for (index, entry) in written.iter().enumerate() {
            let added = series.add(entry.time, &self.bytes[entry.range.clone()]);
            added.ok_or_else(|| RecordError::Decode {
                topic: Topic::Frames.name(),
                index,
                why: "invalid CDR, or other frames than before".to_owned(),
            })?;
        }
        Ok(series)
    }

    /// Input files of the run, with their names.
    pub fn attachments(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.index
            .attachments
            .iter()
            .map(|(name, range)| (name.as_str(), &self.bytes[range.clone()]))
    }

    /// Returns the attachment named `name`.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments()
            .find_map(|(other, text)| (other == name).then_some(text))
    }

    /// Returns the metadata of the run under `key`: `seed`, `build` and notes of the caller.
    pub fn note(&self, key: &str) -> Option<&str> {
        self.index.metadata.get("run")?.get(key).map(String::as_str)
    }

    /// All metadata of the run.
    pub fn notes(&self) -> impl Iterator<Item = (&str, &str)> {
        let run = self.index.metadata.get("run").into_iter().flatten();
        run.map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// Seed of the run.
    pub fn seed(&self) -> Option<u64> {
        self.note("seed")?.parse().ok()
    }

    /// Fingerprint of the run, if it completed.
    pub fn fingerprint(&self) -> Option<&str> {
        self.index
            .metadata
            .get("result")?
            .get("fingerprint")
            .map(String::as_str)
    }

    /// Simulated time reached by the run, if it completed.
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

impl<'a> Sample<'a> {
    /// Returns the values in `range`; components outside the sample are omitted.
    pub fn values(&self, range: Range<usize>) -> impl Iterator<Item = f64> + use<'a> {
        let bytes = self.bytes;
        range.map_while(move |component| {
            let raw = bytes.get(component.checked_mul(8)?..)?.first_chunk::<8>()?;
            Some(f64::from_bits(u64::from_le_bytes(*raw)))
        })
    }

    /// Returns all values.
    pub fn all(&self) -> impl Iterator<Item = f64> + use<'a> {
        self.values(0..self.bytes.len() / 8)
    }
}

/// Decodes a message that occupies all of `bytes`.
fn of_cdr<M: Message>(bytes: &[u8]) -> Option<M> {
    let mut reader = CdrReader::new(bytes)?;
    let message = M::read(&mut reader)?;
    reader.is_at_end().then_some(message)
}
