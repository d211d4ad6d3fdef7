//! Execution of studies of radii.

use std::collections::BTreeSet;
use std::path::PathBuf;

use twinrig_campaign::radius::{
    AxisResult, AxisSearch, DisturbanceAxis, Observation, RadiusResult, RunOutcome,
};
use twinrig_campaign::sweep::{
    ExpectationVerdict, Partition, RowExpectation, RowKey, RowStore, SweepRow,
};
use twinrig_document::DocumentError;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;
use twinrig_scenario::Setting;

use super::chosen::{ChosenAxes, KeyAxis, chosen};
use super::context::DisturbanceContext;
use crate::error::Error;
use crate::options::run::EngineArgs;
use crate::runs::cases::RunCase;
use crate::runs::job::SweepJob;
use crate::runs::missing::{StoredRuns, TaskEvent, Workers};
use crate::runs::plan::{RunPlan, RunRequest};
use crate::{ProgressObserver, StudyError};

/// Place of settings of the study in messages.
const STUDY: &str = "twin study radius";

/// A study of radii to be done.
#[derive(Clone, Debug)]
pub struct RadiusRequest {
    /// Scenario file.
    pub scenario: PathBuf,
    /// Settings of all runs.
    pub settings: Vec<Setting>,
    /// Names of the disturbances; none: all that apply, unless there are keys.
    pub axes: Vec<String>,
    /// Keys of the scenario as further axes.
    pub along: Vec<KeyAxis>,
    /// Width of a bracket as a share of its upper end.
    pub precision: f64,
    /// Engine of the runs.
    pub engine: EngineArgs,
    /// Folder of the rows, from which a study continues.
    pub rows: PathBuf,
}

/// A study of radii that has ended.
#[derive(Clone, Debug)]
pub struct RadiusOutcome {
    /// Result; a function of scenario, axes and build.
    pub result: RadiusResult,
    /// Notes about the rows on disk.
    pub notes: Vec<String>,
    /// Runs of this call; others are of earlier ones.
    pub ran: usize,
    /// All runs.
    pub runs: usize,
}

/// Finds the radius of each expectation of a scenario along the axes of its disturbances. An
/// interrupt ends the study; a later call continues it.
///
/// # Errors
/// [`Error`] if the study cannot start or its rows cannot be written; [`StudyError`] if it is
/// interrupted. A run with an error is a failure of all expectations.
pub fn radius(
    registry: &Registry,
    request: &RadiusRequest,
    observer: &mut dyn ProgressObserver,
) -> Result<Result<RadiusOutcome, StudyError>, Error> {
    let context = DisturbanceContext::new(registry, &request.scenario, &request.settings)?;
    let ChosenAxes { axes, mut left_out } = chosen(&context, &request.axes, &request.along)?;
    let names: Vec<String> = {
        let expectations = context.scenario().expectations.iter();
        expectations.map(|one| one.name.clone()).collect()
    };
    if names.is_empty() {
        return Err(Error::from(RigError::InvalidOptions {
            why: format!("{} expects nothing", context.scenario().file),
            help: "add an [[expect]]".to_owned(),
        }));
    }
    let runs = RunRequest {
        scenario: &request.scenario,
        file: STUDY,
        set: &[],
        settings: &request.settings,
        keys: Vec::new(),
        cases: vec![RunCase::default()],
        recorded: false,
    };
    let (runs, _) = RunPlan::new(registry, runs)?;
    let judged = names.clone();
    let store = RowStore::open(&request.rows, Partition::WHOLE, None, move |row| {
        outcome(&row, &judged)
    })?;
    let searches = axes.into_iter().map(|axis| {
        let search = AxisSearch::new(axis.values, names.len(), request.precision);
        (axis, search)
    });
    let mut searching = Searching {
        searches: searches.collect(),
        names: &names,
        runs,
        store,
        workers: Workers::new(registry, &request.engine)?,
        ran: 0,
        taken: BTreeSet::new(),
    };
    if let Err(error) = searching.search(observer)? {
        return Ok(Err(error));
    }
    searching.drop_invalid(&mut left_out);
    let is_named = !request.axes.is_empty() || !request.along.is_empty();
    if searching.searches.is_empty() || is_named && !left_out.is_empty() {
        return Err(Error::from(RigError::InvalidOptions {
            why: left_out.join("; "),
            help: "name other axes by --axis, or other keys and values by --along".to_owned(),
        }));
    }
    Ok(Ok(RadiusOutcome {
        result: searching.result(request, left_out),
        notes: searching.store.warnings().to_vec(),
        ran: searching.ran,
        runs: searching.taken.len(),
    }))
}

