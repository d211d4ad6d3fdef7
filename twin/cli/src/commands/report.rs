//! Command `twin report`: the page of a recorded run, or of two.

use std::path::{Path, PathBuf};

use serde::Serialize;
use twinrig_experiment::shell::quoted as shell;
use twinrig_view::{Page, Run, page, picture};

use super::diff::open;
use super::{FAILURE, SUCCESS, Terminal, outputs};
use crate::args::ReportArgs;
use crate::error::TwinError;
use crate::progress::RunLine;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

/// A written page, in its serialised form.
#[derive(Serialize)]
pub(super) struct Reported {
    page: String,
    bytes: usize,
    /// Path of the picture of the run at that instant, if it has one.
    picture: Option<String>,
    /// Instant at which the page opens.
    opened_at_s: f64,
    recordings: Vec<Shown>,
}

#[derive(Serialize)]
struct Shown {
    recording: String,
    /// Whether the page has all signals and bytes, by a repetition of the run.
    repeated: bool,
    /// Reason for which there is no repetition.
    why_not: Option<String>,
}

pub(super) fn report(registry: &Registry, args: &ReportArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    let path = args
        .out
        .clone()
        .unwrap_or_else(|| page_path(&args.recordings[0]));
    let progress = terminal.interactive && !args.json;
    match write_page(registry, &args.recordings, &path, progress) {
        Ok(reported) => {
            if args.json {
                terminal.print_json(&reported);
            } else {
                for shown in &reported.recordings {
                    if let Some(why) = &shown.why_not {
                        let recording = &shown.recording;
                        terminal.note(&format!("{recording} was not repeated: {why}"));
                    }
                }
                terminal.print(&format!("written {}", reported.page));
            }
            SUCCESS
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

/// Returns the path of the page of a recording.
pub(super) fn page_path(recording: &Path) -> PathBuf {
    recording.with_extension("html")
}

/// Writes the page of one or two recordings to `path`.
pub(super) fn write_page(
    registry: &Registry,
    recordings: &[PathBuf],
    path: &Path,
    progress: bool,
) -> Result<Reported, TwinError> {
    outputs::check_file(path)?;
    let runs = recordings.iter().map(|recording| {
        let recorded = open(recording)?;
        let mut line = RunLine::new(progress);
        let name = recording.display().to_string();
        Ok(Run::open(registry, &name, recorded, Some(&mut line)))
    });
    let runs: Vec<Run<'_>> = runs.collect::<Result<_, TwinError>>()?;
    let words = recordings.iter().map(|it| shell(&it.display().to_string()));
    let command = format!("twin report {}", words.collect::<Vec<_>>().join(" "));
    let made = page(&runs, &command).map_err(|source| Error::Record {
        path: recordings[0].clone(),
        source,
    });
    let Page { html, opened_at_s } = made?;
    std::fs::write(path, &html).map_err(|source| Error::Write {
        path: path.to_owned(),
        source,
    })?;
    let picture = runs.last().map(|run| picture(run, opened_at_s));
    let picture = picture.transpose().map_err(|source| Error::Record {
        path: recordings[0].clone(),
        source,
    });
    let picture = picture?.flatten().map(|svg| {
        let path = path.with_extension("svg");
        let written = std::fs::write(&path, svg);
        let written = written.map_err(|source| Error::Write {
            path: path.clone(),
            source,
        });
        written.map(|()| path.display().to_string())
    });
    let shown = runs.iter().map(|run| Shown {
        recording: run.path.clone(),
        repeated: run.is_repeated().is_ok(),
        why_not: run.is_repeated().err().map(str::to_owned),
    });
    Ok(Reported {
        page: path.display().to_string(),
        bytes: html.len(),
        picture: picture.transpose()?,
        opened_at_s,
        recordings: shown.collect(),
    })
}
