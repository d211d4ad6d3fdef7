//! `twin run`

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use twinrig_record::Fingerprint;
use twinrig_scenario::{Scenario, Setting};

use super::together::{self, Together};
use super::{PLANT, Terminal, outputs, settings};
use crate::args::{RunArgs, Settings};
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::{TwinError, guarded};
use crate::report::{Report, Status};
use crate::report::{junit, table};
use crate::run::execute::{Execution, execute};
use crate::run::interrupt;
use crate::run::recording_size::LARGE_RECORDING;

pub(super) fn run(registry: &Registry, args: &RunArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.watched {
        interrupt::listen();
    }
    if let Err(error) = together::check(args).and_then(|()| writable(args)) {
        terminal.fail(&error, args.json);
        return Status::Error.exit_code();
    }
    let mut session = Session {
        registry,
        args,
        recordings: Vec::new(),
        warned: BTreeSet::new(),
        reports: Vec::new(),
    };
    let mut worst = Status::Pass.exit_code();
    for path in &args.scenarios {
        if args.plant.len() > 1 {
            let code = Together::new(&mut session, path).run(terminal);
            worst = worst.max(code);
        } else {
            let report = session.whole(path, args.plant.first(), terminal);
            session.show(report, terminal);
        }
        if interrupt::asked() {
            break;
        }
    }
    let reports = session.reports;
    if !args.json && reports.len() > 1 {
        let text = table::summary(&reports, terminal.paint);
        terminal.print(&text);
    }
    let codes = reports.iter().map(|report| report.verdict.exit_code());
    let mut status = codes.max().map(|code| code.max(worst));
    if let Some(path) = &args.junit
        && let Err(source) = std::fs::write(path, junit::document(&reports))
    {
        terminal.complain(&TwinError::Write {
            path: path.clone(),
            source,
        });
        status = Some(Status::Error.exit_code());
    }
    status.unwrap_or(Status::Error.exit_code())
}

/// Whether everything can be written that the command is to write: that is not found out after hours.
fn writable(args: &RunArgs) -> Result<(), TwinError> {
    if let Some(path) = &args.junit {
        outputs::check_file(path)?;
    }
    if !args.no_record {
        outputs::check_folder(&args.out)?;
    }
    Ok(())
}

/// What is run with one command, and what has become of it so far.
pub(super) struct Session<'a> {
    pub(super) registry: &'a Registry,
    pub(super) args: &'a RunArgs,
    /// Where recordings went.
    recordings: Vec<PathBuf>,
    /// The warnings that were shown, in their words.
    warned: BTreeSet<String>,
    pub(super) reports: Vec<Report>,
}

impl<'a> Session<'a> {
    /// Runs one scenario. An error of one does not keep the others from running.
    pub(super) fn whole(
        &mut self,
        path: &Path,
        plant: Option<&String>,
        terminal: &mut Terminal<'_>,
    ) -> Report {
        let file = path.display().to_string();
        let report = guarded(&file, || {
            let assembly = self.assembly(path, plant)?;
            self.warn(&assembly, terminal);
            let execution = self.execution(&assembly, "", terminal);
            execute(&assembly, &execution)
        });
        report.unwrap_or_else(|error| error_of(path, &error))
    }

    /// Shows the warnings of a scenario, each once: several plants run one file.
    pub(super) fn warn(&mut self, assembly: &Assembly<'_>, terminal: &mut Terminal<'_>) {
        if self.args.json {
            return;
        }
        let warnings = &assembly.scenario().warnings;
        let warned = &mut self.warned;
        let recorded = !self.args.no_record;
        let new = warnings.iter().filter(|warning| {
            (recorded || warning.code != LARGE_RECORDING) && warned.insert(warning.to_string())
        });
        terminal.warn(new);
    }

    pub(super) fn assembly(
        &self,
        path: &Path,
        plant: Option<&String>,
    ) -> Result<Assembly<'a>, TwinError> {
        let settings: Vec<Setting> = settings(&Settings {
            set: self.args.set.clone(),
            plant: plant.cloned(),
        });
        guarded(&path.display().to_string(), || {
            Assembly::of_file(self.registry, path, &settings)
        })
    }

    /// How it is run: where its recording goes, with `mark` behind its name.
    pub(super) fn execution(
        &mut self,
        assembly: &Assembly<'_>,
        mark: &str,
        terminal: &Terminal<'_>,
    ) -> Execution {
        let recording = (!self.args.no_record).then(|| {
            let path = recording(&self.args.out, assembly.scenario(), mark, &self.recordings);
            self.recordings.push(path.clone());
            path
        });
        Execution {
            recording,
            progress: terminal.watched && !self.args.json,
            ports: ports(&self.args.port),
        }
    }

    /// Prints a report and keeps it.
    pub(super) fn show(&mut self, report: Report, terminal: &mut Terminal<'_>) {
        if self.args.json {
            terminal.print_json(&report);
        } else if let (None, Some(error)) = (&report.fingerprint, &report.error) {
            // It did not begin: there is nothing to show but what is wrong.
            let _ = writeln!(terminal.err, "{error}\n");
        } else {
            let text = table::report(&report, terminal.paint);
            terminal.print(&text);
            terminal.print("");
        }
        self.reports.push(report);
    }
}

/// The report of what did not begin.
pub(super) fn error_of(path: &Path, error: &TwinError) -> Report {
    Report::of_error(&path.display().to_string(), error.to_string())
}

/// Devices by the names of their buses.
pub(super) fn ports(given: &[(String, String)]) -> Vec<(String, PathBuf)> {
    let port = |(bus, device): &(String, String)| (bus.clone(), PathBuf::from(device));
    given.iter().map(port).collect()
}

/// Where the recording of a scenario goes: named after its file, its seed and what is set on top of it (the plant by its
/// name where that is all, a hash of anything else), never after the clock, so that the same run goes to the same place; numbered only against others of the same call.
fn recording(folder: &Path, scenario: &Scenario, mark: &str, taken: &[PathBuf]) -> PathBuf {
    let stem = Path::new(&scenario.file).file_stem();
    let stem = stem.map_or("scenario".into(), |stem| stem.to_string_lossy());
    let mut name = format!("{stem}-seed{}", scenario.seed);
    if let [only] = scenario.settings.as_slice()
        && only.origin == PLANT
    {
        name = format!("{name}-{}", scenario.plant.model.replace(['/', '\\'], "-"));
    } else if !scenario.settings.is_empty() {
        let mut digest = Fingerprint::new();
        for setting in &scenario.settings {
            digest.wire(0, 0, setting.key.as_bytes());
            digest.wire(0, 1, setting.value.as_bytes());
        }
        name = format!("{name}-set{:.8}", digest.digest().to_string());
    }
    let path = |count: usize| match count {
        1 => folder.join(format!("{name}{mark}.mcap")),
        _ => folder.join(format!("{name}{mark}-{count}.mcap")),
    };
    let free = (1..=taken.len()).map(path);
    free.into_iter()
        .find(|path| !taken.contains(path))
        .unwrap_or_else(|| path(taken.len() + 1))
}
