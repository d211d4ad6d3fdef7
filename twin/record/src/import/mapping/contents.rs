//! Contents of a mapping.

use twinrig_document::declaration::Words;
use twinrig_document::{Placed, WrittenUnit};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Group;

use crate::import::signal::Conversion;

/// Format of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogFormat {
    /// A list of rows under a key or at the top, or a row in each line.
    Json,
    /// A table of text with a header.
    Csv,
    /// Messages of topics.
    Mcap,
    /// A folder of MCAP files with metadata.
    Rosbag2,
}

impl Words for LogFormat {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("json", Self::Json),
        ("csv", Self::Csv),
        ("mcap", Self::Mcap),
        ("rosbag2", Self::Rosbag2),
    ];
}

impl LogFormat {
    /// Returns the word of a mapping.
    pub fn word(self) -> &'static str {
        let word = Self::WORDS.iter().find(|(_, format)| *format == self);
        word.map_or("", |(word, _)| word)
    }

    /// Whether the log consists of messages of topics.
    pub(crate) fn has_topics(self) -> bool {
        matches!(self, Self::Mcap | Self::Rosbag2)
    }
}

/// Beginning of the times of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogOrigin {
    /// As `Keep` if the log begins within its first hour, otherwise as `First`.
    Auto,
    /// Times are kept.
    Keep,
    /// The whole second at or before the first sample is 0.
    First,
}

impl Words for LogOrigin {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("auto", Self::Auto),
        ("keep", Self::Keep),
        ("first", Self::First),
    ];
}

/// What becomes of a row without a value of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissingValues {
    /// It is an error.
    Error,
    /// The value of the row above is repeated, and counted.
    Hold,
}

impl Words for MissingValues {
    const WORDS: &'static [(&'static str, Self)] = &[("error", Self::Error), ("hold", Self::Hold)];
}

/// Whether a signal was measured or commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogGroup {
    /// Measured: a signal of the plant.
    Measured,
    /// Commanded: an output of the process.
    Commanded,
}

impl Words for LogGroup {
    const WORDS: &'static [(&'static str, Self)] =
        &[("measured", Self::Measured), ("commanded", Self::Commanded)];
}

impl LogGroup {
    /// Both groups, in the order of a recording.
    pub const ALL: [Self; 2] = [Self::Measured, Self::Commanded];

    /// Returns the word of a mapping.
    pub fn word(self) -> &'static str {
        let word = Self::WORDS.iter().find(|(_, group)| *group == self);
        word.map_or("", |(word, _)| word)
    }

    /// Returns the group of a recording.
    pub fn group(self) -> Group {
        match self {
            Self::Measured => Group::Plant,
            Self::Commanded => Group::ProcessOutputs,
        }
    }
}

/// Place of a value in a log: a column, or a field of the messages of a topic.
#[derive(Debug, Clone, PartialEq)]
pub struct LogColumn {
    /// Topic; none in formats with columns.
    pub topic: Option<String>,
    /// Name of a column, or path of a field.
    pub path: Placed<String>,
}

impl LogColumn {
    /// Returns the name in messages.
    pub fn name(&self) -> String {
        match &self.topic {
            None => self.path.value.clone(),
            Some(topic) => format!("{topic} {}", self.path.value),
        }
    }
}

/// A signal of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSignal {
    /// Its path in the recording.
    pub name: Placed<String>,
    /// Its place in the log.
    pub column: LogColumn,
    /// Conversion of its numbers.
    pub conversion: Conversion,
    /// Its group in the recording.
    pub group: LogGroup,
    /// Rows without a value.
    pub missing: MissingValues,
    /// Whether the column may be absent.
    pub is_optional: bool,
}

/// A constant of a log that is a setting of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSetting {
    /// Dotted key of a scenario or a file.
    pub key: Placed<String>,
    /// Name of the constant.
    pub column: String,
    /// Unit of a number; none for other values and plain numbers.
    pub unit: Option<WrittenUnit>,
    /// Whether the constant may be absent.
    pub is_optional: bool,
}

/// A remark of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct LogNote {
    /// Its name.
    pub name: Placed<String>,
    /// Name of a constant of the log, which may be absent, or the remark itself.
    pub text: NoteText,
}

/// Text of a remark.
#[derive(Debug, Clone, PartialEq)]
pub enum NoteText {
    /// A constant of the log.
    Column(String),
    /// This text.
    Text(String),
}

/// Mapping of a log: its format, its time and its signals.
#[derive(Debug, Clone, PartialEq)]
pub struct LogMapping {
    /// Name of the file.
    pub file: String,
    /// Its text, which is attached to recordings.
    pub text: String,
    /// Format; none: by the name of the log.
    pub format: Option<LogFormat>,
    /// Path of the list of the rows; none: the list at the top, or a row in each line.
    pub rows: Option<String>,
    /// Column of the time; none: the time at which messages were logged.
    pub time: Option<String>,
    /// Unit of the time.
    pub time_unit: WrittenUnit,
    /// Beginning of the times.
    pub origin: LogOrigin,
    /// Longest interval between two rows that is not a gap; none: ten times the median.
    pub gap: Option<SimDuration>,
    /// Signals; at least one.
    pub signals: Vec<LogSignal>,
    /// Constants that are settings.
    pub settings: Vec<LogSetting>,
    /// Remarks.
    pub notes: Vec<LogNote>,
}

impl LogMapping {
    /// Whether the signals are fields of messages.
    pub(crate) fn has_topics(&self) -> bool {
        self.signals
            .iter()
            .any(|signal| signal.column.topic.is_some())
    }

    /// Names of the constants of a log that are read: of settings, then of remarks.
    pub(crate) fn constants(&self) -> impl Iterator<Item = &str> {
        let settings = self.settings.iter().map(|setting| setting.column.as_str());
        let notes = self.notes.iter().filter_map(|note| match &note.text {
            NoteText::Column(column) => Some(column.as_str()),
            NoteText::Text(_) => None,
        });
        settings.chain(notes)
    }
}
