//! Request of a study of robustness.

use std::path::Path;

use twinrig_rig::error::Error as RigError;
use twinrig_scenario::Setting;

use super::cases::RobustnessCases;
use super::options::RobustnessOptions;
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
use crate::radius::execute::{RadiusRequest, radius};
use crate::radius::options::DEFAULT_PRECISION;
use crate::runs::rounds::StudyEngine;

impl StudyRequest for RobustnessOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.common.frame("robustness", &self.scenarios)
    }

    /// Studies ensembles, then the radii of the same scenarios if they are asked for.
    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let StudyContext {
            registry,
            settings,
            machine,
            command,
            observer,
        } = context;
        let of_study = |source| Error::of_study(&self.scenarios[0].display().to_string(), source);
        let cases = RobustnessCases::new(registry, self, settings)?;
        let plan = RobustnessCases::plan(self);
        let mut engine = StudyEngine::new(registry, &self.common.runs, &self.frame())?;
        let mut study = cases
            .study(&plan, &mut engine, observer)?
            .map_err(of_study)?;
        let mut radii = Vec::new();
        for (path, plant) in cases.files().iter().filter(|_| self.radius) {
            let plant = plant.as_deref();
            let name = self.radius_name(path, plant);
            let request = self.radius_request(&name, path, plant, settings);
            match radius(registry, &request, observer) {
                Ok(outcome) => radii.push((name, outcome.map_err(of_study)?.report())),
                // It expects nothing, or has no axis.
                Err(Error::Rig(RigError::InvalidOptions { why, .. })) => {
                    study.left_out.push(format!("{name}: {why}"));
                }
                Err(error) => return Err(error),
            }
        }
        let mut json = study.json(machine, command);
        if !radii.is_empty() {
            json["radius"] = radii
                .iter()
                .map(|(_, report)| report.json.clone())
                .collect();
        }
        let mut summary = study.summary();
        summary.left_out(&study.left_out);
        engine.note(&mut summary);
        Ok(StudyReport {
            error: study.error(),
            markdown: Some(study.markdown()),
            is_negative: radii.iter().any(|(_, report)| report.is_negative),
            further: radii,
            ..StudyReport::new(summary, study.page(machine, command), study.csv(), json)
        })
    }
}

impl RobustnessOptions {
    /// Returns the name of the study of radii of a scenario on one of the plants, as
    /// `twin study radius` names it; with the plant if there are several.
    fn radius_name(&self, scenario: &Path, plant: Option<&str>) -> String {
        let stem = scenario.file_stem().unwrap_or_default().to_string_lossy();
        match plant.filter(|_| self.common.plant.len() > 1) {
            Some(plant) => format!("radius-{stem}-{plant}"),
            None => format!("radius-{stem}"),
        }
    }

    /// Returns the study of radii of a scenario along all axes; its rows are in a folder of this
    /// name.
    fn radius_request(
        &self,
        name: &str,
        scenario: &Path,
        plant: Option<&str>,
        settings: &[Setting],
    ) -> RadiusRequest {
        let plant = plant.map(Setting::plant);
        RadiusRequest {
            scenario: scenario.to_owned(),
            settings: settings.iter().cloned().chain(plant).collect(),
            axes: Vec::new(),
            along: Vec::new(),
            precision: DEFAULT_PRECISION,
            engine: self.common.runs.engine.clone(),
            rows: self.common.out.join(name),
        }
    }
}
