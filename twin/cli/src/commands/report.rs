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
        .unwrap_or_else(|| page_of(&args.recordings));
    let progress = terminal.interactive && !args.json;
    match write_page(registry, &args.recordings, false, &path, progress) {
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

/// Returns the path of the page of recordings: beside the first one.
fn page_of(recordings: &[PathBuf]) -> PathBuf {
    let stem = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    match recordings {
        [a, b] => a.with_file_name(format!("{}-and-{}.html", stem(a), stem(b))),
        all => page_path(&all[0]),
    }
}

/// Removes page and picture of an earlier run whose recording has been replaced.
pub(super) fn remove_page(recording: &Path) {
    let page = page_path(recording);
    for path in [page.with_extension("svg"), page] {
        // They may not exist.
        let _ = std::fs::remove_file(path);
    }
}

/// Returns the path of the page of a recording.
pub(super) fn page_path(recording: &Path) -> PathBuf {
    recording.with_extension("html")
}

/// Writes the page of one or two recordings to `path`; of two, the first may be the baseline of the
/// second (`against`).
pub(super) fn write_page(
    registry: &Registry,
    recordings: &[PathBuf],
    against: bool,
    path: &Path,
    progress: bool,
) -> Result<Reported, TwinError> {
    let picture_path = path.with_extension("svg");
    let refused = |why: &str| TwinError::Refused {
        path: path.to_owned(),
        why: why.to_owned(),
        help: "name another file by --out".to_owned(),
    };
    if recordings
        .iter()
        .any(|recording| outputs::is_same(recording, path))
    {
        return Err(refused("the page would replace the recording"));
    }
    if picture_path == path {
        return Err(refused("the picture of the run would replace the page"));
    }
    outputs::check_file(path)?;
    let runs = recordings.iter().map(|recording| {
        let recorded = open(recording)?;
        if recorded.last_sample().is_none() {
            return Err(TwinError::Refused {
                path: recording.clone(),
                why: "the recording has no samples: it was cut off, or its run did not start"
                    .to_owned(),
                help: "run the scenario again".to_owned(),
            });
        }
        let mut line = RunLine::new(progress);
        let name = recording.display().to_string();
        Ok(Run::open(registry, &name, recorded, Some(&mut line)))
    });
    let runs: Vec<Run<'_>> = runs.collect::<Result<_, TwinError>>()?;
    let words = recordings.iter().map(|it| shell(&it.display().to_string()));
    let command = format!("twin report {}", words.collect::<Vec<_>>().join(" "));
    let made = page(&runs, against, &command).map_err(|source| Error::Record {
        path: recordings[0].clone(),
        source,
    });
    let Page { html, opened_at_s } = made?;
    outputs::write_whole(path, html.as_bytes())?;
    let picture = runs.last().map(|run| picture(run, opened_at_s));
    let picture = picture.transpose().map_err(|source| Error::Record {
        path: recordings[0].clone(),
        source,
    });
    let picture = picture?.flatten();
    if let Some(svg) = &picture {
        outputs::write_whole(&picture_path, svg.as_bytes())?;
    }
    let shown = runs.iter().map(|run| Shown {
        recording: run.path.clone(),
        repeated: run.is_repeated().is_ok(),
        why_not: run.is_repeated().err().map(str::to_owned),
    });
    Ok(Reported {
        page: path.display().to_string(),
        bytes: html.len(),
        picture: picture.map(|_| picture_path.display().to_string()),
        opened_at_s,
        recordings: shown.collect(),
    })
}
