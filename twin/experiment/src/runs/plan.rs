//! Runs of one scenario at points: settings and key of each, and the files that they share.

use std::collections::BTreeMap;
use std::path::Path;

use twinrig_campaign::sweep::{RowKey, SweepValue, overlap, point_name};
use twinrig_document::{Document, DocumentError, Placed, Problem, Warning};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::sources::Sources;
use twinrig_rig::build_key::BuildKey;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_robot::RobotFile;
use twinrig_scenario::{Expectation, Scenario, Setting};

use crate::error::Error;
use crate::runs::cases::{self, RunCase};
use crate::runs::keys;
use crate::runs::parts::UsedParts;
use crate::runs::scene::{bytes_of_files, in_memory};
use crate::shell::quoted;

/// Signals that nothing but a recording requires; by default nothing is recorded.
const RECORDED: &str = "record.signals";
/// Origin of the option `--plant`.
const PLANT: &str = "--plant";

/// Properties that the runs of a plan share.
pub(crate) struct RunRequest<'p> {
    /// File of the scenario.
    pub(crate) scenario: &'p Path,
    /// File that chooses the points: a specification of a sweep or a search space.
    pub(crate) file: &'p str,
    /// Its settings of all runs.
    pub(crate) set: &'p [(String, String)],
    /// Settings of the command line.
    pub(crate) settings: &'p [Setting],
    /// Keys of its dimensions, as it has them.
    pub(crate) keys: Vec<Placed<String>>,
    /// Cases of its points; at least one.
    pub(crate) cases: Vec<RunCase>,
    /// Whether signals that only a recording requires are computed.
    pub(crate) recorded: bool,
}

/// Runs of one scenario at points.
pub(crate) struct RunPlan<'r> {
    pub(crate) registry: &'r Registry,
    /// Name of the scenario.
    pub(crate) scenario: String,
    /// File of the scenario, as given.
    pub(crate) file: String,
    pub(crate) build: BuildKey,
    pub(crate) warnings: Vec<Warning>,
    /// Keys of the dimensions, as the file of the points has them.
    given_keys: Vec<Placed<String>>,
    /// Settings of all runs.
    pub(crate) base: Vec<Setting>,
    /// Cases, whose settings come on top of those.
    pub(crate) cases: Vec<RunCase>,
    /// Dotted keys of the dimensions.
    pub(crate) keys: Vec<String>,
    pub(crate) points: Vec<PlannedPoint>,
    on_disk: Sources,
    /// Sources of the runs, in memory.
    pub(crate) sources: Vec<Sources>,
    /// Contents of the files of each of them.
    files: Vec<Vec<Vec<u8>>>,
    /// Index of the sources by the case and the texts among the values.
    known: BTreeMap<(usize, Vec<String>), usize>,
    /// Kinds of parts of all runs.
    pub(crate) parts: UsedParts,
}

/// Point of a plan, in one of the cases: a run.
pub(crate) struct PlannedPoint {
    pub(crate) values: Vec<SweepValue>,
    /// Index of its case.
    pub(crate) case: usize,
    /// Index of its sources.
    pub(crate) sources: usize,
    pub(crate) key: RowKey,
}

impl<'r> RunPlan<'r> {
    /// Reads the scenario and all files that it names; also returns it. There are no points yet.
    pub(crate) fn new(
        registry: &'r Registry,
        request: RunRequest<'_>,
    ) -> Result<(Self, Scenario), Error> {
        let document = Document::read(request.scenario)?;
        let folder = request.scenario.parent().unwrap_or(Path::new(""));
        let on_disk = Sources::of(document, folder);
        cases::check(&request)?;
        let base = base_settings(&request);
        let (read, body) = on_disk.body(registry, &base)?;
        let keys = keys::resolved(&request, registry, &read, body.robot())?;
        let plan = Self {
            registry,
            scenario: read.name.clone(),
            file: read.file.clone(),
            build: registry.build()?,
            warnings: read.warnings.clone(),
            given_keys: request.keys,
            base,
            cases: request.cases,
            keys,
            points: Vec::new(),
            on_disk,
            sources: Vec::new(),
            files: Vec::new(),
            known: BTreeMap::new(),
            parts: UsedParts::default(),
        };
        Ok((plan, read))
    }

    /// Begins again with other cases, and without points.
    pub(crate) fn begin_again(&mut self, cases: Vec<RunCase>) {
        self.cases = cases;
        self.points.clear();
        self.sources.clear();
        self.files.clear();
        self.known.clear();
    }

