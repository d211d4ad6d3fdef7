//! Command `twin study`: accuracy, stability and coupling of plants, filters of loads, gaits.

mod frame;
mod result;

use std::path::{Path, PathBuf};

use serde_json::json;
use twinrig_experiment::{
    CouplingPlan, EstimatePlan, Machine, PrecisionPlan, ProgressObserver, SearchSize,
    StabilityPlan, StudyError, TransitionPlan, coupling, estimate, feedback, modulation, precision,
    radius_markdown, radius_page, robustness, stability, transition,
};

use super::{FAILURE, NEGATIVE, SUCCESS, Terminal, outputs};
use crate::args::{
    EstimateOptions, FactorValues, PrecisionOptions, RobustnessOptions, StabilityOptions,
    StudyArgs, StudyCommand, StudyOptions,
};
use crate::error::TwinError;
use crate::progress::Progress;
use crate::radius::execute::radius;
use crate::study::builder::StudyBuilder;
use crate::study::coupling_builder::RigStudyBuilder;
use crate::study::feedback_cases::FeedbackCases;
use crate::study::load_recorder::BenchRecorder;
use crate::study::modulation_cases::ModulationCases;
use crate::study::robustness_cases::RobustnessCases;
use crate::study::transition_cases::TransitionCases;
use frame::StudyFrame;
use result::{NamedRadius, StudyResult};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;
use twinrig_scenario::Setting;

/// Name and version of the program, for reports.
const BUILD: &str = concat!("twinrig ", env!("CARGO_PKG_VERSION"));

pub(super) fn study(registry: &Registry, args: &StudyArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    let frame = StudyFrame::of(&args.study);
    match execute(registry, &args.study, frame, terminal) {
        Ok((result, machine, files)) => {
            if frame.json {
                terminal.print_json(&result.json(&machine, &terminal.command));
            } else {
                let text = result.text(&files);
                terminal.print(&text);
            }
            match result.error() {
                None if result.is_negative() => NEGATIVE,
                None => SUCCESS,
                Some(error) => {
                    if !frame.json {
                        terminal.print_message(&error);
                    }
                    FAILURE
                }
            }
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
) -> Result<(StudyResult, Machine, Vec<PathBuf>), TwinError> {
    frame.check_lists(study)?;
    let settings = frame.settings();
    if !frame.json {
        for scenario in frame.scenarios {
            let assembly = Assembly::of_file(registry, scenario, &settings)?;
            terminal.warn(&assembly.scenario().warnings);
        }
    }
    // Checks before the study that its files can be written.
    create(frame.out)?;
    outputs::check_folder(frame.out)?;
    let machine = Machine::here(BUILD);
    let show_progress = terminal.interactive && !frame.json;
    let observer = &mut ProgressLine(Progress::new(frame.name, show_progress));
    let result = run(registry, study, frame, &settings, observer)?;
    let result = result.map_err(|source| TwinError::Study {
        file: frame.scenarios[0].display().to_string(),
        source,
    })?;
    let files = write(frame, &result, &machine, &terminal.command)?;
    Ok((result, machine, files))
}

fn run(
    registry: &Registry,
    study: &StudyCommand,
    frame: StudyFrame<'_>,
    settings: &[Setting],
    observer: &mut dyn ProgressObserver,
) -> Result<Result<StudyResult, StudyError>, TwinError> {
    Ok(match study {
        StudyCommand::Precision(PrecisionOptions { study, ensemble }) => {
            let plan = PrecisionPlan {
                duration: study.duration,
                ensemble: *ensemble,
                budget_s: study.budget,
                ..PrecisionPlan::default()
            };
            let builder = builder(registry, study, settings)?;
            precision(&builder, &plan, observer)
                .map(|study| StudyResult::Plants(builder.with_panics(study)))
        }
        StudyCommand::Stability(StabilityOptions { study, factor }) => {
            let mut plan = StabilityPlan {
                budget_s: study.budget,
                ..StabilityPlan::default()
            };
            plan.duration = study.duration.unwrap_or(plan.duration);
            if let Some(FactorValues { factor, values }) = factor {
                plan.factors = vec![*factor];
                plan.values = Some(values.clone());
            }
            let builder = builder(registry, study, settings)?;
            stability(&builder, &plan, observer)
                .map(|study| StudyResult::Plants(builder.with_panics(study)))
        }
        StudyCommand::Coupling(options) => {
            let plan = CouplingPlan {
                duration: options.duration,
                budget_s: options.budget,
                ..CouplingPlan::default()
            };
            let rigs = RigStudyBuilder::new(registry, &options.scenario, settings, &options.plant)?;
            coupling(&rigs, &plan, observer)
                .map(|study| StudyResult::Coupling(rigs.with_panics(study)))
        }
        StudyCommand::Estimate(options) => {
            load_filters(registry, options, settings.to_vec(), observer)?
        }
        StudyCommand::Modulation(options) => {
            let cases = ModulationCases::new(registry, options, settings)?;
            modulation(&cases, &cases.plan(options)?, observer).map(StudyResult::Modulation)
        }
        StudyCommand::Transition(options) => {
            let cases = TransitionCases::new(registry, options, settings)?;
            let plan = TransitionPlan {
                tolerance: options.tolerance,
                lasting: options.cycles,
            };
            transition(&cases, &plan, observer).map(StudyResult::Transition)
        }
        StudyCommand::Loads(options) => {
            let cases = FeedbackCases::new(registry, options, settings)?;
            feedback(&cases, &cases.plan(options)?, observer)
                .map(|study| StudyResult::Feedback(Box::new(study)))
        }
        StudyCommand::Radius(options) => {
            let request = options.request(frame.stem(), settings)?;
            radius(registry, &request, observer)?
                .map(|outcome| StudyResult::Radius(Box::new(outcome)))
        }
        StudyCommand::Robustness(options) => robust(registry, options, settings, observer)?,
    })
}

/// Studies ensembles, then the radii of the same scenarios if they are asked for.
fn robust(
    registry: &Registry,
    options: &RobustnessOptions,
    settings: &[Setting],
    observer: &mut dyn ProgressObserver,
) -> Result<Result<StudyResult, StudyError>, TwinError> {
    let cases = RobustnessCases::new(registry, options, settings)?;
    let plan = RobustnessCases::plan(options);
    let mut study = match robustness(&cases, &plan, observer) {
        Ok(study) => study,
        Err(error) => return Ok(Err(error)),
    };
    let mut radii = Vec::new();
    let files = cases.files().iter().filter(|_| options.radius);
    for (path, plant) in files {
        let plant = plant.as_deref();
        let name = options.radius_name(path, plant);
        let request = options.radius_request(&name, path, plant, settings);
        match radius(registry, &request, observer) {
            Ok(Ok(outcome)) => radii.push(NamedRadius { name, outcome }),
            Ok(Err(error)) => return Ok(Err(error)),
            // It expects nothing, or has no axis.
            Err(TwinError::Rig(Error::InvalidOptions { why, .. })) => {
                study.left_out.push(format!("{name}: {why}"));
            }
            Err(error) => return Err(error),
        }
    }
    Ok(Ok(StudyResult::Robustness(study, radii)))
}

fn builder<'r>(
    registry: &'r Registry,
    options: &StudyOptions,
    settings: &[Setting],
) -> Result<StudyBuilder<'r>, TwinError> {
    let path = &options.scenario;
    StudyBuilder::new(registry, path, settings, &options.plant, options.duration)
}

