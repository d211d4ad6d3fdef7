//! Request of a study of gait transitions.

use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::cases::TransitionCases;
use super::options::TransitionOptions;
use super::{TransitionPlan, TransitionStudy, transition};
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest, unique};
use crate::progress::ProgressObserver;

impl StudyRequest for TransitionOptions {
    fn frame(&self) -> StudyFrame<'_> {
        StudyFrame {
            name: "transition",
            scenarios: std::slice::from_ref(&self.scenario),
            plants: &self.plant,
            set: &self.set,
            out: &self.out,
            json: self.json,
        }
    }

    fn check(&self) -> Result<(), Error> {
        unique("--plant", &self.plant)?;
        unique("--plateau", &self.plateau)
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
        Ok(StudyReport::new(
            study.summary(),
            study.page(machine, command),
            study.csv(),
            study.json(machine, command),
        ))
    }
}

impl TransitionOptions {
    /// Studies the transitions of gaits.
    ///
    /// # Errors
    /// Errors of the scenario, or of the study.
    pub fn study(
        &self,
        registry: &Registry,
        settings: &[Setting],
        observer: &mut dyn ProgressObserver,
    ) -> Result<TransitionStudy, Error> {
        let cases = TransitionCases::new(registry, self, settings)?;
        let plan = TransitionPlan {
            tolerance: self.tolerance,
            lasting: self.cycles,
        };
        let study = transition(&cases, &plan, observer);
        let file = self.scenario.display().to_string();
        study.map_err(|source| Error::of_study(&file, source))
    }
}