/// A study in progress.
struct Searching<'r> {
    searches: Vec<(DisturbanceAxis, AxisSearch)>,
    names: &'r [String],
    runs: RunPlan<'r>,
    /// Outcomes of the rows on disk.
    store: RowStore<RunOutcome>,
    workers: Workers<'r>,
    /// Keys of the rows of this study.
    taken: BTreeSet<RowKey>,
    ran: usize,
}

/// A size to be tested.
struct Proposal {
    /// Index of the axis.
    axis: usize,
    size: f64,
    /// Index of the run, or the reason why the scenario is not valid.
    run: Result<usize, String>,
}

impl Searching<'_> {
    /// Tests sizes along all axes until no search proposes one.
    fn search(
        &mut self,
        observer: &mut dyn ProgressObserver,
    ) -> Result<Result<(), StudyError>, Error> {
        loop {
            let proposals = self.proposals()?;
            if proposals.is_empty() {
                return Ok(Ok(()));
            }
            let Some(outcomes) = self.outcomes(observer)? else {
                let (done, of) = (self.taken.len(), self.taken.len() + proposals.len());
                return Ok(Err(StudyError::InterruptedRuns { done, of }));
            };
            for Proposal { axis, size, run } in proposals {
                let outcome = match run {
                    Ok(index) => {
                        self.taken.insert(self.runs.points[index].key);
                        outcomes[index].clone()
                    }
                    Err(reason) => RunOutcome::Refused(reason),
                };
                self.searches[axis].1.add(size, outcome);
            }
        }
    }

    /// Returns the sizes that the searches propose, and plans their runs.
    fn proposals(&mut self) -> Result<Vec<Proposal>, Error> {
        let mut proposals = Vec::new();
        let mut cases = Vec::new();
        for (index, (axis, search)) in self.searches.iter().enumerate() {
            for size in search.next_sizes() {
                cases.push(RunCase::of_settings(settings(axis, size)));
                proposals.push(Proposal {
                    axis: index,
                    size,
                    run: Ok(0),
                });
            }
        }
        self.runs.begin_again(cases);
        for (case, proposal) in proposals.iter_mut().enumerate() {
            proposal.run = match self.runs.add_point(case, Vec::new(), &mut |_| {}) {
                Ok(()) => Ok(self.runs.points.len() - 1),
                // Without a disturbance, the scenario is valid.
                Err(RigError::Document(DocumentError { problems })) if proposal.size > 0.0 => {
                    let first = problems.first();
                    Err(first.map_or_else(String::new, |problem| problem.message.clone()))
                }
                Err(error) => return Err(error.into()),
            };
        }
        Ok(proposals)
    }

    /// Does the planned runs that are not known, equal ones once, and returns the outcomes of all;
    /// none if an interrupt left some of them.
    fn outcomes(
        &mut self,
        observer: &mut dyn ProgressObserver,
    ) -> Result<Option<Vec<RunOutcome>>, Error> {
        let job = SweepJob {
            runs: &self.runs,
            record: None,
        };
        let points = self.runs.points.len();
        let missing = job.missing(0..points, &self.store);
        let all = self.taken.len() + points;
        let mut left = missing.len();
        let mut at = |left: usize| observer.at(all - left, all, "runs");
        if !at(left) {
            return Ok(None);
        }
        let ended = self
            .workers
            .run(&job, &missing, &mut self.store, &mut |event| {
                left -= usize::from(matches!(event, TaskEvent::Done { .. }));
                at(left)
            })?;
        self.ran += ended.done;
        if interrupt::is_requested() {
            return Ok(None);
        }
        let points = self.runs.points.iter();
        let outcomes = points.map(|point| self.store.get(&point.key).cloned());
        Ok(outcomes.collect())
    }

    /// Removes the axes of which no value is valid.
    fn drop_invalid(&mut self, left_out: &mut Vec<String>) {
        self.searches.retain(|(axis, search)| {
            let invalid = search.invalid();
            left_out.extend(invalid.map(|reason| format!("{}: {reason}", axis.name)));
            invalid.is_none()
        });
    }

    fn result(&self, request: &RadiusRequest, left_out: Vec<String>) -> RadiusResult {
        let axes = self.searches.iter();
        let axes = axes.map(|(axis, search)| AxisResult::new(axis, self.names, search));
        RadiusResult {
            scenario: self.runs.scenario.clone(),
            file: self.runs.file.clone(),
            build: self.runs.build.to_string(),
            settings: self.runs.base_pairs(),
            precision: request.precision,
            axes: axes.collect(),
            left_out,
        }
    }
}

