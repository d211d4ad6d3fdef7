//! Command `twin import log`: recordings of logs of other programs.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use twinrig_record::{ImportedLog, LogLimits, LogMapping, RecordError, import_log};
use twinrig_rig::error::Error;

use super::log_summary::LogSummary;
use super::mappings;
use super::refusal::not_written;
use crate::args::ImportLogArgs;
use crate::commands::{FAILURE, SUCCESS, Terminal};
use crate::error::TwinError;

/// Folder of recordings.
const RECORDINGS: &str = "recordings";

/// Result of one log.
#[derive(Serialize)]
#[serde(untagged)]
enum Outcome {
    Written(Box<LogSummary>),
    Failed { file: String, error: String },
}

pub(super) fn import(args: &ImportLogArgs, terminal: &mut Terminal<'_>) -> u8 {
    let mapping = match mappings::find(args.mapping.as_deref()) {
        Ok(mapping) => mapping,
        Err(error) => {
            terminal.report_error(&error, args.json);
            return FAILURE;
        }
    };
    let mut code = SUCCESS;
    let mut outcomes = Vec::new();
    for (index, file) in args.files.iter().enumerate() {
        match imported(file, args, &mapping) {
            Ok(summary) if args.json => outcomes.push(Outcome::Written(Box::new(summary))),
            Ok(summary) => {
                if index > 0 {
                    terminal.print("");
                }
                terminal.print(&summary.text());
            }
            Err(error) => {
                code = FAILURE;
                if args.json {
                    let (file, error) = (file.display().to_string(), error.to_string());
                    outcomes.push(Outcome::Failed { file, error });
                } else {
                    terminal.print_error(&error);
                }
            }
        }
    }
    if args.json {
        terminal.print_json(&outcomes);
    }
    code
}

fn imported(
    file: &Path,
    args: &ImportLogArgs,
    mapping: &LogMapping,
) -> Result<LogSummary, TwinError> {
    let path = place(file, args)?;
    // A long log is not read in vain.
    if path.exists() {
        return Err(not_written(&path, ErrorKind::AlreadyExists.into()));
    }
    let log = import_log(file, mapping, LogLimits::default())?;
    write_new(&path, &log)?;
    Ok(LogSummary::of(&log, file, &path))
}

/// Returns the path of the recording of a log.
fn place(file: &Path, args: &ImportLogArgs) -> Result<PathBuf, TwinError> {
    let folder = match &args.out {
        None => Path::new(RECORDINGS),
        Some(out) if is_folder(out) => out.as_path(),
        Some(out) if args.files.len() == 1 => return Ok(out.clone()),
        Some(out) => {
            return Err(TwinError::from(Error::InvalidOptions {
                why: format!("{} is one file, for several logs", out.display()),
                help: "give a folder with --out, as in --out recordings/".to_owned(),
            }));
        }
    };
    Ok(folder.join(format!("{}.mcap", stem(file))))
}

/// Whether a path is that of a folder, which need not exist.
fn is_folder(path: &Path) -> bool {
    path.is_dir() || path.as_os_str().to_string_lossy().ends_with('/')
}

/// Returns the name of a log without its extensions.
fn stem(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str());
    let mut path = Path::new(name);
    let is = |path: &Path, extension: &str| path.extension() == Some(OsStr::new(extension));
    if is(path, "gz") {
        path = Path::new(path.file_stem().unwrap_or(name));
    }
    let known = ["json", "jsonl", "ndjson", "csv", "tsv", "txt", "mcap"];
    if known.iter().any(|extension| is(path, extension)) {
        path = Path::new(path.file_stem().unwrap_or(name));
    }
    path.to_string_lossy().into_owned()
}

/// Writes a recording to a file that must not exist.
fn write_new(path: &Path, log: &ImportedLog) -> Result<(), TwinError> {
    let created = || -> io::Result<File> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        OpenOptions::new().write(true).create_new(true).open(path)
    };
    let file = created().map_err(|source| not_written(path, source))?;
    let build = concat!("twinrig ", env!("CARGO_PKG_VERSION"));
    let written = log.write(BufWriter::new(file), build);
    let written = written.and_then(|mut file| file.flush().map_err(RecordError::from));
    written.map_err(|source| {
        // It is not complete.
        let _ = fs::remove_file(path);
        let path = path.to_owned();
        TwinError::from(Error::Record { path, source })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recording_has_the_name_of_the_log() {
        for (file, name) in [
            ("logs/m0.535-kp8.json.gz", "m0.535-kp8"),
            ("a.csv", "a"),
            ("bag", "bag"),
            ("run.1", "run.1"),
            ("x.mcap", "x"),
        ] {
            assert_eq!(stem(Path::new(file)), name);
        }
    }

    #[test]
    fn several_logs_take_a_folder() {
        let of = |files: &[&str], out: Option<&str>| {
            let args = ImportLogArgs {
                files: files.iter().map(Into::into).collect(),
                mapping: None,
                out: out.map(Into::into),
                json: false,
            };
            place(Path::new(files[0]), &args).ok()
        };
        let path = |path: &str| Some(PathBuf::from(path));
        assert_eq!(of(&["a.csv"], None), path("recordings/a.mcap"));
        assert_eq!(of(&["a.csv"], Some("b.mcap")), path("b.mcap"));
        assert_eq!(of(&["a.csv", "b.csv"], Some("out/")), path("out/a.mcap"));
        assert_eq!(of(&["a.csv", "b.csv"], Some("b.mcap")), None);
    }
}
