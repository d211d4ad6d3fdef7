//! Plan of a sweep: its points, with the settings and the key of each run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use twinrig_campaign::sweep::{
    ResultDimension, RowKey, SweepSpec, SweepValue, VERDICT_SHARE, overlap,
};
use twinrig_document::{Document, DocumentError, Problem, Warning, suggestion};
use twinrig_kernel::Unit;
use twinrig_scenario::{Expectation, Scenario, Setting};

use crate::assembly::body::Body;
use crate::assembly::registry::Registry;
use crate::assembly::sources::Sources;
use crate::error::TwinError;
use crate::sweep::build_key::BuildKey;
use crate::sweep::keys;
use crate::sweep::parts::UsedParts;

/// Signals that nothing but a recording requires; by default a sweep records nothing.
const RECORDED: &str = "record.signals";
/// Origin of the option `--plant`.
const PLANT: &str = "--plant";

/// A planned sweep.
pub(crate) struct SweepPlan<'r> {
    pub(crate) registry: &'r Registry,
    pub(crate) spec: SweepSpec,
    /// Name of the scenario.
    pub(crate) scenario: String,
    /// File of the scenario, as given.
    pub(crate) file: String,
    pub(crate) build: BuildKey,
    pub(crate) warnings: Vec<Warning>,
    /// Settings of all runs.
    base: Vec<Setting>,
    /// Dotted keys of the dimensions.
    keys: Vec<String>,
    pub(crate) points: Vec<PlannedPoint>,
    /// Sources of the runs, in memory.
    pub(crate) sources: Vec<Sources>,
    /// Kinds of parts of all runs.
    pub(crate) parts: UsedParts,
}

/// Point of a planned sweep.
pub(crate) struct PlannedPoint {
    pub(crate) values: Vec<SweepValue>,
    /// Index of its sources.
    pub(crate) sources: usize,
    pub(crate) key: RowKey,
}

impl<'r> SweepPlan<'r> {
    /// Reads scenario, specification and all other files, and checks them as far as that is
    /// possible without a run. Signals that only a recording requires are computed if `recorded`.
    pub(crate) fn new(
        registry: &'r Registry,
        scenario: &Path,
        spec: &Path,
        settings: &[Setting],
        recorded: bool,
    ) -> Result<Self, TwinError> {
        let spec = SweepSpec::read(&Document::read(spec)?)?;
        let document = Document::read(scenario)?;
        let folder = scenario.parent().unwrap_or(Path::new(""));
        let on_disk = Sources::of(document, folder);
        let base = base_settings(&spec, settings, recorded);
        let (read, body) = on_disk.body(registry, &base)?;
        let keys = keys::resolved(&spec, registry, &read, body.robot())?;
        let build = registry.build()?;
        let mut plan = Self {
            registry,
            scenario: read.name,
            file: read.file,
            build,
            warnings: read.warnings,
            base,
            keys,
            points: Vec::new(),
            sources: Vec::new(),
            parts: UsedParts::default(),
            spec,
        };
        let known = plan.add_points(&on_disk, build.as_bytes())?;
        plan.check_extremes()?;
        check_shares(&plan.spec, &known)?;
        Ok(plan)
    }

    /// Adds the points, and reads the files of each combination of values that may name files,
    /// once; returns the names of all expectations.
    fn add_points(
        &mut self,
        on_disk: &Sources,
        build: &[u8],
    ) -> Result<BTreeSet<String>, TwinError> {
        let mut names = BTreeSet::new();
        let mut known: BTreeMap<Vec<String>, usize> = BTreeMap::new();
        let mut files: Vec<Vec<Vec<u8>>> = Vec::new();
        for values in self.spec.points() {
            // Numbers name no file.
            let texts = values.iter().filter(|value| value.number.is_none());
            let texts: Vec<String> = texts.map(|value| value.toml.clone()).collect();
            let settings = self.settings(&values);
            let sources = if let Some(&index) = known.get(&texts) {
                index
            } else {
                let read = on_disk.body(self.registry, &settings);
                let (scenario, body) = read.map_err(|error| self.placed(error))?;
                self.parts.add(&scenario);
                names.extend(expectations(&scenario).map(|one| one.name.clone()));
                files.push(bytes_of_files(&scenario, &body));
                self.sources.push(in_memory(on_disk, &body));
                known.insert(texts, files.len() - 1);
                files.len() - 1
            };
            let parts = std::iter::once(build);
            let parts = parts.chain(files[sources].iter().map(Vec::as_slice));
            let pairs = settings.iter().flat_map(|it| [&it.key, &it.value]);
            let key = RowKey::of(parts.chain(pairs.map(String::as_bytes)));
            self.points.push(PlannedPoint {
                values,
                sources,
                key,
            });
        }
        Ok(names)
    }

