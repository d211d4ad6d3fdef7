//! Command `twin sweep`: many runs of a scenario.

mod junit;
mod progress;

use std::path::{Path, PathBuf};

use twinrig_campaign::sweep::ResultRow;
use twinrig_experiment::{
    Error as ExperimentError, SweepEvent, SweepOutcome, SweepRequest, sweep as execute,
};
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

use super::{FAILURE, Terminal, outputs, settings};
use crate::args::SweepArgs;
use crate::error::TwinError;
use crate::progress::Progress;

/// Folder of the results of all sweeps.
const FOLDER: &str = "sweeps";

pub(super) fn sweep(registry: &Registry, args: &SweepArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    let request = SweepRequest {
        scenario: args.scenario.clone(),
        spec: args.spec.clone(),
        settings: settings(&args.settings),
        engine: args.engine.clone(),
        partition: args.partition,
        out: args.out.clone().unwrap_or_else(|| folder(&args.spec)),
        record: args.record.as_deref().map(absolute),
    };
    let done = run(registry, args, &request, terminal).and_then(|mut outcome| {
        if args.json {
            print_json(&mut outcome, terminal)?;
        } else {
            terminal.print(&outcome.text());
        }
        Ok(outcome.result.verdict.exit_code())
    });
    done.unwrap_or_else(|error| {
        terminal.report_error(&error, args.json);
        FAILURE
    })
}

/// Prints the result for programs. Its rows are read from disk meanwhile.
fn print_json(
    outcome: &mut SweepOutcome,
    terminal: &mut Terminal<'_>,
) -> Result<(), ExperimentError> {
    let SweepOutcome { result, rows, .. } = outcome;
    let mut read = |row: &ResultRow| Ok(rows.read(result, row)?);
    let with_rows = result.json(&mut read);
    terminal.print_json(&with_rows);
    with_rows.failed().map_or(Ok(()), Err)
}

fn run(
    registry: &Registry,
    args: &SweepArgs,
    request: &SweepRequest,
    terminal: &mut Terminal<'_>,
) -> Result<SweepOutcome, TwinError> {
    outputs::check_folder(&request.out)?;
    if let Some(path) = &args.junit {
        outputs::check_file(path)?;
    }
    let title = args.spec.file_stem().unwrap_or_default().to_string_lossy();
    let mut line = Progress::new(&title, terminal.interactive && !args.json);
    let outcome = execute(registry, request, &mut |event| match event {
        SweepEvent::Warning(text) => terminal.note(text),
        SweepEvent::Progress(it) => progress::show(&mut line, &it),
    });
    drop(line);
    let mut outcome = outcome?;
    if !args.json {
        terminal.warn(&outcome.warnings);
    }
    for note in outcome.notes.iter().chain(&outcome.result.effect_warning()) {
        terminal.note(note);
    }
    if let Some(path) = &args.junit {
        let document = junit::document(&outcome.result, &mut outcome.rows);
        let document = document.map_err(ExperimentError::from)?;
        let written = std::fs::write(path, document);
        written.map_err(|source| {
            TwinError::from(Error::Write {
                path: path.clone(),
                source,
            })
        })?;
    }
    Ok(outcome)
}

/// Returns the path for machines on which the current folder is another one.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Returns the folder of the results of a specification.
fn folder(spec: &Path) -> PathBuf {
    Path::new(FOLDER).join(spec.file_stem().unwrap_or_default())
}
