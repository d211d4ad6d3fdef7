//! Command `twin run`: execution of scenarios.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use twinrig_document::quoted;
use twinrig_experiment::shell::quoted as shell;
use twinrig_experiment::{check_ensemble, with_ensemble, with_error_bars};
use twinrig_record::Fingerprint;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::recording_size::LARGE_RECORDING;
use twinrig_rig::error::{Error, guarded};
use twinrig_rig::registry::Registry;
use twinrig_rig::report::{Report, Status};
use twinrig_rig::run::execute::execute_observed;
use twinrig_rig::run::execution::Execution;
use twinrig_rig::run::interrupt;
use twinrig_scenario::{Scenario, Setting};

use super::baseline::Baseline;
use super::plant_comparison::{self, PlantComparison};
use super::report::{page_path, remove_page, write_page};
use super::{PLANT_KEY, Terminal, outputs, settings, source};
use crate::args::{RunArgs, Settings};
use crate::error::TwinError;
use crate::progress::{Progress, RunLine};
use crate::report::{junit, table};

pub(super) fn run(registry: &Registry, args: &RunArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    if let Err(error) = plant_comparison::check(args).and_then(|()| check_outputs(args)) {
        terminal.report_error(&error, args.json);
        return Status::Error.exit_code();
    }
    let baseline = match args.against.as_deref().map(Baseline::open).transpose() {
        Ok(baseline) => baseline,
        Err(error) => {
            terminal.report_error(&error, args.json);
            return Status::Error.exit_code();
        }
    };
    let mut session = Session {
        baseline,
        registry,
        args,
        recordings: Vec::new(),
        warned: BTreeSet::new(),
        reports: Vec::new(),
        error: None,
        page_code: Status::Pass.exit_code(),
    };
    let _budget = args.budget.map(crate::interrupt::end_after);
    let mut worst = Status::Pass.exit_code();
    for path in &args.scenarios {
        if interrupt::is_requested() {
            let report = Report::of_error(&source::name(path), crate::interrupt::not_run());
            session.show(report, terminal);
        } else if args.plant.len() > 1 {
            let code = PlantComparison::new(&mut session, path).run(terminal);
            worst = worst.max(code);
        } else {
            let report = session.run(path, args.plant.first(), terminal);
            session.show(report, terminal);
        }
    }
    let reports = &session.reports;
    if !args.json && reports.len() > 1 {
        let text = table::summary(reports);
        terminal.print(&text);
    }
    let codes = reports.iter().map(Report::exit_code);
    let mut status = codes
        .max()
        .map(|code| code.max(worst).max(session.page_code));
    if let Some(path) = &args.junit
        && let Err(source) = std::fs::write(path, junit::document(reports, &options(args)))
    {
        terminal.print_error(&TwinError::from(Error::Write {
            path: path.clone(),
            source,
        }));
        status = Some(Status::Error.exit_code());
    }
    status.unwrap_or(Status::Error.exit_code())
}

