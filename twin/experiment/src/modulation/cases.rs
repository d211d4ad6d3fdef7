//! Cases of a study of footstep modulation: gaits, plants and factors.

use std::path::PathBuf;

use twinrig_document::parse_quantity;
use twinrig_gait::DutyRule;
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_rig::parts::gaits::duty_rule;
use twinrig_rig::registry::Registry;
use twinrig_runtime::Change;
use twinrig_scenario::{ChangeSpec, Setting};

use super::ModulationOptions;
use super::{
    Modulation, ModulationCase, ModulationInput, ModulationPlan, ModulationRun, ModulationStudy,
};
use crate::error::{Error, StudyError};
use crate::gait::scene::{Factor, GaitScene, base};
use crate::gait::task::{GaitRuns, GaitTask};
use crate::options::request::{left_out, plants, stem};
use crate::progress::ProgressObserver;
use crate::runs::rounds::{RoundShare, StudyEngine};

/// Variable of a scenario without changes.
const STEP_LENGTH: &str = "step_length";
/// Time at which the gaits of scenarios without changes are in their limit cycle.
const LIMIT_CYCLE: SimDuration = SimDuration::from_secs(8);
/// Variable whose mean sets the commanded stance share.
const DUTY_FACTOR: &str = "duty_factor";

/// Runs the cases of a study of modulation.
pub(crate) struct ModulationCases<'r> {
    input: ModulationInput,
    scenes: Vec<GaitScene<'r>>,
    cases: Vec<SceneCase>,
}

/// A case as its scene runs it.
struct SceneCase {
    /// Index of the scene.
    scene: usize,
    factor: Factor,
    /// Full names of the changed variables.
    variables: Vec<String>,
}

/// Variable of a scenario that changes, and time at which its gait is in the limit cycle.
struct Subject {
    /// Name without the legs.
    name: String,
    /// Full names.
    variables: Vec<String>,
    unit: Unit,
    value: f64,
    after: SimTime,
}

impl<'r> ModulationCases<'r> {
    /// Reads the scenarios of `options`, each on its own plant or on those of `options`.
    ///
    /// # Errors
    /// Errors of a scenario, and a variable that it does not have.
    pub(crate) fn new(
        registry: &'r Registry,
        options: &ModulationOptions,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let plants = plants(&options.common.plant);
        let several = options.scenarios.len() * plants.len() > 1;
        let factors: &[Factor] = if options.factors || several {
            &[
                Factor::AsGiven,
                Factor::UnsaturatedServos,
                Factor::NoFeedback,
            ]
        } else {
            &[Factor::AsGiven]
        };
        let mut found = Self::none(options);
        let mut refused = None;
        for path in &options.scenarios {
            found.input.files.push(path.display().to_string());
            for plant in &plants {
                let scene = match GaitScene::new(registry, path, settings, *plant) {
                    Ok(scene) => scene,
                    Err(error) => {
                        let left_out = left_out(&stem(path), *plant, &error);
                        found.input.left_out.push(left_out);
                        refused.get_or_insert(error);
                        continue;
                    }
                };
                found.add(scene, &stem(path), options, factors)?;
            }
        }
        // A plant that cannot simulate one of several scenarios is no error of all.
        match refused {
            Some(error) if found.cases.is_empty() => Err(error),
            _ => Ok(found),
        }
    }

    /// Creates a study of `options` without cases.
    pub(crate) fn none(options: &ModulationOptions) -> Self {
        Self {
            input: ModulationInput {
                name: name(&options.scenarios),
                files: Vec::new(),
                variable: String::new(),
                unit: Unit::One,
                cases: Vec::new(),
                left_out: Vec::new(),
            },
            scenes: Vec::new(),
            cases: Vec::new(),
        }
    }

    /// Returns the scenes, in the order in which they were added.
    pub(crate) fn scenes(&self) -> &[GaitScene<'r>] {
        &self.scenes
    }

    /// Adds a case of `gait` for each factor that makes a difference.
    ///
    /// # Errors
    /// [`Error::NoGait`] if the controller does not have the variable.
    pub(crate) fn add(
        &mut self,
        scene: GaitScene<'r>,
        gait: &str,
        options: &ModulationOptions,
        factors: &[Factor],
    ) -> Result<(), Error> {
        let subject = Subject::of(&scene, options)?;
        if self.cases.is_empty() {
            self.input.variable.clone_from(&subject.name);
            self.input.unit = subject.unit;
        }
        let duties = scene.variables_called(DUTY_FACTOR);
        let duty: f64 = duties.iter().map(|variable| variable.value()).sum();
        let rule = scene.scenario().controller.as_ref();
        let rule = rule.map_or(DutyRule::default(), |it| duty_rule(&it.options));
        let duty = (!duties.is_empty()).then(|| rule.stance_share(duty / duties.len() as f64));
        for factor in factors.iter().filter(|factor| scene.has(**factor)) {
            self.input.cases.push(ModulationCase {
                gait: gait.to_owned(),
                plant: scene.scenario().plant.model.clone(),
                factor: factor.name().to_owned(),
                after: subject.after,
                value: subject.value,
                duty,
            });
            self.cases.push(SceneCase {
                scene: self.scenes.len(),
                factor: *factor,
                variables: subject.variables.clone(),
            });
        }
        self.scenes.push(scene);
        Ok(())
    }

