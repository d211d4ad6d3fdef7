//! Request of a study of gait transitions.

use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::cases::TransitionCases;
use super::options::TransitionOptions;
use super::{TransitionPlan, TransitionStudy, transition};
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest, unique};
use crate::progress::ProgressObserver;
use crate::runs::rounds::{RoundShare, StudyEngine};

impl StudyRequest for TransitionOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.common
            .frame("transition", std::slice::from_ref(&self.scenario))
    }

    fn check(&self) -> Result<(), Error> {
        unique("--plant", &self.common.plant)?;
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
        let mut engine = StudyEngine::new(registry, &self.common.runs, &self.frame())?;
        let study = self.study_by(&mut engine, registry, settings, observer)?;
        let mut summary = study.summary();
        engine.note(&mut summary);
        Ok(StudyReport::new(
            summary,
            study.page(machine, command),
            study.csv(),
            study.json(machine, command),
        ))
    }
}

impl TransitionOptions {
    /// Studies the transitions of gaits on the threads of this process, and keeps no rows.
    ///
    /// # Errors
    /// Errors of the scenario, or of the study.
    pub fn study(
        &self,
        registry: &Registry,
        settings: &[Setting],
        observer: &mut dyn ProgressObserver,
    ) -> Result<TransitionStudy, Error> {
        let mut engine = StudyEngine::local(registry, &self.scenario)?;
        self.study_by(&mut engine, registry, settings, observer)
    }

    fn study_by(
        &self,
        engine: &mut StudyEngine<'_>,
        registry: &Registry,
        settings: &[Setting],
        observer: &mut dyn ProgressObserver,
    ) -> Result<TransitionStudy, Error> {
        let cases = TransitionCases::new(registry, self, settings)?;
        let plan = TransitionPlan {
            tolerance: self.tolerance,
            lasting: self.cycles,
        };
        let (runs, tasks) = cases.runs();
        let runs = engine.round(&runs, &tasks, RoundShare::Partition, observer)?;
        let study = transition(cases.input(), &plan, runs);
        let file = self.scenario.display().to_string();
        study.map_err(|source| Error::of_study(&file, source))
    }
}
