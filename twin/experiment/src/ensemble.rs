//! Ensembles: runs of a scenario from perturbed starts, or with other seeds where the start of the
//! plant cannot be perturbed, or with other values of a fit.

use std::borrow::Borrow;

use twinrig_campaign::identification::FittedDistribution;
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread, Magnitude, Member};
use twinrig_campaign::sweep::{SweepRow, overlap};
use twinrig_document::{Document, DocumentError, Overrides, Placed, Problem};
use twinrig_rig::StartPerturbation;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::{Error as RigError, guarded};
use twinrig_rig::report::row;
use twinrig_rig::report::{Line, LineEnsemble, Report, Status};
use twinrig_rig::run::execute::{execute_observed, execute_saving};
use twinrig_rig::run::execution::Execution;
use twinrig_rig::run::interrupt;
use twinrig_rig::run::observers::RunObserver;
use twinrig_scenario::{Scenario, Varied};

use crate::error::{Error, StudyError};
use crate::parallel::{RunResult, run_all};

/// Members of an ensemble: the unperturbed run, number 0, and one for each magnitude.
pub(crate) struct Ensemble<A> {
    assembly: A,
    magnitudes: Vec<Magnitude>,
    vary: Varied,
    /// Values of the members but the first, for [`Varied::Fit`].
    values: Vec<Overrides>,
    /// Reason why the start cannot be perturbed.
    why_seeds: Option<String>,
}

impl<'r, A: Borrow<Assembly<'r>>> Ensemble<A> {
    /// Creates the ensemble of so many runs.
    ///
    /// # Errors
    /// Parts that cannot be built.
    pub(crate) fn new(assembly: A, runs: usize, vary: Varied) -> Result<Self, RigError> {
        let mut ensemble = Self {
            assembly,
            magnitudes: Magnitude::spaced(runs.saturating_sub(1)),
            vary,
            values: Vec::new(),
            why_seeds: None,
        };
        if runs > 1 && vary == Varied::Start {
            // The least perturbation leaves every start possible.
            ensemble.why_seeds = match ensemble.member(1)?.rig() {
                Ok(_) => None,
                Err(RigError::Start { why, .. }) => Some(why),
                Err(error) => return Err(error),
            };
        }
        Ok(ensemble)
    }

    /// Perturbs all starts by the same magnitude.
    pub(crate) fn perturb_by(&mut self, magnitude: Magnitude) {
        self.magnitudes.fill(magnitude);
    }

    /// Returns the assembly of the unperturbed run.
    pub(crate) fn assembly(&self) -> &Assembly<'r> {
        self.assembly.borrow()
    }

    pub(crate) fn kind(&self) -> EnsembleKind {
        match (self.vary, &self.why_seeds) {
            (Varied::Start, None) => EnsembleKind::Starts,
            (Varied::Start, Some(_)) | (Varied::Seed, _) => EnsembleKind::Seeds,
            (Varied::Fit, _) => EnsembleKind::Parameters,
        }
    }

    pub(crate) fn why_seeds(&self) -> Option<&str> {
        self.why_seeds.as_deref()
    }

    /// Returns the perturbation of a member.
    fn magnitude(&self, member: usize) -> Option<Magnitude> {
        let index = member.checked_sub(1)?;
        let magnitude = self.magnitudes.get(index).copied();
        magnitude.filter(|_| self.kind() == EnsembleKind::Starts)
    }

    fn member(&self, member: usize) -> Result<Assembly<'r>, RigError> {
        let assembly = self.assembly();
        let scenario = assembly.scenario();
        if let Some(magnitude) = self.magnitude(member) {
            return Ok(assembly.with_start(StartPerturbation {
                seed: scenario.seed,
                member,
                magnitude,
            }));
        }
        if let Some(values) = member.checked_sub(1).and_then(|it| self.values.get(it)) {
            return assembly.with_values(values);
        }
        let mut scenario = scenario.clone();
        scenario.seed = scenario.seed.wrapping_add(member as u64);
        assembly.with_scenario(&scenario, &[])
    }

    /// Runs a member with an observer; a panic is an error of the run.
    ///
    /// # Errors
    /// A run that cannot start.
    pub(crate) fn run(
        &self,
        member: usize,
        observer: Option<&mut dyn RunObserver>,
    ) -> Result<SweepRow, Error> {
        guarded(&self.assembly().scenario().file, || {
            row_of(&self.member(member)?, observer)
        })
    }
}