    /// Reads the scenario with the least and the greatest value of each dimension, so that a value
    /// out of range is an error before the runs.
    fn check_extremes(&self) -> Result<(), TwinError> {
        let mut checked = BTreeSet::new();
        for dimension in 0..self.keys.len() {
            let number = |point: &&PlannedPoint| point.values[dimension].number;
            let by_number = |one: &&PlannedPoint, other: &&PlannedPoint| {
                number(one)
                    .partial_cmp(&number(other))
                    .unwrap_or(std::cmp::Ordering::Equal)
            };
            let least = self.points.iter().min_by(by_number);
            let greatest = self.points.iter().max_by(by_number);
            for point in least.into_iter().chain(greatest) {
                if checked.insert(point.key) {
                    let sources = &self.sources[point.sources];
                    let read = sources.read(self.registry, &self.settings(&point.values));
                    read.map_err(|error| self.placed(error))?;
                }
            }
        }
        Ok(())
    }

    /// Returns the sources and the settings of a point.
    pub(crate) fn run_of(&self, index: usize) -> (&Sources, Vec<Setting>) {
        let point = &self.points[index];
        (&self.sources[point.sources], self.settings(&point.values))
    }

    fn settings(&self, values: &[SweepValue]) -> Vec<Setting> {
        let values = self.keys.iter().zip(values);
        let settings = values.map(|(key, value)| Setting {
            origin: origin(key),
            key: key.clone(),
            value: value.toml.clone(),
        });
        self.base.iter().cloned().chain(settings).collect()
    }

    /// Returns origin, key and value of the settings of all runs.
    pub(crate) fn shared_settings(&self) -> Vec<(String, String, String)> {
        let base = self.base.iter().cloned();
        base.map(|it| (it.origin, it.key, it.value)).collect()
    }

    /// Returns origin and key of the settings of the dimensions.
    pub(crate) fn origins_and_keys(&self) -> Vec<(String, String)> {
        let keys = self.keys.iter();
        keys.map(|key| (origin(key), key.clone())).collect()
    }

    /// Returns the settings of all runs.
    pub(crate) fn base(&self) -> Vec<(String, String)> {
        let pair = |setting: &Setting| (setting.key.clone(), setting.value.clone());
        self.base.iter().map(pair).collect()
    }

    /// Returns an error about a value of a dimension at the key of the dimension.
    fn placed(&self, error: TwinError) -> TwinError {
        let TwinError::Document(DocumentError { mut problems }) = error else {
            return error;
        };
        for problem in &mut problems {
            let mut dimensions = self.keys.iter().zip(&self.spec.dimensions);
            let found = dimensions.find(|(key, _)| problem.file == origin(key));
            let Some((_, dimension)) = found else {
                continue;
            };
            let place = problem.place.as_ref();
            let value = place.map_or_else(String::new, |place| {
                format!(" (with {})", place.line_text())
            });
            *problem = Problem::at(
                &dimension.key.place,
                format!("{}{value}", problem.message),
                problem.help.clone(),
            );
        }
        TwinError::Document(DocumentError { problems })
    }

    /// Returns the dimensions with the units of their numbers.
    pub(crate) fn dimensions(&self) -> Vec<ResultDimension> {
        let unit = |index: usize| {
            let mut units = self.points.iter().map(|point| {
                let value = &point.values[index];
                value.number.map(|_| value.unit)
            });
            let first: Option<Unit> = units.next().flatten();
            units.all(|unit| unit == first).then_some(first).flatten()
        };
        let dimensions = self.keys.iter().enumerate();
        dimensions
            .map(|(index, key)| ResultDimension {
                key: key.clone(),
                unit: unit(index),
            })
            .collect()
    }

