//! Request of a study of footstep modulation.

use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::cases::ModulationCases;
use super::options::ModulationOptions;
use super::{ModulationStudy, modulation};
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
use crate::progress::ProgressObserver;

impl StudyRequest for ModulationOptions {
    fn frame(&self) -> StudyFrame<'_> {
        StudyFrame {
            name: "modulation",
            scenarios: &self.scenarios,
            plants: &self.plant,
            set: &self.set,
            out: &self.out,
            json: self.json,
        }
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let StudyContext {
            registry,
            settings,
            machine,
            command,
            observer,
        } = context;
        let study = self.study(registry, settings, observer)?;
        Ok(StudyReport {
            error: study.error(),
            ..StudyReport::new(
                study.summary(),
                study.page(machine, command),
                study.csv(),
                study.json(machine, command),
            )
        })
    }
}

impl ModulationOptions {
    /// Studies the modulation of footsteps.
    ///
    /// # Errors
    /// Errors of the scenarios, or of the study.
    pub fn study(
        &self,
        registry: &Registry,
        settings: &[Setting],
        observer: &mut dyn ProgressObserver,
    ) -> Result<ModulationStudy, Error> {
        let cases = ModulationCases::new(registry, self, settings)?;
        let study = modulation(&cases, &cases.plan(self)?, observer);
        let file = self.scenarios[0].display().to_string();
        study.map_err(|source| Error::of_study(&file, source))
    }
}
