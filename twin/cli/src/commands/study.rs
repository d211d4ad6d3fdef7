//! Command `twin study`: accuracy, stability and coupling of plants, filters of loads, gaits.

use std::path::Path;

use serde_json::json;
use twinrig_experiment::{
    Error, Machine, ProgressObserver, StudyCommand, StudyContext, StudyFrame, StudyReport,
};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

use super::{FAILURE, NEGATIVE, SUCCESS, Terminal, outputs};
use crate::args::StudyArgs;
use crate::error::TwinError;
use crate::progress::Progress;
use crate::version::PROFILE;

/// Name and version of the program, for reports.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn study(registry: &Registry, args: &StudyArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    let frame = args.study.request().frame();
    match execute(registry, &args.study, frame, terminal) {
        Ok(exit_code) => exit_code,
        // This partition is done.
        Err(TwinError::Experiment(Error::Partial { missing, of })) if frame.json => {
            terminal.print_json(&json!({ "verdict": "partial", "missing": missing, "of": of }));
            SUCCESS
        }
        Err(TwinError::Experiment(partial @ Error::Partial { .. })) => {
            terminal.print(&partial.to_string());
            SUCCESS
        }
        Err(error) => {
            terminal.report_error(&error, frame.json);
            FAILURE
        }
    }
}

fn execute(
    registry: &Registry,
    study: &StudyCommand,
    frame: StudyFrame<'_>,
    terminal: &mut Terminal<'_>,
) -> Result<u8, TwinError> {
    study.request().check()?;
    let settings = frame.settings();
    if !frame.json {
        for scenario in frame.scenarios {
            let assembly = Assembly::builder(registry)
                .settings(&settings)
                .file(scenario)?;
            terminal.warn(&assembly.scenario().warnings);
        }
    }
    // Checks before the study that its files can be written.
    create(frame.out)?;
    outputs::check_folder(frame.out)?;
    let show_progress = terminal.interactive && !frame.json;
    let report = study.request().run(StudyContext {
        registry,
        settings: &settings,
        machine: &Machine::here(BUILD, PROFILE),
        command: &terminal.command,
        observer: &mut ProgressLine(Progress::new(frame.name, show_progress)),
    })?;
    let files = report.write(frame.out, &frame.stem())?;
    let exit_code = exit_code(&report);
    let error = report.error.clone();
    if frame.json {
        terminal.print_json(&report.json);
    } else {
        terminal.print(&report.text(&files));
        if let Some(error) = error {
            terminal.print_message(&error);
        }
    }
    Ok(exit_code)
}

fn exit_code(report: &StudyReport) -> u8 {
    match report.error {
        Some(_) => FAILURE,
        None if report.is_negative => NEGATIVE,
        None => SUCCESS,
    }
}

/// Shows the progress of a study and ends the study on an interrupt.
struct ProgressLine(Progress);

impl ProgressObserver for ProgressLine {
    fn at(&mut self, part: usize, of: usize, description: &str) -> bool {
        self.0.part(part, of, description);
        !interrupt::is_requested()
    }
}

fn create(folder: &Path) -> Result<(), TwinError> {
    std::fs::create_dir_all(folder).map_err(|source| {
        TwinError::from(RigError::Write {
            path: folder.to_owned(),
            source,
        })
    })
}
