//! Options of a study of coupling.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use clap::Args;

use super::builder::RigStudyBuilder;
use super::{CouplingPlan, coupling};
use crate::error::Error;
use crate::measured::{Measuring, PartStore};
use crate::options::StudyOptions;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};

/// Measure the error and the saved computation time of coupling plant and boards on a fixed
/// grid
///
/// Runs the complete rig, including controller, drivers and boards, with exact coupling and
/// with fixed-step coupling at various grid steps, and compares foot and trunk positions with
/// exact coupling at a fine plant step, which is verified by a step twice as long.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("scenario", |scenario| scenario.default_value("scenarios/oncilla-clocks.toml")))]
pub struct CouplingOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
}

impl StudyRequest for CouplingOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.study.frame("coupling")
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let options = &self.study;
        let plan = CouplingPlan {
            duration: options.duration,
            budget_s: options.budget,
            ..CouplingPlan::default()
        };
        let (path, settings) = (&options.scenario, context.settings);
        let rigs = RigStudyBuilder::new(context.registry, path, settings, &options.plant)?;
        let mut store = PartStore::of_study(&context, &self.frame(), context.settings)?;
        let (machine, command) = (context.machine, context.command);
        let measuring = Measuring::kept(context.observer, &mut store);
        let study = coupling(&rigs, &plan, measuring);
        let study = study.map_err(|source| Error::of_study(&options.file(), source))?;
        let study = rigs.with_panics(study);
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
