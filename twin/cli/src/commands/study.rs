//! `twin study`

use std::path::{Path, PathBuf};

use twinrig_scenario::Setting;
use twinrig_study::{
    CouplingPlan, CouplingStudy, Machine, PrecisionPlan, ProgressObserver, StabilityPlan, Study,
    coupling, csv, html, precision, stability,
};

use super::{FINE, Terminal, WRONG, outputs};
use crate::args::{StudyArgs, StudyCommand, StudyOptions};
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::TwinError;
use crate::report::paint::Paint;
use crate::run::interrupt;
use crate::run::progress::Progress;
use crate::study::builder::StudyBuilder;
use crate::study::coupling_builder::RigStudyBuilder;
use crate::study::coupling_table;
use crate::study::table;

/// What is run, for a report.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn study(registry: &Registry, args: &StudyArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.watched {
        interrupt::listen();
    }
    let (name, options) = match &args.study {
        StudyCommand::Precision(options) => ("precision", options),
        StudyCommand::Stability(options) => ("stability", options),
        StudyCommand::Coupling(options) => ("coupling", options),
    };
    match done(registry, &args.study, name, options, terminal) {
        Ok((found, machine, files)) => {
            if options.json {
                terminal.print_json(&found.json(&machine, &command(name, options)));
            } else {
                let text = found.text(&files, terminal.paint);
                terminal.print(&text);
            }
            match found.error() {
                None => FINE,
                Some(error) => {
                    if !options.json {
                        let _ = writeln!(terminal.err, "{error}");
                    }
                    WRONG
                }
            }
        }
        Err(error) => {
            terminal.fail(&error, options.json);
            WRONG
        }
    }
}

/// What a study found, of whatever kind.
enum Found {
    Plants(Study),
    Coupling(CouplingStudy),
}

impl Found {
    /// That something panicked, if so.
    fn error(&self) -> Option<String> {
        match self {
            Self::Plants(study) => study.error(),
            Self::Coupling(study) => study.error(),
        }
    }

    fn json(&self, machine: &Machine, command: &str) -> serde_json::Value {
        match self {
            Self::Plants(study) => study.json(machine, command),
            Self::Coupling(study) => study.json(machine, command),
        }
    }

    fn html(&self, machine: &Machine, command: &str) -> String {
        match self {
            Self::Plants(study) => html(study, machine, command),
            Self::Coupling(study) => study.html(machine, command),
        }
    }

    fn csv(&self) -> String {
        match self {
            Self::Plants(study) => csv(&study.rows),
            Self::Coupling(study) => study.csv(),
        }
    }

    fn text(&self, files: &[PathBuf], paint: Paint) -> String {
        match self {
            Self::Plants(study) => table::text(study, files, paint),
            Self::Coupling(study) => coupling_table::text(study, files, paint),
        }
    }
}

fn done(
    registry: &Registry,
    which: &StudyCommand,
    name: &'static str,
    options: &StudyOptions,
    terminal: &mut Terminal<'_>,
) -> Result<(Found, Machine, Vec<PathBuf>), TwinError> {
    let settings: Vec<Setting> = options
        .set
        .iter()
        .map(|(key, value)| Setting {
            origin: "--set".to_owned(),
            key: key.clone(),
            value: value.clone(),
        })
        .collect();
    if !options.json {
        let assembly = Assembly::of_file(registry, &options.scenario, &settings)?;
        terminal.warn(&assembly.scenario().warnings);
    }
    // What cannot be written is known before the work.
    create(&options.out)?;
    outputs::check_folder(&options.out)?;
    let machine = Machine::here(BUILD);
    let wanted = terminal.watched && !options.json;
    let looker = &mut ProgressLine(Progress::of_parts(name, wanted));
    let builder = |names| {
        let path = &options.scenario;
        StudyBuilder::new(registry, path, &settings, names, options.duration)
    };
    let found = match which {
        StudyCommand::Precision(_) => {
            let plan = PrecisionPlan {
                duration: options.duration,
                budget_s: options.budget,
                ..PrecisionPlan::default()
            };
            let builder = builder(&options.plant)?;
            precision(&builder, &plan, looker).map(|study| Found::Plants(builder.told(study)))
        }
        StudyCommand::Stability(_) => {
            let mut plan = StabilityPlan {
                budget_s: options.budget,
                ..StabilityPlan::default()
            };
            plan.duration = options.duration.unwrap_or(plan.duration);
            let builder = builder(&options.plant)?;
            stability(&builder, &plan, looker).map(|study| Found::Plants(builder.told(study)))
        }
        StudyCommand::Coupling(_) => {
            let plan = CouplingPlan {
                duration: options.duration,
                budget_s: options.budget,
                ..CouplingPlan::default()
            };
            let rigs =
                RigStudyBuilder::new(registry, &options.scenario, &settings, &options.plant)?;
            coupling(&rigs, &plan, looker).map(Found::Coupling)
        }
    };
    let found = found.map_err(|source| TwinError::Study {
        file: options.scenario.display().to_string(),
        source,
    })?;
    let files = write(name, &found, &machine, options)?;
    Ok((found, machine, files))
}

/// Shows progress, and ends a study when somebody presses Ctrl-C.
struct ProgressLine(Progress);

impl ProgressObserver for ProgressLine {
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
    name: &str,
    found: &Found,
    machine: &Machine,
    options: &StudyOptions,
) -> Result<Vec<PathBuf>, TwinError> {
    let stem = options.scenario.file_stem();
    let stem = stem.map_or("scenario".into(), |stem| stem.to_string_lossy());
    let command = command(name, options);
    let json = found.json(machine, &command);
    let texts = [
        ("html", found.html(machine, &command)),
        ("csv", found.csv()),
        ("json", format!("{json:#}\n")),
    ];
    let mut files = Vec::new();
    for (ending, text) in texts {
        let file = format!("{name}-{stem}.{ending}");
        let path = options.out.join(file);
        std::fs::write(&path, text).map_err(|source| TwinError::Write {
            path: path.clone(),
            source,
        })?;
        files.push(path);
    }
    Ok(files)
}
