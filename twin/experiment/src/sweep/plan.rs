//! Plan of a sweep: its specification and its points.

use std::collections::BTreeSet;
use std::path::Path;

use twinrig_campaign::sweep::{ResultDimension, SweepSpec, VERDICT_SHARE};
use twinrig_document::{Document, DocumentError, Problem, suggestion};
use twinrig_kernel::Unit;
use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use crate::error::Error;
use crate::runs::cases::RunCase;
use crate::runs::plan::{RunPlan, RunRequest, expectations, robot_file};

/// A planned sweep.
pub(crate) struct SweepPlan<'r> {
    pub(crate) spec: SweepSpec,
    pub(crate) runs: RunPlan<'r>,
}

impl<'r> SweepPlan<'r> {
    /// Reads scenario, specification and all other files, and checks them as far as that is
    /// possible without a run. Signals that only a recording requires are computed if `recorded`.
    pub(crate) fn new(
        registry: &'r Registry,
        scenario: &Path,
        spec: &Path,
        settings: &[Setting],
        recorded: bool,
    ) -> Result<Self, Error> {
        let mut spec = SweepSpec::read(&Document::read(spec)?)?;
        if let Some(first) = spec.assumed.first() {
            let robot = robot_file(registry, &request(&spec, scenario, settings, recorded))?;
            let robot = robot.ok_or_else(|| {
                let message = "the scenario has no robot, and so no assumed values";
                let help = "leave `assumed` out, or write `robot = …` in the scenario";
                DocumentError::from(Problem::at(&first.place, message, help))
            })?;
            spec.add_assumed(robot.assumed())?;
        }
        let request = request(&spec, scenario, settings, recorded);
        let (mut runs, _) = RunPlan::new(registry, request)?;
        let mut names = BTreeSet::new();
        for values in spec.points() {
            runs.add_point(0, values, &mut |scenario| {
                names.extend(expectations(scenario).map(|one| one.name.clone()));
            })?;
        }
        check_extremes(&runs)?;
        check_names(&spec, &names)?;
        Ok(Self { spec, runs })
    }

    /// Returns the dimensions with the units of their numbers.
    pub(crate) fn dimensions(&self) -> Vec<ResultDimension> {
        let unit = |index: usize| {
            let mut units = self.runs.points.iter().map(|point| {
                let value = &point.values[index];
                value.number.map(|_| value.unit)
            });
            let first: Option<Unit> = units.next().flatten();
            units.all(|unit| unit == first).then_some(first).flatten()
        };
        let dimensions = self.runs.keys.iter().enumerate();
        dimensions
            .map(|(index, key)| ResultDimension {
                key: key.clone(),
                unit: unit(index),
            })
            .collect()
    }
}

fn request<'p>(
    spec: &'p SweepSpec,
    scenario: &'p Path,
    settings: &'p [Setting],
    recorded: bool,
) -> RunRequest<'p> {
    RunRequest {
        scenario,
        file: &spec.file,
        set: &spec.set,
        settings,
        keys: spec.keys().cloned().collect(),
        cases: vec![RunCase::default()],
        recorded,
    }
}

/// Reads the scenario with the least and the greatest value of each dimension, so that a value out
/// of range is an error before the runs.
fn check_extremes(runs: &RunPlan<'_>) -> Result<(), Error> {
    let mut checked = BTreeSet::new();
    for dimension in 0..runs.keys.len() {
        let number = |index: &usize| runs.points[*index].values[dimension].number;
        let by_number = |one: &usize, other: &usize| {
            number(one)
                .partial_cmp(&number(other))
                .unwrap_or(std::cmp::Ordering::Equal)
        };
        let least = (0..runs.points.len()).min_by(by_number);
        let greatest = (0..runs.points.len()).max_by(by_number);
        for index in least.into_iter().chain(greatest) {
            if checked.insert(runs.points[index].key) {
                runs.check_point(index)?;
            }
        }
    }
    Ok(())
}

/// Checks that every asserted share, and every measure, is about an expectation of the scenario.
fn check_names(spec: &SweepSpec, known: &BTreeSet<String>) -> Result<(), Error> {
    let mut problems = Vec::new();
    let shares = spec
        .shares
        .iter()
        .map(|share| (&share.of, Some(VERDICT_SHARE)));
    let measures = spec.measures.iter().map(|name| (name, None));
    for (of, further) in shares.chain(measures) {
        let name = &of.value;
        if further != Some(name.as_str()) && !known.contains(name) {
            let names = known.iter().map(String::as_str).chain(further);
            problems.push(Problem::at(
                &of.place,
                format!("no run has an expectation `{name}`"),
                suggestion(name, "expectations", names),
            ));
        }
    }
    if problems.is_empty() {
        Ok(())
    } else {
        Err(DocumentError { problems }.into())
    }
}
