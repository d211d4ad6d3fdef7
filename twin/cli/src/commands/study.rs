//! `twin study`

use std::path::{Path, PathBuf};

use twinrig_scenario::Setting;
use twinrig_study::{
    Machine, PrecisionPlan, StabilityPlan, Study, Watcher, csv, html, precision, stability,
};

use super::{FINE, Terminal, WRONG};
use crate::args::{StudyArgs, StudyCommand, StudyOptions};
use crate::error::TwinError;
use crate::interrupt;
use crate::progress::Progress;
use crate::registry::Registry;
use crate::studio::Studio;
use crate::study_table;

/// What is run, for a report.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn study(registry: &Registry, args: &StudyArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.watched {
        interrupt::listen();
    }
    let (name, options) = match &args.study {
        StudyCommand::Precision(options) => ("precision", options),
        StudyCommand::Stability(options) => ("stability", options),
    };
    match done(registry, &args.study, options, terminal) {
        Ok((study, machine, files)) => {
            if options.json {
                terminal.print_json(&study.json(&machine, &command(name, options)));
            } else {
                let text = study_table::text(&study, &files, terminal.paint);
                terminal.print(&text);
            }
            FINE
        }
        Err(error) => {
            terminal.fail(&error, options.json);
            WRONG
        }
    }
}

fn done(
    registry: &Registry,
    which: &StudyCommand,
    options: &StudyOptions,
    terminal: &Terminal<'_>,
) -> Result<(Study, Machine, Vec<PathBuf>), TwinError> {
    let settings: Vec<Setting> = options
        .set
        .iter()
        .map(|(key, value)| Setting {
            origin: "--set".to_owned(),
            key: key.clone(),
            value: value.clone(),
        })
        .collect();
    // What cannot be written is known before the work.
    create(&options.out)?;
    let machine = Machine::here(BUILD);
    let studio = Studio::new(
        registry,
        &options.scenario,
        &settings,
        &options.plant,
        options.duration,
    )?;
    let wanted = terminal.watched && !options.json;
    let (name, study) = match which {
        StudyCommand::Precision(_) => {
            let plan = PrecisionPlan {
                duration: options.duration,
                budget_s: options.budget,
                ..PrecisionPlan::default()
            };
            let mut looker = Looker(Progress::of_parts("precision", wanted));
            ("precision", precision(&studio, &plan, &mut looker))
        }
        StudyCommand::Stability(_) => {
            let mut plan = StabilityPlan {
                budget_s: options.budget,
                ..StabilityPlan::default()
            };
            plan.duration = options.duration.unwrap_or(plan.duration);
            let mut looker = Looker(Progress::of_parts("stability", wanted));
            ("stability", stability(&studio, &plan, &mut looker))
        }
    };
    let study = study.map_err(|source| TwinError::Study {
        file: options.scenario.display().to_string(),
        source,
    })?;
    let files = write(&study, &machine, &command(name, options), options)?;
    Ok((study, machine, files))
}

/// Shows progress, and ends a study when somebody presses Ctrl-C.
struct Looker(Progress);

impl Watcher for Looker {
    fn at(&mut self, part: usize, of: usize, doing: &str) -> bool {
        self.0.part(part, of, doing);
        !interrupt::asked()
    }
}

/// The command that repeats a study.
fn command(name: &str, options: &StudyOptions) -> String {
    let mut words = vec![
        "twin study".to_owned(),
        name.to_owned(),
        options.scenario.display().to_string(),
    ];
    words.extend(options.plant.iter().map(|plant| format!("--plant {plant}")));
    let set = options.set.iter();
    words.extend(set.map(|(key, value)| format!("--set {key}={value:?}")));
    if let Some(duration) = options.duration {
        words.push(format!("--duration \"{duration}\""));
    }
    words.push(format!("--budget {}", options.budget));
    words.join(" ")
}

fn create(folder: &Path) -> Result<(), TwinError> {
    std::fs::create_dir_all(folder).map_err(|source| TwinError::Write {
        path: folder.to_owned(),
        source,
    })
}

/// Writes page, table and JSON, and says where they are.
fn write(
    study: &Study,
    machine: &Machine,
    command: &str,
    options: &StudyOptions,
) -> Result<Vec<PathBuf>, TwinError> {
    let stem = options.scenario.file_stem();
    let stem = stem.map_or("scenario".into(), |stem| stem.to_string_lossy());
    let json = study.json(machine, command);
    let texts = [
        ("html", html(study, machine, command)),
        ("csv", csv(&study.rows)),
        ("json", format!("{json:#}\n")),
    ];
    let mut files = Vec::new();
    for (ending, text) in texts {
        let name = format!("{}-{stem}.{ending}", study.kind.name());
        let path = options.out.join(name);
        std::fs::write(&path, text).map_err(|source| TwinError::Write {
            path: path.clone(),
            source,
        })?;
        files.push(path);
    }
    Ok(files)
}