    /// Returns the command that repeats the run of a point.
    pub(crate) fn command(&self, index: usize) -> String {
        let mut words = vec![
            "twin run".to_owned(),
            quoted(&self.file),
            "--no-record".to_owned(),
        ];
        for setting in self.settings(&self.points[index].values) {
            words.push(if setting.origin == PLANT {
                format!("--plant {}", quoted(setting.value.trim_matches('"')))
            } else {
                format!(
                    "--set {}",
                    quoted(&format!("{}={}", setting.key, setting.value))
                )
            });
        }
        words.join(" ")
    }

    /// Returns the name of a point: `trot@seed-17`.
    pub(crate) fn name(&self, index: usize) -> String {
        let stem = Path::new(&self.file).file_stem();
        let stem = stem.map_or_else(|| self.file.clone().into(), |stem| stem.to_string_lossy());
        let values = self.keys.iter().zip(&self.points[index].values);
        let values = values.map(|(key, value)| {
            let last = key.rsplit('.').next().unwrap_or(key);
            let ends = |other: &&String| other.rsplit('.').next() == Some(last);
            let key = match self.keys.iter().filter(ends).count() {
                1 => last,
                _ => key,
            };
            format!("{key}-{}", value.shown().replace(' ', ""))
        });
        format!("{stem}@{}", values.collect::<Vec<_>>().join(","))
    }
}

/// Origin of the setting of a dimension.
fn origin(key: &str) -> String {
    format!("[[dimension]] {key}")
}

/// Returns the settings of all runs: those of the command line on top of those of the
/// specification, without signals that only a recording requires unless `recorded`.
fn base_settings(spec: &SweepSpec, settings: &[Setting], recorded: bool) -> Vec<Setting> {
    let overridden = |key: &str| settings.iter().any(|it| overlap(&it.key, key));
    let set = spec.set.iter().filter(|(key, _)| !overridden(key));
    let mut base: Vec<Setting> = set
        .map(|(key, value)| Setting {
            origin: spec.file.clone(),
            key: key.clone(),
            value: value.clone(),
        })
        .collect();
    base.extend_from_slice(settings);
    let mut dimensions = spec.dimensions.iter().map(|it| it.key.value.as_str());
    let is_set = base.iter().any(|it| overlap(&it.key, RECORDED))
        || dimensions.any(|key| overlap(key, RECORDED));
    if !recorded && !is_set {
        base.push(Setting {
            origin: spec.file.clone(),
            key: RECORDED.to_owned(),
            value: "[]".to_owned(),
        });
    }
    base
}

/// Expectations of a scenario, those about other plants included.
fn expectations(scenario: &Scenario) -> impl Iterator<Item = &Expectation> {
    scenario
        .expectations
        .iter()
        .chain(&scenario.of_other_plants)
}

/// Returns the contents of all files that a run depends on.
fn bytes_of_files(scenario: &Scenario, body: &Body) -> Vec<Vec<u8>> {
    let robot = body.robot_file().map_or("", |(_, text)| text);
    let mut bytes = vec![
        scenario.text.clone().into_bytes(),
        robot.as_bytes().to_vec(),
    ];
    for (name, content) in body.files() {
        bytes.extend([name.into_bytes(), content]);
    }
    bytes
}

/// Returns the same sources without files.
fn in_memory(on_disk: &Sources, body: &Body) -> Sources {
    Sources {
        robot: body.robot_file().map(|(_, text)| text.to_owned()),
        kept: Some(body.files()),
        ..Sources::of(on_disk.document.clone(), &on_disk.folder)
    }
}

/// Checks that every asserted share is about an expectation of the scenario.
fn check_shares(spec: &SweepSpec, known: &BTreeSet<String>) -> Result<(), TwinError> {
    let mut problems = Vec::new();
    for share in &spec.shares {
        let name = &share.of.value;
        if name != VERDICT_SHARE && !known.contains(name) {
            let names = known.iter().map(String::as_str);
            let names = names.chain(std::iter::once(VERDICT_SHARE));
            problems.push(Problem::at(
                &share.of.place,
                format!("no run has an expectation `{name}`"),
                suggestion(name, "expectations", names),
            ));
        }
    }
    if problems.is_empty() {
        Ok(())
    } else {
        Err(DocumentError { problems }.into())
    }
}

/// Returns a word for a POSIX shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}
