//! Command `twin fit`: parameters of a twin from recordings.

use std::path::{Path, PathBuf};

use twinrig_experiment::{FitOutcome, FitProgress, FitRequest, fit as execute, fit_page};
use twinrig_rig::registry::Registry;

use super::{FAILURE, SUCCESS, Terminal, outputs, settings};
use crate::args::FitArgs;
use crate::date::{now, timestamp};
use crate::error::TwinError;
use crate::progress::{Progress, bar};

/// Folder of the results of all fits.
const FOLDER: &str = "fits";
/// Folder of the searches that are done, beside the results.
const SEARCHES: &str = "searches";

pub(super) fn fit(registry: &Registry, args: &FitArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    match run(registry, args, terminal) {
        Ok((outcome, files)) => {
            for note in &outcome.notes {
                terminal.note(note);
            }
            if args.json {
                terminal.print_json(&outcome);
            } else {
                terminal.print(&outcome.text());
                let files: Vec<_> = files.iter().map(|it| it.display().to_string()).collect();
                terminal.print(&format!("  files        {}", files.join(", ")));
            }
            SUCCESS
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn run(
    registry: &Registry,
    args: &FitArgs,
    terminal: &mut Terminal<'_>,
) -> Result<(FitOutcome, Vec<PathBuf>), TwinError> {
    let out = args.out.clone().unwrap_or_else(|| folder(&args.space));
    outputs::check_folder(&out)?;
    let request = FitRequest {
        recordings: args.recordings.clone(),
        validate: args.validate.clone(),
        space: args.space.clone(),
        settings: settings(&args.settings),
        cross_validate: args.cross_validate,
        profile: args.profile,
        store: Some(out.join(SEARCHES)),
        threads: args
            .jobs
            .or_else(|| std::thread::available_parallelism().ok())
            .map_or(1, Into::into),
    };
    let title = args.space.file_stem().unwrap_or_default().to_string_lossy();
    let mut line = Progress::new(&title, terminal.interactive && !args.json);
    let outcome = execute(registry, &request, &mut |progress| {
        line.show(|title, _| progress_line(title, &progress));
        true
    });
    drop(line);
    let outcome = outcome?;
    std::fs::create_dir_all(&out).map_err(|source| {
        TwinError::from(twinrig_rig::error::Error::Write {
            path: out.clone(),
            source,
        })
    })?;
    let json = serde_json::to_string_pretty(&outcome).unwrap_or_default() + "\n";
    let date = timestamp(now());
    let day = date.split('T').next().unwrap_or_default();
    // A name may have characters that a file may not have.
    let overlay = format!("{title}.fit.toml");
    let files = [
        ("fit.json", json),
        (overlay.as_str(), outcome.overlay(day)),
        ("report.html", fit_page(&outcome).html()),
    ];
    let mut written = Vec::new();
    for (name, text) in files {
        let path = out.join(name);
        outputs::write_whole(&path, text.as_bytes())?;
        written.push(path);
    }
    Ok((outcome, written))
}

fn progress_line(title: &str, progress: &FitProgress) -> String {
    let FitProgress {
        fits,
        of,
        done,
        is_solving,
        cost,
    } = progress;
    let bar = bar(*fits as f64 / *of as f64);
    let what = if *is_solving { "step" } else { "generation" };
    format!(
        "{title}  {bar}  search {} of {of}  {what} {done}  cost {cost:.4}",
        fits + 1
    )
}

/// Returns the folder of the results of a search space.
fn folder(space: &Path) -> PathBuf {
    Path::new(FOLDER).join(space.file_stem().unwrap_or_default())
}
