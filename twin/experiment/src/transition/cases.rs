//! Cases of a study of gait transitions: plants and lengths of plateaus.

use twinrig_gait::{Corner, Gait};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_rig::registry::Registry;
use twinrig_runtime::{Change, ProcessVariable};
use twinrig_scenario::{ChangeSpec, LegFact, Scenario, Setting};

use super::TransitionOptions;
use crate::error::Error;
use crate::gait::scene::{Factor, GaitScene, base};
use crate::gait::task::{GaitRuns, GaitTask};
use crate::options::request::{left_out, plants, stem};
use crate::{GaitPattern, TransitionCase, TransitionInput};

/// All legs in phase: no gait of the controllers, but one that a robot may fall into.
const PRONK: &str = "pronk";

/// Runs the cases of a study of transitions.
pub(crate) struct TransitionCases<'r> {
    input: TransitionInput,
    scenes: Vec<GaitScene<'r>>,
    /// Index of the scene of each case, and its changes.
    cases: Vec<(usize, Vec<ChangeSpec>)>,
}

impl<'r> TransitionCases<'r> {
    /// Reads the scenario of `options`, on its own plant or on those of `options`.
    ///
    /// # Errors
    /// Errors of the scenario; [`Error::NoGait`] if no variable changes.
    pub(crate) fn new(
        registry: &'r Registry,
        options: &TransitionOptions,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let plants = plants(&options.common.plant);
        let path = &options.scenario;
        let mut found: Option<Self> = None;
        let (mut omitted, mut refused) = (Vec::new(), None);
        for plant in &plants {
            let scene = match GaitScene::new(registry, path, settings, *plant) {
                Ok(scene) => scene,
                Err(error) => {
                    omitted.push(left_out(&stem(path), *plant, &error));
                    refused.get_or_insert(error);
                    continue;
                }
            };
            let cases = match &mut found {
                Some(cases) => cases,
                None => found.insert(Self::of(&scene, options)?),
            };
            cases.add(scene, options);
        }
        match (found, refused) {
            (Some(mut found), _) => {
                found.input.left_out = omitted;
                Ok(found)
            }
            (None, Some(error)) => Err(error),
            // There is a plant, or the scenario's own.
            (None, None) => {
                let (file, help) = (path.display().to_string(), "name one by --plant");
                Err(Error::no_gait(&file, "there is no plant", help))
            }
        }
    }

    fn of(scene: &GaitScene<'_>, options: &TransitionOptions) -> Result<Self, Error> {
        let scenario = scene.scenario();
        let mut changes = scenario.changes.iter().map(|it| it.variable.as_str());
        let named = options.variable.as_deref();
        let changed = changes.find(|it| named.is_none_or(|name| [*it, base(it)].contains(&name)));
        let Some(changed) = changed else {
            return Err(unchanged(scenario, named));
        };
        let mut variables = scene.variables().iter();
        let variable = variables.find(|it| it.name() == changed);
        Ok(Self {
            input: TransitionInput {
                name: scenario.name.clone(),
                file: scenario.file.clone(),
                variable: changed.to_owned(),
                unit: variable.map_or(Unit::One, ProcessVariable::unit),
                patterns: patterns(scene.legs()),
                cases: Vec::new(),
                left_out: Vec::new(),
            },
            scenes: Vec::new(),
            cases: Vec::new(),
        })
    }

    /// Adds a case for each length of the plateaus.
    fn add(&mut self, scene: GaitScene<'r>, options: &TransitionOptions) {
        let scenario = scene.scenario();
        let own = plateau(scenario, &self.input.variable);
        let lengths = match &*options.plateau {
            [] => vec![own],
            lengths => lengths.to_vec(),
        };
        for length in lengths {
            let scaled = |at: SimDuration| scaled(at, length, own);
            let changes: Vec<ChangeSpec> = scenario
                .changes
                .iter()
                .map(|change| ChangeSpec {
                    at: SimTime::ZERO + scaled(change.at.since_start()),
                    ..change.clone()
                })
                .collect();
            self.input.cases.push(TransitionCase {
                plant: scenario.plant.model.clone(),
                plateau_s: length.as_secs_f64(),
                values: values(&scene, &changes, &self.input.variable),
                end: SimTime::ZERO + scaled(scenario.duration),
            });
            self.cases.push((self.scenes.len(), changes));
        }
        self.scenes.push(scene);
    }
}