/// Returns the settings of a disturbance of this size.
fn settings(axis: &DisturbanceAxis, size: f64) -> Vec<Setting> {
    let settings = axis.settings(size).into_iter();
    let setting = |(key, value)| Setting {
        origin: axis.name.clone(),
        key,
        value,
    };
    settings.map(setting).collect()
}

/// Returns the outcome of a run for these expectations.
fn outcome(row: &SweepRow, names: &[String]) -> RunOutcome {
    match (&row.error, row.seed) {
        // The run did not begin.
        (Some(error), None) => RunOutcome::Refused(error.clone()),
        (Some(error), Some(_)) => RunOutcome::Ended(error.clone()),
        (None, _) => {
            let outcomes = names.iter().map(|name| observation(row.expectation(name)));
            RunOutcome::Judged(outcomes.collect())
        }
    }
}

fn observation(one: Option<&RowExpectation>) -> Observation {
    Observation {
        is_observed: one.is_some_and(|it| it.verdict != ExpectationVerdict::Unobserved),
        holds: one.is_some_and(|it| it.holds),
        margin: one
            .and_then(|it| it.margin)
            .filter(|margin| margin.is_finite()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margin_without_a_finite_value_is_none() {
        let expectation = |margin| RowExpectation {
            name: "stands".to_owned(),
            verdict: ExpectationVerdict::Pass,
            holds: true,
            measured: None,
            bound: None,
            margin,
            unit: String::new(),
            detail: String::new(),
        };
        for (margin, found) in [(Some(0.5), Some(0.5)), (Some(f64::INFINITY), None)] {
            let observation = observation(Some(&expectation(margin)));
            assert_eq!(observation.margin, found);
            assert!(observation.is_observed && observation.holds);
        }
    }

    /// Stops the study after its first round.
    #[derive(Default)]
    struct FirstRound(Option<usize>);

    impl ProgressObserver for FirstRound {
        fn at(&mut self, _: usize, of: usize, _: &str) -> bool {
            *self.0.get_or_insert(of) == of
        }
    }

    #[test]
    fn interruption_counts_the_runs_of_all_rounds() {
        const STAND: &str = "robot = 'cheetah-cub'\nduration = '100 ms'\n[plant]\n\
            model = 'massless'\n[controller]\nkind = 'stand'\nperiod = '2 ms'\n\
            [[expect]]\nname = 'stands'\nbody = { height = { min = '1 cm' } }\n\
            after = '60 ms'\n";
        let folder = std::env::temp_dir().join(format!("twinrig-radius-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let scenario = folder.join("stand.toml");
        std::fs::write(&scenario, STAND).unwrap();
        let request = RadiusRequest {
            scenario,
            settings: Vec::new(),
            axes: Vec::new(),
            along: vec![KeyAxis {
                key: "duration".to_owned(),
                from: None,
                to: "'30 ms'".to_owned(),
            }],
            precision: 0.05,
            engine: EngineArgs::default(),
            rows: folder.join("rows"),
        };
        let registry = Registry::standard();
        let stopped = radius(&registry, &request, &mut FirstRound::default()).unwrap();
        let Err(StudyError::InterruptedRuns { done, of }) = stopped else {
            panic!("{stopped:?}");
        };
        assert!(0 < done && done < of, "{done} of {of}");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