/// Returns the path of a file relative to a folder, both as seen from the present folder: the same
/// on every machine with these files.
fn relative(file: &Path, folder: &Path) -> PathBuf {
    let [file, folder] =
        [file, folder].map(|path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
    let shared = file.components().zip(folder.components());
    let shared = shared.take_while(|(one, other)| one == other).count();
    let up = folder
        .components()
        .skip(shared)
        .map(|_| Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}

/// Draws of `--uncertain`.
const UNCERTAIN_RUNS: usize = 200;

/// Returns the options that the result of a run depends on, apart from its plant.
fn options(args: &RunArgs) -> Vec<String> {
    let set = args.set.iter();
    let set = set.map(|(key, value)| format!("--set {}", shell(&format!("{key}={value}"))));
    let seeds = args.seeds.map(|seeds| seeds.to_string());
    let uncertain = args.uncertain.as_ref().map(|it| it.display().to_string());
    let others = [
        ("seed", &args.seed),
        ("seeds", &seeds),
        ("uncertain", &uncertain),
        ("duration", &args.duration),
        ("until", &args.until),
        (
            "against",
            &args.against.as_ref().map(|it| it.display().to_string()),
        ),
    ];
    let others = others.into_iter().filter_map(|(name, value)| {
        let value = value.as_ref()?;
        Some(format!("--{name} {}", shell(value)))
    });
    let error_bars = args.error_bars.then(|| "--error-bars".to_owned());
    set.chain(others).chain(error_bars).collect()
}

/// Checks before the runs that all outputs can be written.
fn check_outputs(args: &RunArgs) -> Result<(), TwinError> {
    if let Some(path) = &args.junit {
        outputs::check_file(path)?;
    }
    if let Some(baseline) = &args.against
        && outputs::is_same(baseline, &args.out)
    {
        return Err(TwinError::Refused {
            path: args.out.clone(),
            why: "the recordings of the runs would replace the baseline".to_owned(),
            help: "name another folder by --out".to_owned(),
        });
    }
    if !args.no_record {
        outputs::check_folder(&args.out)?;
    }
    Ok(())
}

/// Runs of one command and their reports.
pub(super) struct Session<'a> {
    pub(super) registry: &'a Registry,
    pub(super) args: &'a RunArgs,
    baseline: Option<Baseline>,
    /// Paths of the recordings.
    recordings: Vec<PathBuf>,
    /// Texts of the warnings that were shown.
    warned: BTreeSet<String>,
    pub(super) reports: Vec<Report>,
    /// Error of the last run, if it did not start.
    error: Option<TwinError>,
    /// Exit code of the writing of pages.
    page_code: u8,
}

impl<'a> Session<'a> {
    /// Runs one scenario. An error is reported and does not affect other scenarios.
    pub(super) fn run(
        &mut self,
        path: &Path,
        plant: Option<&String>,
        terminal: &mut Terminal<'_>,
    ) -> Report {
        let file = source::name(path);
        let report = guarded(&file, || {
            let assembly = self.assembly(path, plant)?;
            self.warn(&assembly, terminal);
            let execution = self.execution(&assembly, "");
            let shown = self.shows_progress(terminal);
            let mut line = RunLine::new(shown);
            check_ensemble(&assembly)?;
            let report = execute_observed(&assembly, &execution, &mut line)?;
            drop(line);
            let named = |runs: &str| format!("{}, {runs}", report.scenario);
            let [ensemble, error_bars] = ["ensemble", "error bars"].map(named);
            let mut line = Progress::new(&ensemble, shown);
            let report = with_ensemble(&assembly, report, &mut |done, of| line.part(done, of, ""))?;
            drop(line);
            if !self.args.error_bars {
                return Ok(report);
            }
            let mut line = Progress::new(&error_bars, shown);
            let progress = &mut |done, of| line.part(done, of, "");
            let report = with_error_bars(&assembly, report, progress)?;
            Ok::<_, TwinError>(report)
        });
        report.unwrap_or_else(|error| {
            let report = error_of(path, &error);
            self.error = Some(error);
            report
        })
    }

    /// Prints the warnings of a scenario, each once per command.
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
        let mut settings: Vec<Setting> = settings(&Settings {
            set: self.args.set.clone(),
            plant: plant.cloned(),
        });
        let RunArgs {
            seed,
            seeds,
            uncertain,
            duration,
            until,
            ..
        } = self.args;
        let of_seeds = seeds.map(|seeds| {
            let keys = [("runs", seeds.to_string()), ("vary", quoted("seed"))];
            ("--seeds", keys.to_vec())
        });
        let of_fit = uncertain.as_deref().map(|file| {
            let file = relative(file, path.parent().unwrap_or_else(|| Path::new("")));
            let keys = [
                ("runs", UNCERTAIN_RUNS.to_string()),
                ("vary", quoted("fit")),
                ("fit", quoted(&file.display().to_string())),
            ];
            ("--uncertain", keys.to_vec())
        });
        // The share of a table in the file stays.
        for (origin, keys) in of_seeds.into_iter().chain(of_fit) {
            settings.extend(keys.into_iter().map(|(key, value)| Setting {
                origin: origin.to_owned(),
                key: format!("ensemble.{key}"),
                value,
            }));
        }
        for (key, value) in [
            ("seed", seed.clone()),
            ("duration", duration.as_deref().map(quoted)),
            ("until", until.as_deref().map(quoted)),
        ] {
            settings.extend(value.map(|value| Setting {
                origin: format!("--{key}"),
                key: key.to_owned(),
                value,
            }));
        }
        let assembly = guarded(&source::name(path), || {
            source::assembly(self.registry, path, &settings)
        });
        Ok(assembly?)
    }

    /// Returns the execution of an assembly; the name of its recording has the suffix `mark`.
    pub(super) fn execution(&mut self, assembly: &Assembly<'_>, mark: &str) -> Execution {
        let recording = (!self.args.no_record).then(|| {
            let path = recording(&self.args.out, assembly.scenario(), mark, &self.recordings);
            self.recordings.push(path.clone());
            path
        });
        Execution {
            recording,
            ports: ports(&self.args.port),
            strict: self.args.strict,
        }
    }

    /// Returns whether progress lines are shown where standard error is a terminal.
    pub(super) fn shows_progress(&self, terminal: &Terminal<'_>) -> bool {
        terminal.interactive && !self.args.json
    }

    /// Compares a run that has a recording with the baseline, if there is one.
    fn compare(&self, report: &mut Report) {
        let recording = report.recording.as_ref().map(PathBuf::from);
        let (Some(baseline), Some(recording)) = (&self.baseline, recording) else {
            return;
        };
        match baseline.judge(report, &recording) {
            Ok(()) => {
                let differs = report.against.as_ref().is_some_and(|it| !it.same);
                if differs && report.verdict == Status::Pass {
                    report.verdict = Status::Fail;
                }
            }
            // An error of the run is the cause of all that follows.
            Err(_) if report.error.is_some() => {}
            Err(error) => {
                report.verdict = Status::Error;
                report.error = Some(error.to_string());
            }
        }
    }

    /// Writes the page of a run, if it has a recording and one is asked for.
    fn write_page(&mut self, report: &mut Report, terminal: &mut Terminal<'_>) {
        let recording = report.recording.as_ref().map(PathBuf::from);
        let (Some(recording), Some(pages)) = (recording, self.args.report) else {
            return;
        };
        if !pages.includes(report.verdict) {
            remove_page(&recording);
            return;
        }
        let path = page_path(&recording);
        let progress = self.shows_progress(terminal);
        // A run that is not as its baseline is shown beside it.
        let against = report.against.as_ref().filter(|it| !it.same);
        let baseline = against.map(|it| PathBuf::from(&it.baseline));
        let recordings: Vec<PathBuf> = baseline.into_iter().chain([recording]).collect();
        match write_page(
            self.registry,
            &recordings,
            recordings.len() > 1,
            &path,
            progress,
        ) {
            Ok(_) => report.page = Some(path.display().to_string()),
            Err(error) => {
                terminal.report_error(&error, self.args.json);
                self.page_code = Status::Error.exit_code();
            }
        }
    }

    /// Prints and stores a report.
    pub(super) fn show(&mut self, mut report: Report, terminal: &mut Terminal<'_>) {
        self.compare(&mut report);
        self.write_page(&mut report, terminal);
        if self.args.json {
            terminal.print_json(&report);
        } else if let (None, Some(error)) = (&report.fingerprint, &report.error) {
            // The run did not start, so that the report consists of the error.
            match self.error.take() {
                Some(error) => terminal.print_error(&error),
                None => terminal.print_message(error),
            }
            terminal.print_message("");
        } else {
            let text = table::report(&report);
            terminal.print(&text);
            terminal.print("");
        }
        self.reports.push(report);
    }
}

