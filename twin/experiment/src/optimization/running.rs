//! A running optimisation: generations of points, whose missing runs an engine does.

use twinrig_campaign::optimization::{
    CaseEvaluation, CostRule, EvaluatedPoint, Evaluation, OptimizationResult, RunClass,
};
use twinrig_campaign::sweep::{RowStore, SweepRow};
use twinrig_rig::run::interrupt;

use super::outcome::OptimizationProgress;
use super::plan::OptimizationPlan;
use crate::error::Error;
use crate::runs::cases::RunCase;
use crate::runs::job::SweepJob;
use crate::runs::missing::{StoredRuns, TaskEvent, Workers};

/// Returns the evaluations of a row by the rule of each case.
pub(super) fn evaluations(rules: &[CostRule], row: &SweepRow) -> Box<[Evaluation]> {
    rules.iter().map(|rule| rule.evaluate(row)).collect()
}

/// A running optimisation.
pub(super) struct Running<'r> {
    pub(super) plan: OptimizationPlan<'r>,
    /// Evaluations of the rows on disk, by the rule of each case.
    pub(super) store: RowStore<Box<[Evaluation]>>,
    pub(super) workers: Workers<'r>,
    pub(super) result: OptimizationResult,
    pub(super) progress: OptimizationProgress,
}

