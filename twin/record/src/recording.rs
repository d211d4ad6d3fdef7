//! The reading side: an MCAP file becomes signals, messages and files again.

use std::ops::Range;
use std::path::Path;

use twinrig_document::read_file;
use twinrig_kernel::{SimTime, near_misses};

use crate::cdr::CdrReader;
use crate::index::{Encoding, Index, Wire, Written};
use crate::{Message, RecordError, Signal};

/// A recording in memory.
///
/// A file that ends in the middle is read up to its last whole record; [`Recording::is_complete`] tells.
#[derive(Debug, Clone)]
pub struct Recording {
    bytes: Vec<u8>,
    index: Index,
}

/// Signals that were sampled together.
#[derive(Debug, Clone)]
pub struct SampledGroup {
    /// Its name, `plant`.
    pub name: String,
    /// Its signals, in the order in which their values follow one another.
    pub signals: Vec<Signal>,
    /// Number of values of a sample.
    pub(crate) width: usize,
    /// When each sample was taken, and where in the file its values start.
    pub(crate) samples: Vec<(SimTime, usize)>,
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
        let index = Index::of(&bytes)?;
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

    /// The wires whose bytes are recorded, in the order in which they were declared.
    pub(crate) fn wires(&self) -> &[Wire] {
        &self.index.wires
    }

    /// The wire of that name.
    pub(crate) fn wire(&self, name: &str) -> Option<&Wire> {
        self.index.wires.iter().find(|wire| wire.name == name)
    }

    /// What passed on `wire`, which must be one of this recording, in order of time.
    pub(crate) fn pieces<'a>(
        &'a self,
        wire: &'a Wire,
    ) -> impl Iterator<Item = (SimTime, &'a [u8])> {
        let pieces = wire.pieces.iter();
        pieces.map(|(time, range)| (*time, self.bytes.get(range.clone()).unwrap_or_default()))
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

    /// All messages of the topic of `M`, with the time at which they were written.
    ///
    /// # Errors
    /// [`RecordError::Decode`] for the first one that is no `M`.
    pub fn messages<M: Message>(&self) -> Result<Vec<(SimTime, M)>, RecordError> {
        let written = self.index.messages.get(&M::TOPIC);
        let written = written.map_or(&[][..], Vec::as_slice);
        let read = |(index, written): (usize, &Written)| {
            let bytes = &self.bytes[written.range.clone()];
            let message = match written.encoding {
                Encoding::Cdr => of_cdr(bytes).ok_or_else(|| "it is cut off".to_owned()),
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

/// A message that is whole, and nothing behind it.
fn of_cdr<M: Message>(bytes: &[u8]) -> Option<M> {
    let mut reader = CdrReader::new(bytes)?;
    let message = M::read(&mut reader)?;
    reader.is_at_end().then_some(message)
}