/// Runs a scene and returns its row.
pub(crate) fn row_of(
    assembly: &Assembly<'_>,
    observer: Option<&mut dyn RunObserver>,
) -> Result<SweepRow, Error> {
    let execution = Execution::default();
    let (report, _) = execute_saving(assembly, &execution, assembly.end(), None, observer)?;
    Ok(row::of_report(report))
}

/// Runs `assembly`, the reference run if an expectation requires one, and the ensemble if the
/// scenario has one.
///
/// # Errors
/// [`Error`] if the run cannot start. A run that starts and fails is reported in the
/// [`Report`].
pub fn execute(assembly: &Assembly<'_>, execution: &Execution) -> Result<Report, Error> {
    check_ensemble(assembly)?;
    let report = execute_observed(assembly, execution, &mut ())?;
    with_ensemble(assembly, report, &mut |_, _| ())
}

/// Adds the ensemble of its scenario to the report of an unperturbed run. Each line then has the
/// share of the runs in which its expectation holds, and holds only with the required share.
/// Without `ensemble` in the scenario, and after a run with an error, nothing is added. `progress`
/// receives the number of runs that have ended, and of all.
///
/// # Errors
/// Parts that cannot be built, or threads that cannot be started.
pub fn with_ensemble(
    assembly: &Assembly<'_>,
    mut report: Report,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Report, Error> {
    let Some(spec) = &assembly.scenario().ensemble else {
        return Ok(report);
    };
    if report.error.is_some() {
        return Ok(report);
    }
    let mut ensemble = Ensemble::new(assembly, spec.runs, spec.vary)?;
    if let Some(fit) = &spec.fit {
        ensemble.values = drawn(assembly.scenario(), fit, spec.runs)?;
    }
    // The run of the scenario is no draw of a fit.
    let others = match &spec.fit {
        Some(_) => spec.runs,
        None => spec.runs - 1,
    };
    // Without random numbers a run with another seed is the same run.
    let is_same =
        ensemble.kind() == EnsembleKind::Seeds && report.random.as_ref().is_some_and(Vec::is_empty);
    let first_row = row::of_report(report.clone());
    let run = |index: usize| {
        if is_same {
            return Ok(first_row.clone());
        }
        ran(ensemble.run(index + 1, None))
    };
    let rows = run_all(others, &run, &mut |done, _| {
        progress(done, others);
        !interrupt::is_requested()
    });
    let rows = match rows {
        Ok(rows) => rows,
        Err(error @ StudyError::Interrupted { .. }) => {
            report.error = Some(format!("the ensemble was {error}"));
            report.verdict = Status::Error;
            return Ok(report);
        }
        Err(source) => {
            let file = assembly.scenario().file.clone();
            return Err(Error::Study { file, source });
        }
    };
    let first = Member {
        magnitude: None,
        row: first_row,
    };
    let others = rows.into_iter().enumerate().map(|(index, row)| Member {
        magnitude: ensemble.magnitude(index + 1),
        row: row.unwrap_or_else(SweepRow::of_error),
    });
    let mut members: Vec<Member> = others.collect();
    let spreads = if ensemble.kind() == EnsembleKind::Parameters {
        ExpectationSpread::over_draws(&first, &members)
    } else {
        members.insert(0, first);
        ExpectationSpread::all(&members)
    };
    for (line, spread) in report.expectations.iter_mut().zip(spreads) {
        line.ensemble = Some(LineEnsemble {
            differ_by: ensemble.kind(),
            required_share: spec.share,
            spread,
        });
    }
    if report.verdict == Status::Pass && !report.expectations.iter().all(Line::holds) {
        report.verdict = Status::Fail;
    }
    let mut errors = members.iter().filter_map(|it| it.row.error.as_ref());
    if let Some(error) = errors.next() {
        report.error = Some(format!("a run of the ensemble has an error: {error}"));
        report.verdict = Status::Error;
    }
    Ok(report)
}

/// Prefix of the keys of values of a file of robot or bench.
const OVERRIDE: &str = "override.";

/// Checks the ensemble of a scenario before its runs.
///
/// # Errors
/// The overlay of a fit cannot be read, or has values that the robot or bench does not accept.
pub fn check_ensemble(assembly: &Assembly<'_>) -> Result<(), Error> {
    let ensemble = assembly.scenario().ensemble.as_ref();
    let Some(fit) = ensemble.and_then(|spec| spec.fit.as_ref()) else {
        return Ok(());
    };
    for values in drawn(assembly.scenario(), fit, 1)? {
        assembly.with_values(&values)?;
    }
    Ok(())
}

/// Draws values of a robot or bench from the distribution of an overlay, but for those that the
/// scenario sets.
fn drawn(
    scenario: &Scenario,
    fit: &Placed<String>,
    count: usize,
) -> Result<Vec<Overrides>, DocumentError> {
    let overlay = Document::read(&scenario.folder.join(&fit.value))?;
    let distribution = FittedDistribution::read(&overlay)?;
    let set: Vec<String> = scenario.overrides.keys().collect();
    let key = |dimension: &'_ Placed<String>| {
        let of_file = dimension.value.strip_prefix(OVERRIDE);
        let of_file = of_file.ok_or_else(|| {
            let message = format!("`{}` is a key of the scenario", dimension.value);
            let help = "an ensemble varies values of a robot or bench, `override.…`";
            DocumentError::from(Problem::at(&dimension.place, message, help))
        })?;
        let is_set = set.iter().any(|set| overlap(set, of_file));
        Ok((!is_set).then(|| of_file.to_owned()))
    };
    let keys = distribution.dimensions.iter().map(|it| key(&it.key));
    let keys: Vec<Option<String>> = keys.collect::<Result<_, DocumentError>>()?;
    let values = distribution.points(scenario.seed, count).into_iter();
    let overrides = values.map(|point| {
        let mut document = Document::parse(overlay.file(), "")?;
        for (key, value) in keys.iter().zip(point) {
            if let Some(key) = key {
                document.set(overlay.file(), key, &value.toml)?;
            }
        }
        Ok(document.overrides())
    });
    overrides.collect()
}

/// Returns the row of a run, or the reason why it did not start.
pub(crate) fn ran(row: Result<SweepRow, Error>) -> RunResult<SweepRow> {
    row.map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use twinrig_rig::registry::Registry;
    use twinrig_scenario::Setting;

    use super::*;
    use crate::runs::scene::tests::trot;

    #[test]
    fn run_with_an_error_has_no_ensemble() {
        let registry = Registry::standard();
        let ensemble = Setting {
            origin: "--set".to_owned(),
            key: "ensemble".to_owned(),
            value: "{ runs = 2 }".to_owned(),
        };
        let scene = trot(&registry, "'10 ms'", None);
        let assembly = scene.assembly(&registry, &[ensemble]).unwrap();
        let mut report = execute(&assembly, &Execution::default()).unwrap();
        assert!(report.expectations.iter().all(|it| it.ensemble.is_some()));
        report.error = Some("it snapped".to_owned());
        let found = with_ensemble(&assembly, report, &mut |_, _| panic!("a run")).unwrap();
        assert_eq!(found.error.as_deref(), Some("it snapped"));
    }
}