impl Running<'_> {
    /// Searches to the end; returns false if an interrupt ended the search.
    pub(super) fn search(
        &mut self,
        observer: &mut dyn FnMut(&OptimizationProgress),
    ) -> Result<bool, Error> {
        let mut search = self.plan.space.search()?;
        self.progress.of = self.plan.space.iterations;
        while let Some(shares) = search.ask()? {
            self.plan.runs.points.clear();
            for shares in &shares {
                let values = self.plan.space.point(shares);
                for case in 0..self.plan.rules.len() {
                    self.plan
                        .runs
                        .add_point(case, values.clone(), &mut |_| {})?;
                }
            }
            if !self.run_missing(observer)? {
                return Ok(false);
            }
            let points: Vec<EvaluatedPoint> = self.evaluated();
            let costs: Vec<f64> = points.iter().map(|it| it.evaluation.cost).collect();
            search.tell(&costs)?;
            self.add(points);
            if interrupt::is_requested() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Runs the points of this generation that are not known, equal ones once; returns false if an
    /// interrupt left some of them.
    fn run_missing(
        &mut self,
        observer: &mut dyn FnMut(&OptimizationProgress),
    ) -> Result<bool, Error> {
        let Self {
            plan,
            store,
            workers,
            progress,
            ..
        } = self;
        let job = SweepJob {
            runs: &plan.runs,
            record: None,
        };
        let points = plan.runs.points.len();
        let missing = job.missing(0..points, store);
        progress.points = points;
        progress.done = points - missing.len();
        observer(progress);
        if missing.is_empty() {
            return Ok(true);
        }
        let ended = workers.run(&job, &missing, store, &mut |event| {
            match event {
                TaskEvent::Status(status) => progress.workers = status,
                TaskEvent::Done { .. } => {
                    progress.ran += 1;
                    progress.done += 1;
                }
            }
            observer(progress);
            true
        })?;
        progress.workers = ended.workers;
        Ok(ended.done == missing.len())
    }

    /// Returns the points of this generation, whose runs are all known.
    fn evaluated(&self) -> Vec<EvaluatedPoint> {
        let count = self.plan.runs.points.len() / self.plan.rules.len();
        let point = |index| {
            let (case, evaluation) = Evaluation::worst(&self.evaluations_of(index)?)?;
            let run = &self.plan.runs.points[self.run(index, case)];
            let numbers = run.values.iter().filter_map(|value| value.number);
            Some(EvaluatedPoint {
                generation: self.progress.generation,
                numbers: numbers.collect(),
                case,
                key: run.key,
                evaluation,
            })
        };
        (0..count).filter_map(point).collect()
    }

    /// Returns the index of the run of a point of this generation in a case.
    fn run(&self, point: usize, case: usize) -> usize {
        point * self.plan.rules.len() + case
    }

    /// Returns the evaluations of a point of this generation in all cases.
    fn evaluations_of(&self, point: usize) -> Option<Vec<Evaluation>> {
        let evaluation = |case| {
            let run = &self.plan.runs.points[self.run(point, case)];
            Some(self.store.get(&run.key)?[case])
        };
        (0..self.plan.rules.len()).map(evaluation).collect()
    }

    /// Adds a generation to the result.
    fn add(&mut self, points: Vec<EvaluatedPoint>) {
        self.progress.evaluations += points.len();
        self.progress.generation += 1;
        let cases: Vec<usize> = points.iter().map(|point| point.case).collect();
        if let Some(index) = self.result.add_generation(points) {
            let run = self.run(index, cases[index]);
            let values = self.plan.runs.points[run].values.clone();
            let command = self.plan.runs.command(run);
            let cases = self.case_evaluations(index);
            self.result.set_best(values, index, command, cases);
        }
        let best = self.result.best.as_ref().map(|best| best.evaluation);
        let best = best.filter(|best| best.class == RunClass::Feasible);
        self.progress.best = best
            .and_then(|best| best.objective)
            .map(|value| (value, self.result.unit.clone()));
    }

    /// Returns the evaluations of a point of this generation in all cases, by name; none without
    /// cases.
    fn case_evaluations(&self, point: usize) -> Vec<CaseEvaluation> {
        let evaluations = self.evaluations_of(point).unwrap_or_default();
        let cases = self.plan.runs.cases.iter().zip(evaluations);
        let evaluation = |(case, (it, evaluation)): (usize, (&RunCase, Evaluation))| {
            let run = self.run(point, case);
            Some(CaseEvaluation {
                name: it.name.clone()?,
                evaluation,
                key: self.plan.runs.points[run].key,
                command: self.plan.runs.command(run),
            })
        };
        cases.enumerate().filter_map(evaluation).collect()
    }
}

#[cfg(test)]
mod tests {
    use twinrig_rig::registry::Registry;

    use crate::optimization::execute::optimize;
    use crate::optimization::outcome::OptimizationRequest;
    use crate::options::run::EngineArgs;

    /// A robot that stands and does not fly.
    const STAND: &str = "robot = 'cheetah-cub'\nduration = '100 ms'\n[plant]\nmodel = 'massless'\n\
        [controller]\nkind = 'stand'\nperiod = '2 ms'\n[[expect]]\nname = 'stands'\n\
        body = { height = { min = '1 cm' } }\n[[expect]]\nname = 'flies'\n\
        body = { height = { min = '1 m' } }\n";
    const FLY: &str = "maximize = 'stands'\nconstraints = ['flies']\nparticles = 4\n\
        iterations = 2\n[[dimension]]\nkey = 'duration'\nfrom = '80 ms'\nto = '100 ms'\n";

    #[test]
    fn progress_begins_with_the_runs_on_disk_and_has_no_infeasible_point() {
        let folder = std::env::temp_dir().join(format!("twinrig-search-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let request = OptimizationRequest {
            scenario: file("stand.toml", STAND),
            space: file("space.toml", FLY),
            settings: Vec::new(),
            particles: None,
            iterations: None,
            seed: None,
            engine: EngineArgs::default(),
            out: folder.clone(),
        };
        let registry = Registry::standard();
        for is_on_disk in [false, true] {
            let mut seen = Vec::new();
            let found = optimize(&registry, &request, &mut |it| seen.push(it.clone())).unwrap();
            assert!(found.result.best.is_some());
            assert!(seen.iter().all(|it| it.best.is_none()));
            assert_eq!(seen.iter().all(|it| it.done == it.points), is_on_disk);
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