impl TransitionCases<'_> {
    pub(super) fn input(&self) -> &TransitionInput {
        &self.input
    }

    /// Returns the runs of the cases.
    pub(super) fn runs(&self) -> (GaitRuns<'_, '_>, Vec<GaitTask>) {
        let cases = self.input.cases.iter().zip(&self.cases);
        let tasks = cases.map(|(case, (scene, changes))| {
            GaitTask::new(*scene, Factor::AsGiven, changes.clone(), case.end)
        });
        (GaitRuns(&self.scenes), tasks.collect())
    }
}

/// Returns the error of a scenario that does not change the variable `named`, or any.
fn unchanged(scenario: &Scenario, named: Option<&str>) -> Error {
    let why = match named {
        Some(name) => format!("the scenario does not change `{name}`"),
        None => "the scenario changes no variable".to_owned(),
    };
    let mut changed: Vec<&str> = scenario.changes.iter().map(|it| &*it.variable).collect();
    changed.sort_unstable();
    changed.dedup();
    let help = match changed[..] {
        [] => "add a table `[[change]]` with `every`, which changes a variable in steps".to_owned(),
        _ => format!("it changes `{}`", changed.join("`, `")),
    };
    Error::no_gait(&scenario.file, why, help)
}

/// Returns the median time between two changes of a variable, or the time of the only one.
fn plateau(scenario: &Scenario, variable: &str) -> SimDuration {
    let changes = scenario.changes.iter();
    let changes = changes.filter(|change| change.variable == variable);
    let times: Vec<SimTime> = changes.map(|change| change.at).collect();
    let mut lengths: Vec<SimDuration> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    lengths.sort_unstable();
    let first = || times.first().map(|at| at.since_start());
    let middle = lengths.get(lengths.len() / 2).copied().or_else(first);
    // A change at the start has no plateau before it.
    let middle = middle.filter(|length| !length.is_zero());
    middle.unwrap_or(scenario.duration)
}

/// Returns a time on a scale on which `own` is `length`.
fn scaled(at: SimDuration, length: SimDuration, own: SimDuration) -> SimDuration {
    let [at, length, own] = [at, length, own].map(|it| u128::from(it.as_nanos()));
    let nanos = at * length / own.max(1);
    SimDuration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
}

/// Returns the values of a variable, each with the time from which it applies \[s\].
fn values(scene: &GaitScene<'_>, changes: &[ChangeSpec], variable: &str) -> Vec<[f64; 2]> {
    let mut variables = scene.variables().iter();
    let first = variables.find(|it| it.name() == variable);
    let mut value = first.map_or(0.0, ProcessVariable::value);
    let mut values = vec![[0.0, value]];
    for change in changes.iter().filter(|change| change.variable == variable) {
        value = match change.change {
            Change::To(to) => to,
            Change::By(by) => value + by,
        };
        values.push([change.at.as_secs_f64(), value]);
    }
    values
}

/// Returns the patterns of the gaits of the controllers, each with its mirror image where that
/// differs.
fn patterns(legs: &[LegFact]) -> Vec<GaitPattern> {
    let phases = |gait: Gait, mirrored: bool| -> Vec<f64> {
        let phase = |leg: &LegFact| {
            let corner = Corner {
                fore: leg.fore,
                left: leg.left != mirrored,
            };
            // A leg with a greater phase of its oscillator touches down earlier.
            -gait.phase_difference(corner) / std::f64::consts::TAU
        };
        legs.iter().map(phase).collect()
    };
    let gaits = Gait::ALL.into_iter().flat_map(|gait| {
        [false, true].map(|mirrored| GaitPattern {
            name: gait.name().to_owned(),
            phases: phases(gait, mirrored),
        })
    });
    let pronk = GaitPattern {
        name: PRONK.to_owned(),
        phases: vec![0.0; legs.len()],
    };
    gaits.chain([pronk]).collect()
}
