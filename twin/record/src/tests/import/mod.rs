//! Logs of other programs as recordings.

mod faults;
mod logs;
mod memory;
mod rows;
mod topics;

use twinrig_document::Document;
use twinrig_record::{ImportedLog, LogError, LogLimits, LogMapping, Recording, import_log_from};

/// Reads a mapping.
pub fn mapping(text: &str) -> LogMapping {
    let document = Document::parse("mapping.toml", text).unwrap();
    LogMapping::read(&document).unwrap_or_else(|error| panic!("{error}"))
}

/// Imports a log that is called `file`.
pub fn import(file: &str, log: &[u8], mapping: &LogMapping) -> Result<ImportedLog, LogError> {
    import_log_from(file, log, mapping, LogLimits::default())
}

/// Returns the recording of a log.
pub fn recorded(log: &ImportedLog) -> Recording {
    let bytes = log.write(Vec::new(), "test").unwrap();
    let recording = Recording::from_bytes(bytes).unwrap();
    assert!(recording.is_complete());
    recording
}

/// Returns times \[ns\] and values of a signal of a recording.
pub fn series(recording: &Recording, name: &str) -> (Vec<u64>, Vec<f64>) {
    let series = recording.series(name).unwrap();
    let times = series.times.iter().map(|time| time.as_nanos());
    (times.collect(), series.values)
}