fn load_filters(
    registry: &Registry,
    options: &EstimateOptions,
    mut settings: Vec<Setting>,
    observer: &mut dyn ProgressObserver,
) -> Result<Result<StudyResult, StudyError>, TwinError> {
    let plan = EstimatePlan {
        search: SearchSize {
            particles: options.particles,
            iterations: options.iterations,
        },
        budget_s: options.study.budget,
    };
    let study = &options.study;
    settings.extend(study.plant.iter().map(|name| Setting::plant(name)));
    settings.extend(study.duration.map(|duration| Setting {
        origin: "--duration".to_owned(),
        key: "duration".to_owned(),
        value: format!("\"{duration}\""),
    }));
    let bench = BenchRecorder::new(registry, &study.scenario, &settings)?;
    let found = estimate(&bench, &plan, observer);
    Ok(found.map(|study| StudyResult::Estimate(Box::new(study))))
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
        TwinError::from(Error::Write {
            path: folder.to_owned(),
            source,
        })
    })
}

/// Writes the HTML page, the CSV and the JSON file, and tables in Markdown, also of the radii of a
/// study of another kind; returns their paths.
fn write(
    frame: StudyFrame<'_>,
    result: &StudyResult,
    machine: &Machine,
    command: &str,
) -> Result<Vec<PathBuf>, TwinError> {
    let json = result.json(machine, command);
    let mut texts = vec![
        ("html", result.html(machine, command)),
        ("csv", result.csv()),
        ("json", format!("{json:#}\n")),
    ];
    texts.extend(result.markdown().map(|text| ("md", text)));
    let mut files = write_texts(frame.out, &frame.stem(), texts)?;
    for NamedRadius { name, outcome } in result.radii() {
        let radius = &outcome.result;
        let texts = vec![
            ("html", radius_page(radius).html()),
            ("csv", radius.csv()),
            ("json", format!("{:#}\n", json!(radius))),
            ("md", radius_markdown(radius)),
        ];
        files.extend(write_texts(frame.out, name, texts)?);
    }
    Ok(files)
}

fn write_texts(
    folder: &Path,
    stem: &str,
    texts: Vec<(&str, String)>,
) -> Result<Vec<PathBuf>, TwinError> {
    let mut files = Vec::new();
    for (ending, text) in texts {
        let path = folder.join(format!("{stem}.{ending}"));
        std::fs::write(&path, text).map_err(|source| {
            TwinError::from(Error::Write {
                path: path.clone(),
                source,
            })
        })?;
        files.push(path);
    }
    Ok(files)
}