    /// Adds a point in a case. Where its values may name files, these are read once for each
    /// combination of such values, and `visit` is called with the scenario.
    pub(crate) fn add_point(
        &mut self,
        case: usize,
        values: Vec<SweepValue>,
        visit: &mut dyn FnMut(&Scenario),
    ) -> Result<(), RigError> {
        // Numbers name no file.
        let texts = values.iter().filter(|value| value.number.is_none());
        let texts: Vec<String> = texts.map(|value| value.toml.clone()).collect();
        let settings = self.settings(case, &values);
        let sources = self.sources_of(case, texts, &settings, visit)?;
        let parts = std::iter::once(self.build.as_bytes());
        let parts = parts.chain(self.files[sources].iter().map(Vec::as_slice));
        let pairs = settings.iter().flat_map(|it| [&it.key, &it.value]);
        let key = RowKey::of(parts.chain(pairs.map(String::as_bytes)));
        self.points.push(PlannedPoint {
            values,
            case,
            sources,
            key,
        });
        Ok(())
    }

    /// Reads the files of points whose values are numbers, in each case: none of them names a file,
    /// and the scenario is valid without them. Returns the scenario of each case.
    pub(crate) fn read_files(&mut self) -> Result<Vec<Scenario>, RigError> {
        let mut scenarios = Vec::new();
        for case in 0..self.cases.len() {
            let settings = self.settings(case, &[]);
            self.sources_of(case, Vec::new(), &settings, &mut |scenario| {
                scenarios.push(scenario.clone());
            })?;
        }
        Ok(scenarios)
    }

    /// Assembles the scenario of each case without the values of a point, and reports its mistakes.
    pub(crate) fn check_scenario(&self) -> Result<(), RigError> {
        (0..self.cases.len()).try_for_each(|case| {
            let settings = self.settings(case, &[]);
            let assembly = Assembly::builder(self.registry)
                .settings(&settings)
                .sources(&self.on_disk);
            assembly.map(drop).map_err(|error| self.placed(case, error))
        })
    }

    /// Returns the index of the sources of points of a case with these texts among their values.
    fn sources_of(
        &mut self,
        case: usize,
        texts: Vec<String>,
        settings: &[Setting],
        visit: &mut dyn FnMut(&Scenario),
    ) -> Result<usize, RigError> {
        let of = (case, texts);
        if let Some(&index) = self.known.get(&of) {
            return Ok(index);
        }
        let read = self.on_disk.body(self.registry, settings);
        let (scenario, body) = read.map_err(|error| self.placed(case, error))?;
        self.parts.add(&scenario);
        visit(&scenario);
        self.files.push(bytes_of_files(&scenario, &body));
        self.sources.push(in_memory(&self.on_disk, &body));
        let index = self.sources.len() - 1;
        self.known.insert(of, index);
        Ok(index)
    }

    /// Reads the scenario with the values of a point, without a run.
    pub(crate) fn check_point(&self, index: usize) -> Result<(), RigError> {
        let (sources, settings) = self.run_of(index);
        let read = sources.read(self.registry, &settings);
        let case = self.points[index].case;
        read.map(drop).map_err(|error| self.placed(case, error))
    }

    /// Reads the scenario of a case with the value of one dimension alone.
    pub(crate) fn check_value(
        &self,
        case: usize,
        dimension: usize,
        value: &SweepValue,
    ) -> Result<(), RigError> {
        let key = &self.keys[dimension];
        let mut settings = self.settings(case, &[]);
        settings.push(Setting {
            origin: origin(key),
            key: key.clone(),
            value: value.toml.clone(),
        });
        let read = self.on_disk.read(self.registry, &settings);
        read.map(drop).map_err(|error| self.placed(case, error))
    }

    /// Returns the sources and the settings of a point.
    pub(crate) fn run_of(&self, index: usize) -> (&Sources, Vec<Setting>) {
        let point = &self.points[index];
        (
            &self.sources[point.sources],
            self.settings(point.case, &point.values),
        )
    }

    fn settings(&self, case: usize, values: &[SweepValue]) -> Vec<Setting> {
        let values = self.keys.iter().zip(values);
        let settings = values.map(|(key, value)| Setting {
            origin: origin(key),
            key: key.clone(),
            value: value.toml.clone(),
        });
        let given = self.base.iter().chain(&self.cases[case].settings);
        given.cloned().chain(settings).collect()
    }

