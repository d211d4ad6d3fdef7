//! Command `twin optimize`: settings of a scenario with the best value of an expectation.

mod progress;

use std::path::{Path, PathBuf};

use twinrig_experiment::{OptimizationOutcome, OptimizationRequest, optimize as execute};
use twinrig_rig::registry::Registry;

use super::{FAILURE, Terminal, outputs, settings};
use crate::args::OptimizeArgs;
use crate::error::TwinError;
use crate::progress::Progress;

/// Folder of the results of all optimisations.
const FOLDER: &str = "optimizations";

pub(super) fn optimize(
    registry: &Registry,
    args: &OptimizeArgs,
    terminal: &mut Terminal<'_>,
) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    let request = OptimizationRequest {
        scenario: args.scenario.clone(),
        space: args.space.clone(),
        settings: settings(&args.settings),
        particles: args.particles,
        iterations: args.iterations,
        seed: args.seed,
        engine: args.engine.clone(),
        out: args.out.clone().unwrap_or_else(|| folder(&args.space)),
    };
    match run(registry, args, &request, terminal) {
        Ok(outcome) => {
            if args.json {
                terminal.print_json(&outcome.result);
            } else {
                terminal.print(&outcome.text());
            }
            outcome.result.verdict.exit_code()
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn run(
    registry: &Registry,
    args: &OptimizeArgs,
    request: &OptimizationRequest,
    terminal: &mut Terminal<'_>,
) -> Result<OptimizationOutcome, TwinError> {
    outputs::check_folder(&request.out)?;
    let title = args.space.file_stem().unwrap_or_default().to_string_lossy();
    let mut line = Progress::new(&title, terminal.interactive && !args.json);
    let outcome = execute(registry, request, &mut |it| progress::show(&mut line, it));
    drop(line);
    let outcome = outcome?;
    if !args.json {
        terminal.warn(&outcome.warnings);
    }
    for note in outcome.notes.iter().chain(&outcome.result.warning()) {
        terminal.note(note);
    }
    Ok(outcome)
}

/// Returns the folder of the results of a search space.
fn folder(space: &Path) -> PathBuf {
    Path::new(FOLDER).join(space.file_stem().unwrap_or_default())
}
