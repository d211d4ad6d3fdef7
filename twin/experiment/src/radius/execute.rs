//! Execution of studies of radii.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use twinrig_campaign::engine::{Engine, EngineOptions};
use twinrig_campaign::radius::{
    AxisResult, AxisSearch, DisturbanceAxis, Observation, RadiusResult, RunOutcome,
};
use twinrig_campaign::sweep::{
    ExpectationVerdict, Partition, RowExpectation, RowKey, RowLog, SweepRow,
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
use crate::runs::plan::{RunPlan, RunRequest};
use crate::runs::tasks::{RunTasks, TaskEvent, engine};
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
    let mut known = BTreeMap::new();
    let (log, opened) = RowLog::open(&request.rows, Partition::WHOLE, &mut |key, row| {
        known.entry(key).or_insert_with(|| outcome(&row, &names));
    })?;
    let searches = axes.into_iter().map(|axis| {
        let search = AxisSearch::new(axis.values, names.len(), request.precision);
        (axis, search)
    });
    let mut searching = Searching {
        searches: searches.collect(),
        names: &names,
        runs,
        log,
        known,
        engine: engine(registry, &request.engine.engine)?,
        options: request.engine.options(),
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
    let lines = opened.torn.iter().chain(&opened.damaged);
    Ok(Ok(RadiusOutcome {
        result: searching.result(request, left_out),
        notes: lines.map(ToString::to_string).collect(),
        ran: searching.ran,
        runs: searching.taken.len(),
    }))
}

/// A study in progress.
struct Searching<'r> {
    searches: Vec<(DisturbanceAxis, AxisSearch)>,
    names: &'r [String],
    runs: RunPlan<'r>,
    log: RowLog,
    /// Outcomes of the rows on disk.
    known: BTreeMap<RowKey, RunOutcome>,
    /// Keys of the rows of this study.
    taken: BTreeSet<RowKey>,
    engine: &'r dyn Engine,
    options: EngineOptions,
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
            if !self.run_missing(observer)? {
                let (done, of) = (self.taken.len(), self.taken.len() + proposals.len());
                return Ok(Err(StudyError::InterruptedRuns { done, of }));
            }
            for Proposal { axis, size, run } in proposals {
                let outcome = match run {
                    Ok(index) => {
                        let key = self.runs.points[index].key;
                        self.taken.insert(key);
                        self.known[&key].clone()
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

    /// Does the planned runs that are not known, equal ones once; returns false if an interrupt
    /// left some of them.
    fn run_missing(&mut self, observer: &mut dyn ProgressObserver) -> Result<bool, Error> {
        let Self {
            runs, log, known, ..
        } = self;
        let points = &runs.points;
        let mut keys = BTreeSet::new();
        let missing: Vec<usize> = (0..points.len())
            .filter(|&index| !known.contains_key(&points[index].key))
            .filter(|&index| keys.insert(points[index].key))
            .collect();
        let all = self.taken.len() + points.len();
        let mut left = missing.len();
        let mut at = |left: usize| observer.at(all - left, all, "runs");
        if !at(left) {
            return Ok(false);
        }
        let tasks = RunTasks {
            runs,
            engine: self.engine,
            options: &self.options,
            record: None,
        };
        tasks.run(&missing, &mut |event| {
            if let TaskEvent::Done { point, result } = event {
                let key = points[point].key;
                log.append(key, &result.row)?;
                known.insert(key, outcome(&result.row, self.names));
                left -= 1;
                self.ran += 1;
            }
            at(left);
            Ok(())
        })?;
        Ok(left == 0 && !interrupt::is_requested())
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