/// Returns the report of a run that could not start.
pub(super) fn error_of(path: &Path, error: &TwinError) -> Report {
    Report::of_error(&source::name(path), error.to_string())
}

/// Returns the devices with the names of their buses.
pub(super) fn ports(options: &[(String, String)]) -> Vec<(String, PathBuf)> {
    let port = |(bus, device): &(String, String)| (bus.clone(), PathBuf::from(device));
    options.iter().map(port).collect()
}

/// Returns the path of the recording of a scenario in `folder`, as `twin run --out` names it.
pub fn recording_path(folder: &Path, scenario: &Scenario) -> PathBuf {
    recording(folder, scenario, "", &[])
}

/// Returns the hash of texts, as hexadecimal digits.
fn hash(texts: &[&str]) -> String {
    let mut digest = Fingerprint::new();
    for text in texts {
        digest.wire(0, 0, text.as_bytes());
    }
    digest.digest().to_string()
}

/// Returns the path of the recording of a scenario. The name consists of the scenario file, the
/// seed and the settings (the plant if it is the only setting, otherwise a hash), so that equal
/// runs have equal paths. A number distinguishes recordings of one command.
fn recording(folder: &Path, scenario: &Scenario, mark: &str, taken: &[PathBuf]) -> PathBuf {
    // A text without a file has a name in angle brackets, which several have in common.
    let file = Some(Path::new(&scenario.file)).filter(|_| !scenario.file.starts_with('<'));
    let stem = file.and_then(Path::file_stem).map_or_else(
        || format!("scenario-{:.8}", hash(&[&scenario.text])),
        |stem| stem.to_string_lossy().into_owned(),
    );
    let mut name = format!("{stem}-seed{}", scenario.seed);
    if let [only] = scenario.settings.as_slice()
        && only.key == PLANT_KEY
    {
        name = format!("{name}-{}", scenario.plant.model.replace(['/', '\\'], "-"));
    } else if !scenario.settings.is_empty() {
        let settings = scenario.settings.iter();
        let texts: Vec<&str> = settings.flat_map(|it| [&*it.key, &*it.value]).collect();
        name = format!("{name}-set{:.8}", hash(&texts));
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
