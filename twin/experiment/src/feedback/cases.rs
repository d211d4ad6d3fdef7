//! Cases of a study of load feedback: sources of the load, and plants.

use std::path::Path;

use twinrig_kernel::SimDuration;
use twinrig_report::number::si;
use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::FeedbackOptions;
use super::load_observer::LoadSource;
use super::run::{check, feedback};
use super::task::{LoadRuns, LoadTask};
use crate::error::Error;
use crate::gait::scene::{Factor, GaitScene};
use crate::modulation::ModulationOptions;
use crate::modulation::cases::{ModulationCases, name};
use crate::options::request::{left_out, plants, stem};
use crate::progress::ProgressObserver;
use crate::runs::rounds::{RoundShare, StudyEngine};
use crate::{FeedbackCase, FeedbackInput, FeedbackPlan, FeedbackStudy, StudyError};

/// Process variable of the filter of the load.
const LOAD_LAG: &str = "load_lag";

/// Runs the cases of a study of load feedback.
pub(crate) struct FeedbackCases<'r> {
    input: FeedbackInput,
    /// Scenes of the cases, one each.
    modulation: ModulationCases<'r>,
    sources: Vec<LoadSource>,
}

impl<'r> FeedbackCases<'r> {
    /// Reads the scenarios of `options`, on each plant, and the first one with each lag.
    ///
    /// # Errors
    /// Errors of the first scenario on every plant; [`Error::NoGait`] without feedback.
    pub(crate) fn new(
        registry: &'r Registry,
        options: &FeedbackOptions,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let changes = changes(options);
        let mut found = Self {
            input: FeedbackInput {
                name: name(&options.scenarios),
                files: Vec::new(),
                cases: Vec::new(),
                left_out: Vec::new(),
            },
            modulation: ModulationCases::none(&changes),
            sources: Vec::new(),
        };
        let files = options.scenarios.iter();
        found.input.files = files.map(|path| path.display().to_string()).collect();
        let plants = plants(&options.common.plant);
        let mut refused = None;
        for plant in plants {
            let reference = found.input.cases.len();
            for (path, lag) in variants(options) {
                let name = stem(path);
                let source = match lag {
                    Some(lag) => format!("{name}, lag {}", si(lag.as_secs_f64(), "s")),
                    None => name,
                };
                let settings = settings.iter().cloned().chain(added(lag));
                let settings: Vec<Setting> = settings.collect();
                let scene = GaitScene::new(registry, path, &settings, plant);
                let added = scene.and_then(|scene| found.add(scene, &source, reference, &changes));
                if let Err(error) = added {
                    let left_out = left_out(&source, plant, &error);
                    found.input.left_out.push(left_out);
                    refused.get_or_insert(error);
                    if found.input.cases.len() == reference {
                        // Without the reference there is nothing to compare with.
                        break;
                    }
                }
            }
        }
        match refused {
            Some(error) if found.input.cases.is_empty() => Err(error),
            _ => Ok(found),
        }
    }

    fn add(
        &mut self,
        scene: GaitScene<'r>,
        source: &str,
        reference: usize,
        changes: &ModulationOptions,
    ) -> Result<(), Error> {
        let scenario = scene.scenario();
        let load = scenario
            .controller
            .as_ref()
            .map(|it| LoadSource::of(&it.options));
        let load = load.filter(|load| {
            let mut legs = scene.legs().iter();
            legs.all(|leg| scene.takes(&load.of_leg(&leg.name)))
        });
        let Some(load) = load else {
            let help = "choose `kind = \"tegotae\"` in [controller]";
            let why = "its controller takes no loads";
            return Err(Error::no_gait(&scenario.file, why, help));
        };
        let fore = scene.legs().iter().filter(|leg| leg.fore);
        let lag = scene.variables_called(LOAD_LAG);
        self.input.cases.push(FeedbackCase {
            plant: scenario.plant.model.clone(),
            source: source.to_owned(),
            signal: load.name.clone(),
            lag_s: lag.first().map_or(0.0, |variable| variable.value()),
            reference,
            fore: fore.map(|leg| leg.name.clone()).collect(),
            end: scenario.end(),
        });
        self.sources.push(load);
        self.modulation
            .add(scene, source, changes, &[Factor::AsGiven])
    }

