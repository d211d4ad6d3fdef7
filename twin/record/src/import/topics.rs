//! Messages of topics in MCAP files.

use std::collections::BTreeMap;
use std::rc::Rc;

use mcap::records::{Channel, Record, op};

use super::cell::Cell;
use super::collect::{Collected, Collector};
use super::error::{LogFault, LogPlace};
use super::input::Input;
use super::json::JsonReader;
use super::mapping::LogMapping;
use super::paths::{self, Receiver, Sought};
use super::ros::{Definition, FieldPath, NoField, field};
use crate::RecordError;
use crate::framing::{RawRecord, Records};

/// Longest chunk or message that is read \[bytes\].
const RECORD_MOST: u64 = 1 << 28;
/// Names that are kept for suggestions.
const NAMES_MOST: usize = 200;

/// A topic of the mapping.
struct Topic<'m> {
    name: &'m str,
    collector: Collector<'m>,
    sought: Vec<Sought>,
    /// Paths of the fields with their slots; none of JSON.
    fields: Vec<(Option<FieldPath>, usize)>,
    is_known: bool,
    is_optional: bool,
}

/// A channel of a file whose messages are read.
enum Decoder {
    Json,
    Cdr(Rc<Definition>),
}

/// Reader of the topics of a mapping.
pub(super) struct Topics<'m> {
    mapping: &'m LogMapping,
    sought: Vec<Topic<'m>>,
    names: Vec<String>,
    /// Message that is being read, for the place of a fault.
    message: Option<u64>,
    pub truncated_at: Option<u64>,
}

/// Channels and schemas of the present file.
#[derive(Default)]
struct Channels {
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    /// Topic and decoder; none of topics that are not sought.
    channels: BTreeMap<u16, Option<(usize, Decoder)>>,
}

