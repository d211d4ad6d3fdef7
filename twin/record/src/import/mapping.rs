//! Mappings: which columns of a log become which signals.

mod contents;
mod read;
mod tables;

pub use contents::{
    LogColumn, LogFormat, LogGroup, LogMapping, LogNote, LogOrigin, LogSetting, LogSignal,
    MissingValues, NoteText,
};
