//! Logs of other programs as recordings.
//!
//! A [`LogMapping`] says which columns of a log become which signals; [`import_log`] reads the log,
//! and [`ImportedLog::write`] makes a recording of it, at the times of the log. Nothing is
//! resampled. Rows are read one after the other: of a long log only the selected columns are in
//! memory.

mod assemble;
mod bag;
mod cell;
mod collect;
mod constant;
mod csv;
mod error;
mod imported;
mod input;
mod json;
mod json_rows;
mod mapping;
mod paths;
mod ros;
mod signal;
mod stamp;
mod topics;

use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};

pub use error::{LogError, LogFault, LogPlace};
pub use imported::{
    ImportedGroup, ImportedLog, ImportedSignal, LogGap, LogPeriods, SETTING_PREFIX,
};
pub use mapping::{
    LogColumn, LogFormat, LogGroup, LogMapping, LogNote, LogOrigin, LogSetting, LogSignal,
    MissingValues, NoteText,
};
pub use signal::{Conversion, Ratio, Word};

use assemble::Constants;
use collect::{Collected, Collector};
use input::{Hash, Input};
use topics::Topics;

/// Bounds of an import.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogLimits {
    /// Greatest length of a log after decompression \[bytes\].
    pub bytes: u64,
    /// Greatest number of values that are kept, with the times.
    pub values: u64,
}

impl Default for LogLimits {
    /// 16 GB are read, and 100 million values are kept, which take 0.8 GB.
    fn default() -> Self {
        Self {
            bytes: 16_000_000_000,
            values: 100_000_000,
        }
    }
}

/// Reads the log at `path`.
///
/// # Errors
/// The log cannot be read, does not suit the mapping, or exceeds the limits.
pub fn import_log(
    path: &Path,
    mapping: &LogMapping,
    limits: LogLimits,
) -> Result<ImportedLog, LogError> {
    let file = path.display().to_string();
    let whole = |fault| LogError::new(&file, None, fault);
    let format = format_of(path, mapping).map_err(whole)?;
    let hash = Hash::default();
    let files = match format {
        LogFormat::Rosbag2 => bag::files(path).map_err(whole)?,
        _ => vec![path.to_owned()],
    };
    let open = |path: &PathBuf| {
        (
            path.display().to_string(),
            Input::open(path, &hash, limits.bytes),
        )
    };
    let inputs = files.iter().map(open);
    if format.has_topics() {
        return messages(&file, inputs, &hash, format, mapping, limits);
    }
    let input = Input::open(path, &hash, limits.bytes).map_err(whole)?;
    columns(&file, input, &hash, format, mapping, limits)
}

/// Reads a log that is not a file, which messages call `file`: JSON, CSV or MCAP.
///
/// # Errors
/// As [`import_log`].
pub fn import_log_from(
    file: &str,
    log: impl Read,
    mapping: &LogMapping,
    limits: LogLimits,
) -> Result<ImportedLog, LogError> {
    let whole = |fault| LogError::new(file, None, fault);
    let format = format_of(Path::new(file), mapping).map_err(whole)?;
    let hash = Hash::default();
    if format.has_topics() {
        let input = Input::new(log, &hash, limits.bytes);
        let inputs = std::iter::once((file.to_owned(), input));
        return messages(file, inputs, &hash, format, mapping, limits);
    }
    let input = Input::new(log, &hash, limits.bytes).map_err(whole)?;
    columns(file, input, &hash, format, mapping, limits)
}

/// Returns the format of a log: that of the mapping, otherwise by the name of the file.
fn format_of(path: &Path, mapping: &LogMapping) -> Result<LogFormat, LogFault> {
    let name = Path::new(path.file_name().unwrap_or_default());
    let extension = |name: &Path| name.extension().map(OsStr::to_ascii_lowercase);
    let mut found = extension(name);
    if found.as_deref() == Some(OsStr::new("gz")) {
        found = name.file_stem().and_then(|stem| extension(Path::new(stem)));
    }
    let found = found.as_deref().and_then(OsStr::to_str);
    let by_name = match found {
        Some("json" | "jsonl" | "ndjson") => Some(LogFormat::Json),
        Some("csv" | "tsv") => Some(LogFormat::Csv),
        Some("mcap") => Some(LogFormat::Mcap),
        Some("db3") => return Err(LogFault::Sqlite),
        _ if path.is_dir() => Some(LogFormat::Rosbag2),
        _ => None,
    };
    let format = mapping.format.or(by_name).ok_or(LogFault::UnknownFormat)?;
    if format.has_topics() != mapping.has_topics() {
        return Err(LogFault::OtherFormat {
            mapping: if mapping.has_topics() {
                "topics"
            } else {
                "columns"
            },
            format: format.word(),
        });
    }
    Ok(format)
}

