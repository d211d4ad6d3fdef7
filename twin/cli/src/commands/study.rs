//! Command `twin study`: accuracy, stability and coupling of plants.

use std::path::{Path, PathBuf};

use twinrig_scenario::Setting;
use twinrig_study::{
    CouplingPlan, CouplingStudy, EstimatePlan, EstimateStudy, Machine, PrecisionPlan,
    ProgressObserver, SearchSize, StabilityPlan, Study, coupling, csv, estimate, html, precision,
    stability,
};

use super::{FAILURE, SUCCESS, Terminal, outputs};
use crate::args::{EstimateOptions, PrecisionOptions, StudyArgs, StudyCommand, StudyOptions};
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::TwinError;
use crate::run::interrupt;
use crate::run::progress::Progress;
use crate::study::builder::StudyBuilder;
use crate::study::coupling_builder::RigStudyBuilder;
use crate::study::coupling_table;
use crate::study::estimate_table;
use crate::study::load_recorder::BenchRecorder;
use crate::study::table;

/// Name and version of the program, for reports.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn study(registry: &Registry, args: &StudyArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        interrupt::listen();
    }
    let (name, options) = match &args.study {
        StudyCommand::Precision(options) => ("precision", &options.study),
        StudyCommand::Stability(options) => ("stability", options),
        StudyCommand::Coupling(options) => ("coupling", options),
        StudyCommand::Estimate(options) => ("estimate", &options.study),
    };
    match execute(registry, &args.study, name, options, terminal) {
        Ok((result, machine, files)) => {
            if options.json {
                terminal.print_json(&result.json(&machine, &command(&args.study, name, options)));
            } else {
                let text = result.text(&files);
                terminal.print(&text);
            }
            match result.error() {
                None => SUCCESS,
                Some(error) => {
                    if !options.json {
                        let _ = writeln!(terminal.err, "{error}");
                    }
                    FAILURE
                }
            }
        }
        Err(error) => {
            terminal.report_error(&error, options.json);
            FAILURE
        }
    }
}

/// Result of a study.
enum StudyResult {
    Plants(Study),
    Coupling(CouplingStudy),
    Estimate(Box<EstimateStudy>),
}

impl StudyResult {
    /// Returns the error of a study in which a part panicked.
    fn error(&self) -> Option<String> {
        match self {
            Self::Plants(study) => study.error(),
            Self::Coupling(study) => study.error(),
            Self::Estimate(_) => None,
        }
    }

    fn json(&self, machine: &Machine, command: &str) -> serde_json::Value {
        match self {
            Self::Plants(study) => study.json(machine, command),
            Self::Coupling(study) => study.json(machine, command),
            Self::Estimate(study) => study.json(machine, command),
        }
    }

    fn html(&self, machine: &Machine, command: &str) -> String {
        match self {
            Self::Plants(study) => html(study, machine, command),
            Self::Coupling(study) => study.html(machine, command),
            Self::Estimate(study) => study.html(machine, command),
        }
    }

    fn csv(&self) -> String {
        match self {
            Self::Plants(study) => csv(&study.rows),
            Self::Coupling(study) => study.csv(),
            Self::Estimate(study) => study.csv(),
        }
    }

    fn text(&self, files: &[PathBuf]) -> String {
        match self {
            Self::Plants(study) => table::text(study, files),
            Self::Coupling(study) => coupling_table::text(study, files),
            Self::Estimate(study) => estimate_table::text(study, files),
        }
    }
}

fn execute(
    registry: &Registry,
    study: &StudyCommand,
    name: &'static str,
    options: &StudyOptions,
    terminal: &mut Terminal<'_>,
) -> Result<(StudyResult, Machine, Vec<PathBuf>), TwinError> {
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
    // Checks before the study that its files can be written.
    create(&options.out)?;
    outputs::check_folder(&options.out)?;
    let machine = Machine::here(BUILD);
    let show_progress = terminal.interactive && !options.json;
    let observer = &mut ProgressLine(Progress::of_parts(name, show_progress));
    let builder = |names| {
        let path = &options.scenario;
        StudyBuilder::new(registry, path, &settings, names, options.duration)
    };
    let result = match study {
        StudyCommand::Precision(PrecisionOptions { ensemble, .. }) => {
            let plan = PrecisionPlan {
                duration: options.duration,
                ensemble: *ensemble,
                budget_s: options.budget,
                ..PrecisionPlan::default()
            };
            let builder = builder(&options.plant)?;
            precision(&builder, &plan, observer)
                .map(|study| StudyResult::Plants(builder.with_panics(study)))
        }
        StudyCommand::Stability(_) => {
            let mut plan = StabilityPlan {
                budget_s: options.budget,
                ..StabilityPlan::default()
            };
            plan.duration = options.duration.unwrap_or(plan.duration);
            let builder = builder(&options.plant)?;
            stability(&builder, &plan, observer)
                .map(|study| StudyResult::Plants(builder.with_panics(study)))
        }
        StudyCommand::Coupling(_) => {
            let plan = CouplingPlan {
                duration: options.duration,
                budget_s: options.budget,
                ..CouplingPlan::default()
            };
            let rigs =
                RigStudyBuilder::new(registry, &options.scenario, &settings, &options.plant)?;
            coupling(&rigs, &plan, observer)
                .map(|study| StudyResult::Coupling(rigs.with_panics(study)))
        }
        StudyCommand::Estimate(EstimateOptions {
            particles,
            iterations,
            ..
        }) => {
            let plan = EstimatePlan {
                search: SearchSize {
                    particles: *particles,
                    iterations: *iterations,
                },
                budget_s: options.budget,
            };
            let mut settings = settings.clone();
            settings.extend(options.plant.iter().map(|name| Setting::plant(name)));
            settings.extend(options.duration.map(|duration| Setting {
                origin: "--duration".to_owned(),
                key: "duration".to_owned(),
                value: format!("\"{duration}\""),
            }));
            let bench = BenchRecorder::new(registry, &options.scenario, &settings)?;
            estimate(&bench, &plan, observer).map(|study| StudyResult::Estimate(Box::new(study)))
        }
    };
    let result = result.map_err(|source| TwinError::Study {
        file: options.scenario.display().to_string(),
        source,
    })?;
    let files = write(study, name, &result, &machine, options)?;
    Ok((result, machine, files))
}

/// Shows the progress of a study and ends the study on an interrupt.
struct ProgressLine(Progress);

impl ProgressObserver for ProgressLine {
    fn at(&mut self, part: usize, of: usize, description: &str) -> bool {
        self.0.part(part, of, description);
        !interrupt::is_requested()
    }
}

/// Returns the command that repeats a study.
fn command(study: &StudyCommand, name: &str, options: &StudyOptions) -> String {
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
    if let StudyCommand::Precision(PrecisionOptions { ensemble, .. }) = study {
        words.push(format!("--ensemble {ensemble}"));
    }
    if let StudyCommand::Estimate(options) = study {
        words.push(format!("--particles {}", options.particles));
        words.push(format!("--iterations {}", options.iterations));
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

/// Writes the HTML page, the CSV and the JSON file; returns their paths.
fn write(
    study: &StudyCommand,
    name: &str,
    result: &StudyResult,
    machine: &Machine,
    options: &StudyOptions,
) -> Result<Vec<PathBuf>, TwinError> {
    let stem = options.scenario.file_stem();
    let stem = stem.map_or("scenario".into(), |stem| stem.to_string_lossy());
    let command = command(study, name, options);
    let json = result.json(machine, &command);
    let texts = [
        ("html", result.html(machine, &command)),
        ("csv", result.csv()),
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