    /// Returns the parameters of the study.
    ///
    /// # Errors
    /// A change that is not a quantity of the variable's unit, or none for a variable that is not
    /// a length.
    pub(crate) fn plan(&self, options: &ModulationOptions) -> Result<ModulationPlan, Error> {
        let refused = |why: String, help: &str| {
            let file = self.input.files.first().map_or("", String::as_str);
            Error::no_gait(file, why, help)
        };
        let unit = self.input.unit;
        let plan = ModulationPlan {
            points: options.points,
            steps: options.steps,
            ..ModulationPlan::default()
        };
        if options.by.is_empty() {
            if unit == Unit::Meter {
                return Ok(plan);
            }
            let variable = &self.input.variable;
            let why = format!("the changes of the thesis are lengths, and `{variable}` is not");
            return Err(refused(why, "give the changes by --by"));
        }
        let changes = options.by.iter().map(|text| {
            parse_quantity(text, unit).map_err(|error| {
                let why = format!("--by {text}: {error}");
                refused(why, "give quantities with units: --by=\"-5 mm,-10 mm\"")
            })
        });
        let changes: Vec<f64> = changes.collect::<Result<_, _>>()?;
        for (index, change) in changes.iter().enumerate() {
            if changes[..index].contains(change) {
                let why = format!("--by has the change {} twice", options.by[index]);
                return Err(refused(why, "give it once"));
            }
        }
        Ok(ModulationPlan { changes, ..plan })
    }
}

impl Subject {
    fn of(scene: &GaitScene<'_>, options: &ModulationOptions) -> Result<Self, Error> {
        let scenario = scene.scenario();
        let named = options.variable.as_deref();
        let is_studied = |it: &&ChangeSpec| {
            named.is_none_or(|name| [&*it.variable, base(&it.variable)].contains(&name))
        };
        let first = scenario.changes.iter().find(is_studied);
        let name = named.or(first.map(|it| base(&it.variable)));
        let name = name.unwrap_or(STEP_LENGTH);
        let variables = match (named, first) {
            // The legs that the scenario changes.
            (None, Some(first)) => {
                let changes = scenario.changes.iter().filter(|it| it.at == first.at);
                let names = changes.map(|it| it.variable.as_str());
                let names: Vec<&str> = names.filter(|it| base(it) == name).collect();
                let all = scene.variables().iter();
                all.filter(|it| names.contains(&it.name())).collect()
            }
            _ => scene.variables_called(name),
        };
        let Some(one) = variables.first() else {
            let kind = scenario.controller.as_ref().map_or("", |it| &it.kind);
            let why = format!("the controller `{kind}` has no variable `{name}`");
            let help = "choose one by --variable; `twin list` has them";
            return Err(Error::no_gait(&scenario.file, why, help));
        };
        let sum: f64 = variables.iter().map(|variable| variable.value()).sum();
        let after = options.after.map(|after| SimTime::ZERO + after);
        let after = after.or(first.map(|change| change.at));
        Ok(Self {
            name: name.to_owned(),
            unit: one.unit(),
            value: sum / variables.len() as f64,
            variables: variables.iter().map(|it| it.name().to_owned()).collect(),
            after: after.unwrap_or(SimTime::ZERO + LIMIT_CYCLE),
        })
    }
}

impl ModulationCases<'_> {
    pub(crate) fn input(&self) -> &ModulationInput {
        &self.input
    }

    /// Studies the cases by an engine.
    ///
    /// # Errors
    /// Errors of the engine, and of the study.
    pub(crate) fn study(
        &self,
        plan: &ModulationPlan,
        engine: &mut StudyEngine<'_>,
        observer: &mut dyn ProgressObserver,
    ) -> Result<Result<ModulationStudy, StudyError>, Error> {
        let runs = GaitRuns(&self.scenes);
        let tasks = |runs: Vec<ModulationRun>| -> Vec<GaitTask> {
            runs.into_iter().map(|run| self.task(run)).collect()
        };
        let references = tasks(Modulation::references(&self.input));
        engine.expect(references.len() + Modulation::reruns(&self.input, plan));
        let references = engine.round(&runs, &references, RoundShare::Every, observer)?;
        let modulation = match Modulation::new(&self.input, plan, references) {
            Ok(modulation) => modulation,
            Err(error) => return Ok(Err(error)),
        };
        let changed = tasks(modulation.changed());
        let changed = engine.round(&runs, &changed, RoundShare::Partition, observer)?;
        Ok(Ok(modulation.finish(changed)))
    }

    /// Returns a run as a task.
    fn task(&self, run: ModulationRun) -> GaitTask {
        let ModulationRun { case, change, end } = run;
        let case = &self.cases[case];
        let own = self.scenes[case.scene].scenario().changes.iter();
        // A gait that starts by changes of other variables keeps them.
        let mut changes: Vec<ChangeSpec> = own
            .filter(|it| !case.variables.contains(&it.variable) && it.at < end)
            .cloned()
            .collect();
        changes.extend(change.into_iter().flat_map(|change| {
            case.variables.iter().map(move |variable| ChangeSpec {
                at: change.at,
                variable: variable.clone(),
                change: Change::By(change.by),
            })
        }));
        GaitTask::new(case.scene, case.factor, changes, end)
    }
}

/// Returns the names of several.
pub(crate) fn name(scenarios: &[PathBuf]) -> String {
    let names: Vec<String> = scenarios.iter().map(|path| stem(path)).collect();
    names.join(", ")
}
