//! Errors of the import of logs: what is wrong, where, and the remedy.

use std::fmt;
use std::io;

use thiserror::Error;
use twinrig_document::{suggestion, visible};

use crate::RecordError;

/// Error of the import of a log: file, place and fault. The remedy is shown as a line of its own.
#[derive(Debug)]
pub struct LogError {
    /// Name of the file as passed by the caller.
    pub file: String,
    /// Place in the file; none if the fault concerns the file as a whole.
    pub place: Option<LogPlace>,
    /// The fault.
    pub fault: Box<LogFault>,
}

/// Place in a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogPlace {
    /// Line of text, counted from 1; none in binary files.
    pub line: Option<u64>,
    /// Row or message, counted from 1; none outside of rows.
    pub row: Option<u64>,
}

impl LogError {
    pub(super) fn new(file: &str, place: Option<LogPlace>, fault: LogFault) -> Self {
        Self {
            file: file.to_owned(),
            place,
            fault: Box::new(fault),
        }
    }
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}\n --> {}", self.fault, visible(&self.file))?;
        if let Some(place) = self.place {
            if let Some(line) = place.line {
                write!(f, ":{line}")?;
            }
            if let Some(row) = place.row {
                write!(f, " (row {row})")?;
            }
        }
        let help = self.fault.help();
        if help.is_empty() {
            Ok(())
        } else {
            write!(f, "\n  = help: {help}")
        }
    }
}

impl std::error::Error for LogError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        std::error::Error::source(self.fault.as_ref())
    }
}

