//! Options of a study of load filters.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use clap::Args;
use twinrig_scenario::Setting;

use super::recorder::BenchRecorder;
use super::{EstimatePlan, SearchSize, estimate};
use crate::error::Error;
use crate::measured::{Measuring, PartStore};
use crate::options::StudyOptions;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
use crate::options::values::{whole_number, whole_number_or_none};

/// Identify the cells of a load sensor, tune its filters and validate them
///
/// Runs a bench with a tactile bus three times, with successive seeds, while the frequency of
/// the load changes. The first run identifies both cells, the second tunes the covariances of
/// the filters by particle swarms, the third validates them. Prints the tuned filters for a
/// scenario.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("scenario", |scenario| scenario.default_value("scenarios/thesis/fig-4-11.toml")))]
pub struct EstimateOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Particles of a swarm; F2 has three swarms, the other filters one
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole_number)]
    pub particles: usize,
    /// Iterations of each swarm
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = whole_number_or_none)]
    pub iterations: usize,
}

impl StudyRequest for EstimateOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.study.frame("estimate")
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let options = &self.study;
        let plan = EstimatePlan {
            search: SearchSize {
                particles: self.particles,
                iterations: self.iterations,
            },
            budget_s: options.budget,
        };
        let mut settings = context.settings.to_vec();
        settings.extend(options.plant.iter().map(|name| Setting::plant(name)));
        settings.extend(options.duration.map(|duration| Setting {
            origin: "--duration".to_owned(),
            key: "duration".to_owned(),
            value: format!("\"{duration}\""),
        }));
        let bench = BenchRecorder::new(context.registry, &options.scenario, &settings)?;
        let mut store = PartStore::of_study(&context, &self.frame(), &settings)?;
        let (machine, command) = (context.machine, context.command);
        let measuring = Measuring::kept(context.observer, &mut store);
        let study = estimate(&bench, &plan, measuring);
        let study = study.map_err(|source| Error::of_study(&options.file(), source))?;
        Ok(StudyReport::new(
            study.summary(),
            study.page(machine, command),
            study.csv(),
            study.json(machine, command),
        ))
    }
}
