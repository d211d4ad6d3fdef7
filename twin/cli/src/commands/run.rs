//! `twin run`

use std::path::{Path, PathBuf};

use twinrig_record::Fingerprint;
use twinrig_scenario::{Scenario, Setting};

use super::{Terminal, settings};
use crate::args::RunArgs;
use crate::assembly::Assembly;
use crate::error::TwinError;
use crate::execute::{Execution, execute};
use crate::registry::Registry;
use crate::report::{Report, Status};
use crate::{interrupt, junit, table};

pub(super) fn run(registry: &Registry, args: &RunArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.watched {
        interrupt::listen();
    }
    let settings = settings(&args.settings);
    let mut recordings = Vec::new();
    let mut reports: Vec<Report> = Vec::new();
    for path in &args.scenarios {
        let report = one(registry, path, &settings, args, &mut recordings, terminal)
            .unwrap_or_else(|error| {
                Report::of_error(&path.display().to_string(), error.to_string())
            });
        if args.json {
            terminal.print_json(&report);
        } else if let (None, Some(error)) = (&report.fingerprint, &report.error) {
            // It did not begin: there is nothing to show but what is wrong.
            let _ = writeln!(terminal.err, "{error}\n");
        } else {
            let text = table::report(&report, terminal.paint);
            terminal.print(&text);
            terminal.print("");
        }
        reports.push(report);
        if interrupt::asked() {
            break;
        }
    }
    if !args.json && reports.len() > 1 {
        let text = table::summary(&reports, terminal.paint);
        terminal.print(&text);
    }
    let mut status = reports
        .iter()
        .map(|report| report.verdict.exit_code())
        .max();
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

/// Runs one scenario. An error of one does not keep the others from running.
fn one(
    registry: &Registry,
    path: &Path,
    settings: &[Setting],
    args: &RunArgs,
    recordings: &mut Vec<PathBuf>,
    terminal: &Terminal<'_>,
) -> Result<Report, TwinError> {
    let assembly = Assembly::of_file(registry, path, settings)?;
    let recording = (!args.no_record).then(|| {
        let path = recording(&args.out, assembly.scenario(), recordings);
        recordings.push(path.clone());
        path
    });
    let progress = terminal.watched && !args.json;
    execute(
        &assembly,
        &Execution {
            recording,
            progress,
            ports: ports(&args.port),
        },
    )
}

/// Devices by the names of their buses.
pub(super) fn ports(given: &[(String, String)]) -> Vec<(String, PathBuf)> {
    let port = |(bus, device): &(String, String)| (bus.clone(), PathBuf::from(device));
    given.iter().map(port).collect()
}

/// Where the recording of a scenario goes: named after its file, its seed and what is set on top of it, never after the
/// clock, so that the same run goes to the same place; numbered only against others of the same call.
fn recording(folder: &Path, scenario: &Scenario, taken: &[PathBuf]) -> PathBuf {
    let stem = Path::new(&scenario.file).file_stem();
    let stem = stem.map_or("scenario".into(), |stem| stem.to_string_lossy());
    let mut name = format!("{stem}-seed{}", scenario.seed);
    if !scenario.settings.is_empty() {
        let mut digest = Fingerprint::new();
        for setting in &scenario.settings {
            digest.wire(0, 0, setting.key.as_bytes());
            digest.wire(0, 1, setting.value.as_bytes());
        }
        name = format!("{name}-set{:.8}", digest.digest().to_string());
    }
    let path = |count: usize| match count {
        1 => folder.join(format!("{name}.mcap")),
        _ => folder.join(format!("{name}-{count}.mcap")),
    };
    let free = (1..=taken.len()).map(path);
    free.into_iter()
        .find(|path| !taken.contains(path))
        .unwrap_or_else(|| path(taken.len() + 1))
}
