//! Options of studies of precision and stability.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use clap::Args;

use super::builder::StudyBuilder;
use super::factor::Factor;
use super::precision::precision;
use super::precision_plan::PrecisionPlan;
use super::stability::stability;
use super::stability_plan::StabilityPlan;
use super::study::Study;
use crate::error::Error;
use crate::machine::Machine;
use crate::measured::{Measuring, PartStore};
use crate::options::StudyOptions;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
use crate::options::values::whole_number_or_none;

/// Measure the error of each plant, method and step against its computation time
///
/// Integrates the scene with every plant and method over a range of steps or tolerances, and
/// compares the foot positions with a reference: the best method at its finest setting,
/// verified by a second method. Commands of a controller are recorded once and replayed to all
/// plants. Runs that fail or exceed the budget are reported as such.
#[derive(Clone, Debug, Args)]
pub struct PrecisionOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Walks from perturbed starts of each plant, where the scenario walks; 0 for none
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole_number_or_none)]
    pub ensemble: usize,
}

/// Find the largest stable step of each plant and method, and the limiting parameters
///
/// Searches for the longest step at which the motion stays bounded while stiffness, masses,
/// damping, gain, friction or restitution of the robot and its ground are varied one at a time.
/// A stability limit at which the foot positions are inaccurate is marked as wrong.
#[derive(Clone, Debug, Args)]
pub struct StabilityOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Vary this factor alone: stiffness, mass, damping, gain, friction, restitution, compliance,
    /// compliance-damping, longest-step, speed (multiples of the robot's, or values in SI units),
    /// or cells of the table of forces
    #[arg(long, value_name = "FACTOR=VALUES", value_parser = factor_values)]
    pub factor: Option<FactorValues>,
}

impl StudyRequest for PrecisionOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.study.frame("precision")
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let plan = PrecisionPlan {
            duration: self.study.duration,
            ensemble: self.ensemble,
            budget_s: self.study.budget,
            ..PrecisionPlan::default()
        };
        let builder = builder(&self.study, &context)?;
        let mut store = PartStore::of_study(&context, &self.frame(), context.settings)?;
        let measuring = Measuring::kept(context.observer, &mut store);
        let study = precision(&builder, &plan, measuring);
        let study = study.map_err(|source| Error::of_study(&self.study.file(), source))?;
        Ok(report(
            &builder.with_panics(study),
            context.machine,
            context.command,
        ))
    }
}

impl StudyRequest for StabilityOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.study.frame("stability")
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let mut plan = StabilityPlan {
            budget_s: self.study.budget,
            ..StabilityPlan::default()
        };
        plan.duration = self.study.duration.unwrap_or(plan.duration);
        if let Some(FactorValues { factor, values }) = &self.factor {
            plan.factors = vec![*factor];
            plan.values = Some(values.clone());
        }
        let builder = builder(&self.study, &context)?;
        let mut store = PartStore::of_study(&context, &self.frame(), context.settings)?;
        let measuring = Measuring::kept(context.observer, &mut store);
        let study = stability(&builder, &plan, measuring);
        let study = study.map_err(|source| Error::of_study(&self.study.file(), source))?;
        Ok(report(
            &builder.with_panics(study),
            context.machine,
            context.command,
        ))
    }
}

fn builder<'r>(
    options: &StudyOptions,
    context: &StudyContext<'r>,
) -> Result<StudyBuilder<'r>, Error> {
    StudyBuilder::new(
        context.registry,
        &options.scenario,
        context.settings,
        &options.plant,
        options.duration,
    )
}

fn report(study: &Study, machine: &Machine, command: &str) -> StudyReport {
    StudyReport {
        error: study.error(),
        ..StudyReport::new(
            study.summary(),
            study.page(machine, command),
            study.csv(),
            study.json(machine, command),
        )
    }
}

/// Factor of a study of stability, and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct FactorValues {
    /// The factor.
    pub factor: Factor,
    /// Multiples of the robot's, or values in SI units.
    pub values: Vec<f64>,
}

/// Returns a factor and its values: `stiffness=0.5,1`.
fn factor_values(text: &str) -> Result<FactorValues, String> {
    let (word, values) = text.split_once('=').ok_or("FACTOR=VALUES is required")?;
    let known = Factor::ALL.into_iter().find(|it| it.word() == word.trim());
    let factor = known.ok_or_else(|| {
        let words = Factor::ALL.map(Factor::word);
        format!(
            "there is no factor `{word}`; there are {}",
            words.join(", ")
        )
    })?;
    let values = values.split(',').map(|value| match value.trim().parse() {
        Ok(value) if factor.accepts(value) => Ok(value),
        _ => Err(format!("`{value}` is no value of the factor `{word}`")),
    });
    let values = values.collect::<Result<_, _>>()?;
    Ok(FactorValues { factor, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factor_has_known_name_and_possible_values() {
        let damping = factor_values("damping=0, 0.5,2").unwrap();
        assert_eq!(damping.factor, Factor::Damping);
        assert_eq!(damping.values, [0.0, 0.5, 2.0]);
        for text in ["damping", "damping=", "damping=-1", "damping=NaN", "mess=1"] {
            assert!(factor_values(text).is_err(), "{text}");
        }
        for cells in ["15", "16.5", "513"] {
            assert!(factor_values(&format!("cells={cells}")).is_err(), "{cells}");
        }
        assert_eq!(factor_values("cells=16,512").unwrap().values, [16.0, 512.0]);
    }
}
