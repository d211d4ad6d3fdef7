//! Request of a study of load feedback.

use super::cases::FeedbackCases;
use super::options::FeedbackOptions;
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
use crate::runs::rounds::StudyEngine;

impl StudyRequest for FeedbackOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.common.frame("loads", &self.scenarios)
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let StudyContext {
            registry,
            settings,
            machine,
            command,
            observer,
        } = context;
        let cases = FeedbackCases::new(registry, self, settings)?;
        let mut engine = StudyEngine::new(registry, &self.common.runs, &self.frame())?;
        let study = cases.study(&cases.plan(self)?, &mut engine, observer)?;
        let file = self.scenarios[0].display().to_string();
        let study = study.map_err(|source| Error::of_study(&file, source))?;
        let mut summary = study.summary();
        engine.note(&mut summary);
        Ok(StudyReport {
            is_negative: !study.without_effect().is_empty(),
            ..StudyReport::new(
                summary,
                study.page(machine, command),
                study.csv(),
                study.json(machine, command),
            )
        })
    }
}
