//! Settings of the execution of a scenario.

use std::path::PathBuf;

/// Settings of the execution of a scenario.
#[derive(Clone, Debug, Default)]
pub struct Execution {
    /// Path of the recording; none: no recording.
    pub recording: Option<PathBuf>,
    /// Devices of the buses by bus name, for a run on hardware; empty: boards and plant are
    /// simulated.
    pub ports: Vec<(String, PathBuf)>,
    /// Whether a run with warnings fails, such as that of a bus with errors.
    pub strict: bool,
}
