//! Request of a study of footstep modulation.

use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::ModulationStudy;
use super::cases::ModulationCases;
use super::options::ModulationOptions;
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
use crate::progress::ProgressObserver;
use crate::runs::rounds::StudyEngine;

impl StudyRequest for ModulationOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.common.frame("modulation", &self.scenarios)
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let StudyContext {
            registry,
            settings,
            machine,
            command,
            observer,
        } = context;
        let mut engine = StudyEngine::new(registry, &self.common.runs, &self.frame())?;
        let study = self.study_by(&mut engine, registry, settings, observer)?;
        let mut summary = study.summary();
        engine.note(&mut summary);
        Ok(StudyReport {
            error: study.error(),
            ..StudyReport::new(
                summary,
                study.page(machine, command),
                study.csv(),
                study.json(machine, command),
            )
        })
    }
}

impl ModulationOptions {
    /// Studies the modulation of footsteps on the threads of this process, and keeps no rows.
    ///
    /// # Errors
    /// Errors of the scenarios, or of the study.
    pub fn study(
        &self,
        registry: &Registry,
        settings: &[Setting],
        observer: &mut dyn ProgressObserver,
    ) -> Result<ModulationStudy, Error> {
        let mut engine = StudyEngine::local(registry, &self.scenarios[0])?;
        self.study_by(&mut engine, registry, settings, observer)
    }

    fn study_by(
        &self,
        engine: &mut StudyEngine<'_>,
        registry: &Registry,
        settings: &[Setting],
        observer: &mut dyn ProgressObserver,
    ) -> Result<ModulationStudy, Error> {
        let cases = ModulationCases::new(registry, self, settings)?;
        let study = cases.study(&cases.plan(self)?, engine, observer)?;
        let file = self.scenarios[0].display().to_string();
        study.map_err(|source| Error::of_study(&file, source))
    }
}