    /// Returns origin and key of the settings of the dimensions.
    pub(crate) fn origins_and_keys(&self) -> Vec<(String, String)> {
        let keys = self.keys.iter();
        keys.map(|key| (origin(key), key.clone())).collect()
    }

    /// Returns the settings of all runs.
    pub(crate) fn base_pairs(&self) -> Vec<(String, String)> {
        let pair = |setting: &Setting| (setting.key.clone(), setting.value.clone());
        self.base.iter().map(pair).collect()
    }

    /// Returns an error about a value of a dimension at the key of the dimension, and one about a
    /// setting of the case at this setting.
    fn placed(&self, case: usize, error: RigError) -> RigError {
        let RigError::Document(DocumentError { mut problems }) = error else {
            return error;
        };
        for problem in &mut problems {
            let mut dimensions = self.keys.iter().zip(&self.given_keys);
            let found = dimensions.find(|(key, _)| problem.file == origin(key));
            let Some((_, given)) = found else {
                *problem = self.cases[case].named(problem.clone());
                continue;
            };
            let place = problem.place.as_ref();
            let value = place.map_or_else(String::new, |place| {
                format!(" (with {})", place.line_text())
            });
            *problem = self.cases[case].named(Problem::at(
                &given.place,
                format!("{}{value}", problem.message),
                problem.help.clone(),
            ));
        }
        RigError::Document(DocumentError { problems })
    }

    /// Returns the command that repeats the run of a point.
    pub(crate) fn command(&self, index: usize) -> String {
        let PlannedPoint { values, case, .. } = &self.points[index];
        self.command_of(*case, values)
    }

    /// Returns the command of a run of a case, which may lack the values of the last dimensions.
    pub(crate) fn command_of(&self, case: usize, values: &[SweepValue]) -> String {
        let mut command = format!("twin run {} --no-record", quoted(&self.file));
        for setting in self.settings(case, values) {
            let option = if setting.origin == PLANT {
                format!(" --plant {}", quoted(setting.value.trim_matches('"')))
            } else {
                set_option(&setting.key, &setting.value)
            };
            command += &option;
        }
        command
    }

    /// Returns the name of a point: `trot@seed-17`.
    pub(crate) fn name(&self, index: usize) -> String {
        let keys: Vec<&str> = self.keys.iter().map(String::as_str).collect();
        point_name(&self.file, &keys, &self.points[index].values)
    }
}

/// Returns the option of a command that sets a key, behind a space.
pub(crate) fn set_option(key: &str, value: &str) -> String {
    format!(" --set {}", quoted(&format!("{key}={value}")))
}

/// Origin of the setting of a dimension.
fn origin(key: &str) -> String {
    format!("[[dimension]] {key}")
}

/// Returns the robot file of the scenario, with the settings of all runs; none without a robot.
pub(crate) fn robot_file(
    registry: &Registry,
    request: &RunRequest<'_>,
) -> Result<Option<RobotFile>, RigError> {
    let document = Document::read(request.scenario)?;
    let folder = request.scenario.parent().unwrap_or(Path::new(""));
    let read = Sources::of(document, folder).read(registry, &base_settings(request));
    read.map(|(_, file)| file)
}

/// Returns the settings of all runs: those of the command line on top of those of the file, without
/// signals that only a recording requires unless they are recorded.
fn base_settings(request: &RunRequest<'_>) -> Vec<Setting> {
    let overridden = |key: &str| request.settings.iter().any(|it| overlap(&it.key, key));
    let set = request.set.iter().filter(|(key, _)| !overridden(key));
    // A setting is shown as a line that the file does not have.
    let origin = format!("`set` of {}", request.file);
    let mut base: Vec<Setting> = set
        .map(|(key, value)| Setting {
            origin: origin.clone(),
            key: key.clone(),
            value: value.clone(),
        })
        .collect();
    base.extend_from_slice(request.settings);
    let mut dimensions = request.keys.iter().map(|key| key.value.as_str());
    let is_set = base.iter().any(|it| overlap(&it.key, RECORDED))
        || dimensions.any(|key| overlap(key, RECORDED));
    if !request.recorded && !is_set {
        base.push(Setting {
            origin: request.file.to_owned(),
            key: RECORDED.to_owned(),
            value: "[]".to_owned(),
        });
    }
    base
}

/// Expectations of a scenario, those about other plants included.
pub(crate) fn expectations(scenario: &Scenario) -> impl Iterator<Item = &Expectation> {
    scenario
        .expectations
        .iter()
        .chain(&scenario.of_other_plants)
}