/// What is wrong with a log, or with its mapping.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogFault {
    /// The file cannot be read.
    #[error("the log cannot be read: {0}")]
    Read(#[source] io::Error),
    /// The format follows neither from the mapping nor from the name of the file.
    #[error("the format of the log is not known")]
    UnknownFormat,
    /// The columns of a mapping do not suit the format.
    #[error("the mapping has {mapping}, and the log is {format}")]
    OtherFormat {
        /// What the mapping has.
        mapping: &'static str,
        /// The format of the log.
        format: &'static str,
    },
    /// A bag in the format of `SQLite`.
    #[error("the bag is an SQLite database, which is not read")]
    Sqlite,
    /// A folder that is not a bag, or a bag with invalid metadata.
    #[error("the folder is not a bag of rosbag2: {why}")]
    Bag {
        /// Reason.
        why: String,
    },
    /// The log is longer than the bound, after decompression.
    #[error("the log is longer than {} MB, decompressed", most / 1_000_000)]
    TooLong {
        /// The bound \[bytes\].
        most: u64,
    },
    /// More numbers than the bound are selected.
    #[error("the mapping selects more than {most} numbers of the log")]
    TooManyValues {
        /// The bound.
        most: u64,
    },
    /// The compressed data end in the middle.
    #[error("the compressed log is truncated")]
    TruncatedGzip,
    /// The compressed data are damaged.
    #[error("the compressed log is damaged: {0}")]
    Gzip(#[source] io::Error),
    /// The text ends in the middle of a value.
    #[error("the log is truncated: it ends in the middle of {within}")]
    Truncated {
        /// Element that is not complete.
        within: &'static str,
    },
    /// The text is not of its format.
    #[error("the log is not {format}: {why}")]
    Syntax {
        /// The format.
        format: &'static str,
        /// Reason.
        why: String,
    },
    /// There is no row.
    #[error("the log has no rows")]
    NoRows,
    /// Rows were read, but in none of them all signals had a value.
    #[error("no row has a value of each signal: `{column}` never has one")]
    NoCompleteRow {
        /// A column without values.
        column: String,
    },
    /// The list of the rows is not there.
    #[error("the log has no list `{key}`")]
    NoList {
        /// Key of the mapping.
        key: String,
        /// Keys of the log.
        known: Vec<String>,
    },
    /// A column of the mapping is not there.
    #[error("the log has no column `{column}`")]
    MissingColumn {
        /// Name in the mapping.
        column: String,
        /// Columns of the log.
        known: Vec<String>,
    },
    /// A topic of the mapping is not there.
    #[error("the log has no topic `{topic}`")]
    MissingTopic {
        /// Name in the mapping.
        topic: String,
        /// Topics of the log.
        known: Vec<String>,
    },
    /// A topic has no messages.
    #[error("the log has no messages of `{topic}`")]
    NoMessages {
        /// Topic.
        topic: String,
    },
    /// A field of the mapping is not in the messages of its topic.
    #[error("messages of `{topic}` have no field `{field}`")]
    MissingField {
        /// Topic.
        topic: String,
        /// Path of the field in the mapping.
        field: String,
        /// Fields at the place where it is missed.
        known: Vec<String>,
    },
    /// A column has no value in a row.
    #[error("`{column}` has no value")]
    MissingValue {
        /// Name of the column.
        column: String,
    },
    /// A number is infinite or NaN.
    #[error("`{column}` is {value}, which is not a finite number")]
    NotFinite {
        /// Name of the column.
        column: String,
        /// The number.
        value: f64,
    },
    /// A value is not a number.
    #[error("`{column}` is {found}; expected {expected}")]
    WrongType {
        /// Name of the column.
        column: String,
        /// Description of the value.
        found: String,
        /// Description of the accepted values.
        expected: &'static str,
    },
    /// A number is not a word of its size.
    #[error("`{column}` is {value}, which is not a word of {bits} bits")]
    NotAWord {
        /// Name of the column.
        column: String,
        /// The number.
        value: f64,
        /// Bits of the word.
        bits: u32,
    },
    /// The time of a row is before that of the row above.
    #[error("time goes back by {} s, from {} s to {} s",
        seconds(before.saturating_sub(*time)), seconds(*before), seconds(*time))]
    TimeGoesBack {
        /// Time of the row above \[ns\].
        before: i64,
        /// Time of the row \[ns\].
        time: i64,
    },
    /// The time of a row is that of the row above.
    #[error("two rows have the time {} s", seconds(*time))]
    SameTime {
        /// Time of both \[ns\].
        time: i64,
    },
    /// A time is not within the range of a clock.
    #[error("the time `{value}` is out of range")]
    TimeRange {
        /// The time as written.
        value: String,
    },
    /// A constant of the file has two values.
    #[error("`{column}` is `{first}` at first, and then `{other}`: a setting is one value")]
    NotConstant {
        /// Name of the column.
        column: String,
        /// First value.
        first: String,
        /// Other value.
        other: String,
    },
    /// A row has too few or too many fields.
    #[error("the row has {found} fields, and the header {expected}")]
    RowLength {
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// Chunks of an MCAP file are compressed.
    #[error("the messages are compressed with `{compression}`")]
    Compressed {
        /// Name of the compression.
        compression: String,
    },
    /// An MCAP file is damaged.
    #[error("{0}")]
    Mcap(#[source] RecordError),
    /// Messages whose encoding is not read.
    #[error("messages of `{topic}` are encoded as `{encoding}` with the schema `{schema}`")]
    Encoding {
        /// Topic.
        topic: String,
        /// Encoding of the messages.
        encoding: String,
        /// Encoding of the schema.
        schema: String,
    },
    /// A definition of messages that cannot be parsed.
    #[error("the definition of the messages of `{topic}` is not valid: {why}")]
    Definition {
        /// Topic.
        topic: String,
        /// Reason.
        why: String,
    },
    /// A message that is not of its type.
    #[error("a message of `{topic}` cannot be decoded: {why}")]
    Message {
        /// Topic.
        topic: String,
        /// Reason.
        why: String,
    },
}

fn seconds(nanos: i64) -> f64 {
    nanos as f64 / 1e9
}

impl LogFault {
    /// Returns the remedy; empty if there is none but another file.
    pub fn help(&self) -> String {
        match self {
            Self::NoList { key, known } => suggestion(key, "keys of the log", texts(known)),
            Self::MissingColumn { column, known } => {
                let near = suggestion(column, "columns of the log", texts(known));
                format!("{near}; `optional = true` leaves a signal out where it is missing")
            }
            Self::MissingTopic { topic, known } => {
                suggestion(topic, "topics of the log", texts(known))
            }
            Self::MissingField { field, known, .. } => {
                let last = field.rsplit('.').next().unwrap_or(field);
                suggestion(last, "fields there", texts(known))
            }
            other => other.fixed_help().to_owned(),
        }
    }

    fn fixed_help(&self) -> &'static str {
        match self {
            Self::UnknownFormat => {
                "files end in .json, .jsonl, .csv, .tsv or .mcap, also with .gz, or are folders of \
                 rosbag2; for others add `format = \"json\"` to the mapping"
            }
            Self::OtherFormat { .. } => {
                "a signal has a `column` of JSON or CSV, or a `topic` and a `field` of MCAP"
            }
            Self::Sqlite => {
                "convert it: `ros2 bag convert -i BAG -o convert.yaml`, with `output_bags: \
                 [{uri: OUT, storage_id: mcap, all: true}]` in convert.yaml"
            }
            Self::Bag { .. } => "a bag is a folder with metadata.yaml and files that end in .mcap",
            Self::TooLong { .. } | Self::TooManyValues { .. } => {
                "split the log, or select fewer columns"
            }
            Self::TruncatedGzip | Self::Gzip(_) => "`gzip --test FILE` checks it; copy it anew",
            Self::Truncated { .. } => "copy it anew, or end it by hand after the last complete row",
            Self::NoRows => "`rows` in the mapping names the list of the rows",
            Self::NoCompleteRow { .. } => {
                "`optional = true` leaves out a signal whose column is not there"
            }
            Self::MissingValue { .. } => "`missing = \"hold\"` repeats the value of the row above",
            Self::NotFinite { value, .. } if value.is_nan() => {
                "`missing = \"hold\"` repeats the value of the row above"
            }
            Self::NotFinite { .. } => "repair the row; an infinite number is never imported",
            Self::WrongType { .. } => {
                "numbers have a decimal point and no other separators; true and false are 1 and 0"
            }
            Self::NotAWord { .. } => "`word` is for integers that a program did not sign",
            Self::TimeGoesBack { .. } => {
                "a clock was set, or rows are out of order: sort them, or split the log there"
            }
            Self::SameTime { .. } => {
                "the clock is too coarse, or the row is there twice: remove one, or take another \
                 column of time"
            }
            Self::TimeRange { .. } => "check the `unit` of the time: s, ms, us or ns",
            Self::NotConstant { .. } => "split the log where the value changes",
            Self::RowLength { .. } => {
                "a field with a separator in it is written in double quotes; a file that is \
                 being written may end in a part of a row"
            }
            Self::Compressed { .. } => {
                "make a copy without compression: `mcap decompress IN.mcap -o OUT.mcap`, or \
                 `mcap filter IN.mcap -o OUT.mcap -y TOPIC --output-compression none`"
            }
            Self::Encoding { .. } => "messages are read in JSON, and in CDR with `ros2msg` schemas",
            _ => "",
        }
    }
}

fn texts(names: &[String]) -> impl Iterator<Item = &str> {
    names.iter().map(String::as_str)
}