impl<'m> Topics<'m> {
    /// Creates a reader of at most so many values.
    pub(super) fn new(mapping: &'m LogMapping, values_most: u64) -> Self {
        let mut names: Vec<&str> = Vec::new();
        for signal in &mapping.signals {
            names.extend(signal.column.topic.as_deref());
        }
        names.sort_unstable();
        names.dedup();
        let most = values_most / (names.len().max(1) as u64);
        let topic = |name: &'m str| {
            let is_of_topic = |topic: Option<&str>| topic == Some(name);
            let collector = Collector::new(
                mapping,
                |signal| is_of_topic(signal.column.topic.as_deref()),
                most,
            );
            let collector = match mapping.time {
                None => collector.sorting(),
                Some(_) => collector,
            };
            let mut sought = collector.sought();
            let constants = mapping.constants().count();
            sought.truncate(sought.len().saturating_sub(constants));
            let fields = sought
                .iter()
                .map(|one| (FieldPath::parse(&one.path), one.slot));
            let mut signals = mapping.signals.iter();
            Topic {
                name,
                fields: fields.collect(),
                sought,
                collector,
                is_known: false,
                is_optional: signals.all(|signal| {
                    signal.is_optional || !is_of_topic(signal.column.topic.as_deref())
                }),
            }
        };
        Self {
            mapping,
            sought: names.into_iter().map(topic).collect(),
            names: Vec::new(),
            message: None,
            truncated_at: None,
        }
    }

    /// Place of the message that is being read.
    pub(super) fn place(&self) -> Option<LogPlace> {
        self.message.map(|row| LogPlace {
            line: None,
            row: Some(row),
        })
    }

    /// Reads a file up to its end, or to its last complete record.
    pub(super) fn read(&mut self, input: &mut Input<'_>) -> Result<(), LogFault> {
        let mut body = Vec::new();
        if !input.take(mcap::MAGIC.len() as u64, &mut body)? || body != mcap::MAGIC {
            return Err(LogFault::Mcap(RecordError::NotMcap));
        }
        let mut channels = Channels::default();
        let mut offset = mcap::MAGIC.len() as u64;
        loop {
            if !input.take(9, &mut body)? {
                self.truncated_at = Some(offset);
                return Ok(());
            }
            let (opcode, length) = head(&body);
            let is_read = matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK);
            let place = usize::try_from(offset).unwrap_or(usize::MAX);
            let is_complete = if !is_read {
                input.pass(length)?
            } else if length > RECORD_MOST {
                let why = format!("a record is longer than {} MB", RECORD_MOST / 1_000_000);
                return Err(LogFault::Mcap(RecordError::Damaged { offset: place, why }));
            } else {
                input.take(length, &mut body)?
            };
            if !is_complete {
                self.truncated_at = Some(offset);
                return Ok(());
            }
            if opcode == op::DATA_END {
                // The summary repeats what was read.
                input.pass(u64::MAX)?;
                return Ok(());
            }
            if is_read {
                self.record(&mut channels, opcode, place, &body)?;
            }
            offset = offset.saturating_add(9).saturating_add(length);
        }
    }

    fn record(
        &mut self,
        channels: &mut Channels,
        opcode: u8,
        offset: usize,
        body: &[u8],
    ) -> Result<(), LogFault> {
        let record = RawRecord {
            offset,
            opcode,
            body,
        };
        if opcode != op::CHUNK {
            return self.plain(channels, &record);
        }
        let mut inside: Records<'_> = record.chunk().map_err(damaged)?;
        for inner in inside.by_ref() {
            self.plain(channels, &inner)?;
        }
        if inside.rest().is_empty() {
            return Ok(());
        }
        let error = record.damaged("the chunk ends in the middle of a record");
        Err(LogFault::Mcap(error))
    }

    fn plain(&mut self, channels: &mut Channels, record: &RawRecord<'_>) -> Result<(), LogFault> {
        match record.opcode {
            op::SCHEMA => {
                if let Record::Schema { header, data } = record.parse().map_err(damaged)? {
                    let schema = (header.name, header.encoding, data.into_owned());
                    channels.schemas.insert(header.id, schema);
                }
            }
            op::CHANNEL => {
                if let Record::Channel(channel) = record.parse().map_err(damaged)?
                    && !channels.channels.contains_key(&channel.id)
                {
                    let known = self.channel(channels, &channel)?;
                    channels.channels.insert(channel.id, known);
                }
            }
            op::MESSAGE => {
                let (channel, log_time, _, data) = record.message().map_err(damaged)?;
                match channels.channels.get(&channel) {
                    Some(Some((topic, decoder))) => {
                        let read = self.message(*topic, decoder, log_time, data);
                        read?;
                        self.message = None;
                    }
                    Some(None) => {}
                    None => {
                        let error = record.damaged("a message on an undeclared channel");
                        return Err(LogFault::Mcap(error));
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn channel(
        &mut self,
        channels: &Channels,
        channel: &Channel,
    ) -> Result<Option<(usize, Decoder)>, LogFault> {
        if self.names.len() < NAMES_MOST && !self.names.contains(&channel.topic) {
            self.names.push(channel.topic.clone());
        }
        let mut topics = self.sought.iter_mut().enumerate();
        let Some((index, topic)) = topics.find(|(_, topic)| topic.name == channel.topic) else {
            return Ok(None);
        };
        topic.is_known = true;
        let schema = channels.schemas.get(&channel.schema_id);
        let encoding = schema.map_or("", |(_, encoding, _)| encoding);
        let decoder = match (channel.message_encoding.as_str(), schema) {
            ("json", _) => Decoder::Json,
            ("cdr", Some((name, schema, data))) if schema == "ros2msg" => {
                let text = String::from_utf8_lossy(data);
                let definition = Definition::parse(name, &text);
                let topic = channel.topic.clone();
                let error = |why| LogFault::Definition { topic, why };
                Decoder::Cdr(Rc::new(definition.map_err(error)?))
            }
            _ => {
                return Err(LogFault::Encoding {
                    topic: channel.topic.clone(),
                    encoding: channel.message_encoding.clone(),
                    schema: encoding.to_owned(),
                });
            }
        };
        Ok(Some((index, decoder)))
    }

    fn message(
        &mut self,
        topic: usize,
        decoder: &Decoder,
        log_time: u64,
        data: &[u8],
    ) -> Result<(), LogFault> {
        let mapping = self.mapping;
        let Some(topic) = self.sought.get_mut(topic) else {
            return Ok(());
        };
        topic.collector.begin(None);
        self.message = Some(topic.collector.rows);
        if mapping.time.is_none() {
            topic.collector.set_time(Cell::Nanos(log_time.into()))?;
        }
        match decoder {
            Decoder::Json => {
                let mut input = Input::of_bytes(data);
                let mut reader = JsonReader::new(&mut input);
                paths::read(&mut reader, &topic.sought, &mut topic.collector)?;
            }
            Decoder::Cdr(definition) => topic.fields(mapping, definition, data)?,
        }
        topic.collector.end()
    }

    /// Returns what was collected of each topic.
    pub(super) fn finish(self) -> Result<Vec<Collected>, LogFault> {
        let mut all: Vec<Collected> = Vec::new();
        let mut absent = Vec::new();
        for topic in self.sought {
            let name = topic.name.to_owned();
            if topic.collector.rows == 0 && topic.is_optional {
                absent.extend(
                    topic
                        .sought
                        .into_iter()
                        .map(|one| format!("{name} {}", one.path)),
                );
            } else if !topic.is_known {
                let known = self.names;
                return Err(LogFault::MissingTopic { topic: name, known });
            } else if topic.collector.rows == 0 {
                return Err(LogFault::NoMessages { topic: name });
            } else {
                all.push(topic.collector.finish()?);
            }
        }
        match all.first_mut() {
            Some(first) => first.absent.extend(absent),
            None => return Err(LogFault::NoRows),
        }
        Ok(all)
    }
}

impl Topic<'_> {
    /// Reads the fields of a message in CDR.
    fn fields(
        &mut self,
        mapping: &LogMapping,
        definition: &Definition,
        data: &[u8],
    ) -> Result<(), LogFault> {
        let topic = || self.name.to_owned();
        for ((path, slot), sought) in self.fields.iter().zip(&self.sought) {
            let found = match path {
                Some(path) => field(definition, path, data),
                None => Err(NoField::Unknown(Vec::new())),
            };
            let signals = mapping.signals.iter();
            let mut signals = signals.filter(|one| one.column.topic.as_deref() == Some(self.name));
            let signal = slot.checked_sub(1).and_then(|index| signals.nth(index));
            let is_optional = signal.is_some_and(|signal| signal.is_optional);
            match found {
                Ok(cell) => self.collector.cell(*slot, cell)?,
                Err(NoField::Unknown(_)) if is_optional => {}
                Err(NoField::Unknown(known)) => {
                    return Err(LogFault::MissingField {
                        topic: topic(),
                        field: sought.path.clone(),
                        known,
                    });
                }
                Err(NoField::Short(why) | NoField::Unreadable(why)) => {
                    let topic = topic();
                    return Err(LogFault::Message { topic, why });
                }
                Err(NoField::Encoding) => {
                    let why = "it is not plain CDR".to_owned();
                    let topic = topic();
                    return Err(LogFault::Message { topic, why });
                }
            }
        }
        Ok(())
    }
}

/// Returns opcode and length of a record.
fn head(bytes: &[u8]) -> (u8, u64) {
    let length = bytes.get(1..).and_then(<[u8]>::first_chunk::<8>);
    let opcode = bytes.first().copied().unwrap_or_default();
    (
        opcode,
        length.map_or(0, |length| u64::from_le_bytes(*length)),
    )
}

fn damaged(error: RecordError) -> LogFault {
    match error {
        RecordError::Compressed { compression, .. } => LogFault::Compressed { compression },
        error => LogFault::Mcap(error),
    }
}
