//! Runs of a study of robustness: scenarios, each on a plant, from perturbed starts.

use std::path::{Path, PathBuf};

use twinrig_kernel::Unit;
use twinrig_rig::error::guarded;
use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::options::RobustnessOptions;
use super::results::RobustnessStudy;
use super::run::Robustness;
use super::task::{MemberRuns, MemberScene, MemberTask, positions};
use super::{RobustnessCase, RobustnessPlan};
use crate::error::{Error, StudyError};
use crate::options::request::{left_out, plants};
use crate::progress::ProgressObserver;
use crate::runs::rounds::{RoundShare, StudyEngine};
use crate::runs::scene::RunScene;

/// Scenarios on plants.
pub(crate) struct RobustnessCases<'r> {
    ensembles: Vec<MemberScene<'r>>,
    cases: Vec<RobustnessCase>,
    /// Scenario file of each case, and its plant if it is not that of the file.
    files: Vec<(PathBuf, Option<String>)>,
    left_out: Vec<String>,
    runs: usize,
}

impl<'r> RobustnessCases<'r> {
    /// Reads the scenarios; one that a plant cannot simulate is left out.
    ///
    /// # Errors
    /// The error of the first of them, if all are left out.
    pub(crate) fn new(
        registry: &'r Registry,
        options: &RobustnessOptions,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let mut cases = Self {
            ensembles: Vec::new(),
            cases: Vec::new(),
            files: Vec::new(),
            left_out: Vec::new(),
            runs: options.ensemble,
        };
        let mut first_error = None;
        for path in &options.scenarios {
            for plant in plants(&options.common.plant) {
                if let Err(error) = cases.add(registry, path, settings, plant) {
                    let name = path.display().to_string();
                    cases.left_out.push(left_out(&name, plant, &error));
                    first_error.get_or_insert(error);
                }
            }
        }
        match first_error {
            Some(error) if cases.cases.is_empty() => Err(error),
            _ => Ok(cases),
        }
    }

    pub(crate) fn plan(options: &RobustnessOptions) -> RobustnessPlan {
        RobustnessPlan {
            runs: options.ensemble,
            tolerance: options.tolerance,
        }
    }

    fn add(
        &mut self,
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        plant: Option<&str>,
    ) -> Result<(), Error> {
        let name = path.display().to_string();
        let read = guarded(&name, || RunScene::read(registry, path, settings, plant));
        let (files, assembly) = read?;
        let positions = positions(&assembly);
        let scene = MemberScene::new(files, &assembly, self.runs)?;
        let ensemble = scene.ensemble();
        let scenario = ensemble.assembly().scenario();
        let (kind, why_seeds) = (ensemble.kind(), ensemble.why_seeds().map(str::to_owned));
        let has = |unit| positions.iter().any(|(_, it)| *it == unit);
        self.cases.push(RobustnessCase {
            scenario: scenario.name.clone(),
            file: scenario.file.clone(),
            plant: scenario.plant.model.clone(),
            kind,
            why_seeds,
            unit: [Unit::Meter, Unit::Radian]
                .into_iter()
                .find(|unit| has(*unit))
                .map(|unit| unit.symbol().to_owned()),
            duration_s: scenario.duration.as_secs_f64(),
        });
        self.ensembles.push(scene);
        self.files.push((path.to_owned(), plant.map(str::to_owned)));
        Ok(())
    }

    /// Returns the scenario file of each case, and its plant if it is not that of the file.
    pub(crate) fn files(&self) -> &[(PathBuf, Option<String>)] {
        &self.files
    }
}

impl RobustnessCases<'_> {
    /// Studies the cases by an engine, one ensemble after the other.
    ///
    /// # Errors
    /// Errors of the engine, and of the study.
    pub(super) fn study(
        &self,
        plan: &RobustnessPlan,
        engine: &mut StudyEngine<'_>,
        observer: &mut dyn ProgressObserver,
    ) -> Result<Result<RobustnessStudy, StudyError>, Error> {
        let mut study = Robustness::new(plan, &self.left_out);
        let mut left = 0;
        engine.expect(self.cases.len() * plan.runs);
        let runs = MemberRuns(&self.ensembles);
        for (scene, case) in self.cases.iter().enumerate() {
            let tasks = (0..plan.runs).map(|member| MemberTask {
                scene,
                member,
                of: plan.runs,
            });
            let tasks: Vec<MemberTask> = tasks.collect();
            match engine.round(&runs, &tasks, RoundShare::Partition, observer) {
                Ok(runs) => study.add(case, runs),
                // This partition has runs of the other ensembles, too.
                Err(Error::Partial { missing, .. }) => left += missing,
                Err(error) => return Err(error),
            }
        }
        match left {
            0 => Ok(study.finish()),
            missing => Err(Error::Partial {
                missing,
                of: self.cases.len() * plan.runs,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::CommonOptions;

    /// It has angles of its motors, too.
    #[test]
    fn distances_of_the_bench_are_in_the_unit_of_its_lift() {
        let scenario = "/../../scenarios/bench.toml";
        let options = RobustnessOptions {
            scenarios: vec![(env!("CARGO_MANIFEST_DIR").to_owned() + scenario).into()],
            ensemble: 2,
            tolerance: 1e-3,
            radius: false,
            common: CommonOptions {
                out: "studies".into(),
                ..CommonOptions::default()
            },
        };
        let registry = Registry::standard();
        let cases = RobustnessCases::new(&registry, &options, &[]).unwrap();
        assert_eq!(cases.cases[0].unit.as_deref(), Some("m"));
    }
}