/// Reads a log with columns.
fn columns(
    file: &str,
    mut input: Input<'_>,
    hash: &Hash,
    format: LogFormat,
    mapping: &LogMapping,
    limits: LogLimits,
) -> Result<ImportedLog, LogError> {
    let mut collector = Collector::new(mapping, |_| true, limits.values);
    let constants: Vec<&str> = mapping.constants().collect();
    let read = if format == LogFormat::Csv {
        csv::read(&mut input, &mut collector)
    } else {
        let rows = mapping.rows.as_deref();
        json_rows::read(&mut input, rows, &constants, &mut collector)
    };
    let error = |fault, place| LogError::new(file, place, fault);
    if let Err(fault) = read {
        let row = (collector.rows > 0).then_some(collector.rows);
        let line = match fault {
            // These are found at the end of a row, of which the first line is shown.
            LogFault::TimeGoesBack { .. }
            | LogFault::SameTime { .. }
            | LogFault::MissingValue { .. }
            | LogFault::RowLength { .. } => collector.row_line.unwrap_or(input.line),
            _ => input.line,
        };
        let place = LogPlace {
            line: Some(line),
            row,
        };
        return Err(error(fault, Some(place)));
    }
    let constants = Constants::of(&mut collector);
    let placed = |(fault, place)| error(fault, place);
    let settings = constants.settings(mapping).map_err(placed)?;
    let notes = constants.notes(mapping).map_err(placed)?;
    let collected = collector.finish().map_err(|fault| error(fault, None))?;
    let read = ReadLog {
        sources: vec![collected],
        settings,
        notes,
        truncated_at: None,
    };
    finished(file, hash, format, mapping, read).map_err(|fault| error(fault, None))
}

/// Reads a log with topics, of one file or several.
fn messages<'i>(
    file: &str,
    inputs: impl Iterator<Item = (String, Result<Input<'i>, LogFault>)>,
    hash: &Hash,
    format: LogFormat,
    mapping: &LogMapping,
    limits: LogLimits,
) -> Result<ImportedLog, LogError> {
    let mut topics = Topics::new(mapping, limits.values);
    for (file, input) in inputs {
        let read = input.and_then(|mut input| topics.read(&mut input));
        read.map_err(|fault| LogError::new(&file, topics.place(), fault))?;
    }
    let whole = |fault| LogError::new(file, None, fault);
    let truncated_at = topics.truncated_at;
    let notes = mapping.notes.iter().filter_map(|note| match &note.text {
        NoteText::Text(text) => Some((note.name.value.clone(), text.clone())),
        NoteText::Column(_) => None,
    });
    let read = ReadLog {
        sources: topics.finish().map_err(whole)?,
        settings: Vec::new(),
        notes: notes.collect(),
        truncated_at,
    };
    finished(file, hash, format, mapping, read).map_err(whole)
}

/// A log that was read to its end.
struct ReadLog {
    sources: Vec<Collected>,
    settings: Vec<(String, String)>,
    notes: Vec<(String, String)>,
    truncated_at: Option<u64>,
}

fn finished(
    file: &str,
    hash: &Hash,
    format: LogFormat,
    mapping: &LogMapping,
    read: ReadLog,
) -> Result<ImportedLog, LogFault> {
    let ReadLog {
        mut sources,
        settings,
        notes,
        truncated_at,
    } = read;
    let (rows, lost) = sources.iter().fold((0, 0), |(rows, lost), source| {
        (rows + source.rows, lost + source.left_out)
    });
    let held = sources
        .iter_mut()
        .flat_map(|source| std::mem::take(&mut source.held));
    let held = held.collect();
    let absent = sources
        .iter_mut()
        .flat_map(|source| std::mem::take(&mut source.absent));
    let absent = absent.collect();
    let origin_ns = assemble::origin(mapping, &sources);
    let (groups, left_out) = assemble::groups(mapping, sources, origin_ns)?;
    let name = |path: &str| {
        let name = Path::new(path).file_name();
        name.map_or_else(
            || path.to_owned(),
            |name| name.to_string_lossy().into_owned(),
        )
    };
    Ok(ImportedLog {
        file: name(file),
        hash: hash.borrow().finalize().to_hex().to_string(),
        format,
        mapping: (name(&mapping.file), mapping.text.clone()),
        origin_ns,
        rows,
        left_out: lost + left_out,
        held,
        absent,
        settings,
        notes,
        truncated_at,
        groups,
    })
}