    /// Returns the parameters of the study.
    ///
    /// # Errors
    /// A change that is not a quantity of the variable's unit.
    pub(crate) fn plan(&self, options: &FeedbackOptions) -> Result<FeedbackPlan, Error> {
        Ok(FeedbackPlan {
            after_s: options.after.as_secs_f64(),
            phases_s: options.phases.as_secs_f64(),
            modulation: self.modulation.plan(&changes(options))?,
        })
    }
}

impl FeedbackCases<'_> {
    /// Studies the cases by an engine.
    ///
    /// # Errors
    /// Errors of the engine, and of the study.
    pub(super) fn study(
        &self,
        plan: &FeedbackPlan,
        engine: &mut StudyEngine<'_>,
        observer: &mut dyn ProgressObserver,
    ) -> Result<Result<FeedbackStudy, StudyError>, Error> {
        let cases = self.input.cases.iter().zip(&self.sources).enumerate();
        let tasks = cases.map(|(scene, (case, source))| LoadTask {
            scene,
            source: source.clone(),
            lag_s: case.lag_s,
        });
        let tasks: Vec<LoadTask> = tasks.collect();
        engine.expect(tasks.len());
        let runs = LoadRuns(self.modulation.scenes());
        let runs = engine.round(&runs, &tasks, RoundShare::Every, observer)?;
        if let Err(error) = check(&runs) {
            return Ok(Err(error));
        }
        let modulation = match self.modulation.study(&plan.modulation, engine, observer)? {
            Ok(study) => Ok(study),
            // Without its remedy, which is that of a study of one case.
            Err(StudyError::Run(why)) => Err(why.lines().next().unwrap_or_default().to_owned()),
            Err(error) => return Ok(Err(error)),
        };
        let variable = &self.modulation.input().variable;
        Ok(Ok(feedback(
            &self.input,
            plan,
            variable,
            &runs,
            &modulation,
        )))
    }
}

/// Returns the scenarios, the first of which is repeated with each lag.
fn variants(options: &FeedbackOptions) -> Vec<(&Path, Option<SimDuration>)> {
    let files = options.scenarios.iter().map(|path| (path.as_path(), None));
    let first = options.scenarios.first();
    let lags = first.into_iter().flat_map(|path| {
        let lags = options.lag.iter();
        lags.map(move |lag| (path.as_path(), Some(*lag)))
    });
    files.chain(lags).collect()
}

/// Returns the settings of a case beside those of the user.
fn added(lag: Option<SimDuration>) -> impl Iterator<Item = Setting> {
    let setting = |key: &str, value: String| Setting {
        origin: "study".to_owned(),
        key: key.to_owned(),
        value,
    };
    let phases = setting("controller.phase_output", "true".to_owned());
    let lag = lag.map(|lag| setting("controller.load_lag", format!("\"{lag}\"")));
    std::iter::once(phases).chain(lag)
}

/// Returns the options of the changes of the step length.
fn changes(options: &FeedbackOptions) -> ModulationOptions {
    ModulationOptions {
        scenarios: options.scenarios.clone(),
        variable: None,
        by: options.by.clone(),
        after: None,
        points: options.points,
        steps: options.steps,
        factors: false,
        common: options.common.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::CommonOptions;

    #[test]
    fn plant_without_its_reference_is_left_out_once() {
        let scenario = "/../../scenarios/tegotae-trot.toml";
        let options = FeedbackOptions {
            scenarios: vec![(env!("CARGO_MANIFEST_DIR").to_owned() + scenario).into()],
            lag: vec![SimDuration::from_millis(5)],
            by: Vec::new(),
            after: SimDuration::from_secs(1),
            phases: SimDuration::from_secs(1),
            points: 1,
            steps: 1,
            common: CommonOptions {
                plant: ["massless", "none"].map(str::to_owned).into(),
                out: "studies".into(),
                ..CommonOptions::default()
            },
        };
        let registry = Registry::standard();
        let cases = FeedbackCases::new(&registry, &options, &[]);
        let input = cases.unwrap().input;
        assert_eq!(input.left_out.len(), 1, "{:?}", input.left_out);
        let lags = input.cases.iter().map(|case| case.lag_s);
        assert!(lags.eq([0.0, 5e-3]));
        assert_eq!(input.cases[0].fore, ["LF", "RF"]);
    }
}
