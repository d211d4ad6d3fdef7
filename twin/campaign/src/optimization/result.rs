//! Result of an optimisation: a function of scenario, search space and build.

use serde::Serialize;
use twinrig_kernel::Unit;

use super::cost::{Evaluation, RunClass};
use super::space::{Direction, SearchMethod, SpaceDimension};
use crate::sweep::{RowKey, SweepRow, SweepValue};

/// Share of a range within which the best point touches a bound.
const TOUCHES: f64 = 1e-3;

/// Verdict of an optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OptimizationVerdict {
    /// The search has ended with a feasible point.
    Found,
    /// The search has ended, and no point is feasible.
    Infeasible,
    /// The search has ended, and the objective has no value in most points without a fall: it has
    /// sought where the objective can be observed.
    Unobserved,
    /// An interrupt ended the search; the same command continues it.
    Interrupted,
}

impl OptimizationVerdict {
    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Infeasible => "infeasible",
            Self::Unobserved => "unobserved",
            Self::Interrupted => "interrupted",
        }
    }

    /// Returns the exit code.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Found => 0,
            Self::Infeasible | Self::Unobserved => 1,
            Self::Interrupted => 2,
        }
    }
}

/// Result of an optimisation.
#[derive(Clone, Debug, Serialize)]
pub struct OptimizationResult {
    /// Name.
    pub name: String,
    /// Verdict.
    pub verdict: OptimizationVerdict,
    /// File of the search space, as given.
    pub space: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Its file, as given.
    pub file: String,
    /// Hash of the program.
    pub build: String,
    /// Settings of all runs.
    pub settings: Vec<(String, String)>,
    /// Method.
    pub method: SearchMethod,
    /// Points of the first generation.
    pub particles: usize,
    /// Greatest number of generations after the first one.
    pub iterations: usize,
    /// Restarts of CMA-ES after convergence.
    pub restarts: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Name of the expectation whose measured value is the objective.
    pub objective: String,
    /// Symbol of its unit.
    pub unit: String,
    /// Which values of it are sought.
    pub direction: Direction,
    /// Names of the expectations that have to hold.
    pub constraints: Vec<String>,
    /// Dimensions.
    pub dimensions: Vec<OptimizedDimension>,
    /// Names of the cases; none if a point has one run, of the scenario.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cases: Vec<String>,
    /// Numbers of evaluations.
    pub counts: EvaluationCounts,
    /// Simulated time of a point without a fall \[s\], of all its runs; none if it is searched.
    pub duration_s: Option<f64>,
    /// Share of the simulated time that ends by falls saved.
    pub saved: Option<f64>,
    /// Best point; none before the first generation.
    pub best: Option<BestPoint>,
    /// Error of the first run that has one.
    pub error: Option<String>,
    /// Reason for which the objective has no value, of the first point without a fall that has
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unobserved: Option<String>,
    /// Generations, in their order.
    pub history: Vec<Generation>,
    /// Hash of all points and their costs.
    pub hash: String,
    /// All points, in the order of their evaluation.
    #[serde(skip)]
    pub points: Vec<EvaluatedPoint>,
}

/// A dimension of an optimisation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OptimizedDimension {
    /// Dotted key of the scenario.
    pub key: String,
    /// Unit of the bounds.
    #[serde(serialize_with = "symbol")]
    pub unit: Unit,
    /// Lower bound.
    pub from: f64,
    /// Upper bound.
    pub to: f64,
    /// Whether ratios count instead of differences.
    pub logarithmic: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn symbol<S: serde::Serializer>(unit: &Unit, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(unit.symbol())
}

/// Numbers of evaluations. Points that a search proposes again count again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct EvaluationCounts {
    /// All.
    pub evaluations: usize,
    /// Those whose constraints all hold.
    pub feasible: usize,
    /// Those that violate a constraint.
    pub infeasible: usize,
    /// Those without a value of the objective.
    pub unobserved: usize,
    /// Those that did not complete.
    pub error: usize,
    /// Those in which the robot fell.
    pub fell: usize,
}

/// Best point of an optimisation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BestPoint {
    /// Values of the dimensions.
    pub point: Vec<SweepValue>,
    /// Number of its first evaluation, from 1.
    pub number: usize,
    /// Its generation.
    pub generation: usize,
    /// Evaluation; of several cases that of the worst one.
    #[serde(flatten)]
    pub evaluation: Evaluation,
    /// Its evaluations in all cases; none if there are no cases.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cases: Vec<CaseEvaluation>,
    /// Keys of the dimensions whose bounds it touches, with the bound.
    pub at_bounds: Vec<(String, String)>,
    /// Key of its row.
    pub key: RowKey,
    /// Command that repeats its run.
    pub command: String,
    /// Its row; none while the search has not ended.
    pub row: Option<SweepRow>,
}

/// Evaluation of a point in a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseEvaluation {
    /// Name of the case.
    pub name: String,
    /// Evaluation.
    #[serde(flatten)]
    pub evaluation: Evaluation,
    /// Key of its row.
    pub key: RowKey,
    /// Command that repeats its run.
    pub command: String,
}

/// Summary of a generation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Generation {
    /// Its number, from 0.
    pub generation: usize,
    /// Evaluations up to its end.
    pub evaluations: usize,
    /// Objective of the best point so far.
    pub best: Option<f64>,
    /// Median of the objective over its points that have one.
    pub median: Option<f64>,
    /// Share of its points that are feasible.
    pub feasible: f64,
    /// Cost of the best point so far.
    pub cost: f64,
}

/// A point with its evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluatedPoint {
    /// Number of its generation.
    pub generation: usize,
    /// Values of the dimensions, in their SI units.
    pub numbers: Vec<f64>,
    /// Index of the case that counts, the worst one; 0 if there are no cases.
    pub case: usize,
    /// Key of its row.
    pub key: RowKey,
    /// Evaluation.
    pub evaluation: Evaluation,
}

impl OptimizedDimension {
    /// Returns the dimension with its dotted key.
    pub fn new(key: &str, dimension: &SpaceDimension) -> Self {
        let interval = dimension.interval;
        Self {
            key: key.to_owned(),
            unit: interval.unit,
            from: interval.from,
            to: interval.to,
            logarithmic: interval.logarithmic,
        }
    }
}

impl OptimizationResult {
    /// Adds a generation; returns the index in it of a new best point.
    pub fn add_generation(&mut self, points: Vec<EvaluatedPoint>) -> Option<usize> {
        let before = self.history.last().map_or(f64::INFINITY, |it| it.cost);
        let (mut cost, mut best) = (before, None);
        for (index, point) in points.iter().enumerate() {
            self.counts.add(&point.evaluation);
            if point.evaluation.cost < cost {
                (cost, best) = (point.evaluation.cost, Some(index));
            }
        }
        let values = points.iter().filter_map(|it| it.evaluation.objective);
        let median = median(values.collect());
        let is_feasible = |point: &&EvaluatedPoint| point.evaluation.class == RunClass::Feasible;
        let feasible = points.iter().filter(is_feasible).count();
        let last = self.history.last().and_then(|it| it.best);
        self.history.push(Generation {
            generation: self.history.len(),
            evaluations: self.counts.evaluations,
            best: best.map_or(last, |index| points[index].evaluation.objective),
            median,
            feasible: feasible as f64 / points.len().max(1) as f64,
            cost,
        });
        self.points.extend(points);
        best
    }

    /// Sets the best point, a point of the last generation, with the command of its run and its
    /// evaluations in all cases.
    pub fn set_best(
        &mut self,
        values: Vec<SweepValue>,
        index: usize,
        command: String,
        cases: Vec<CaseEvaluation>,
    ) {
        let generation = self.history.len().saturating_sub(1);
        let of_last = |point: &EvaluatedPoint| point.generation == generation;
        let first = self.points.partition_point(|point| !of_last(point));
        let Some(point) = self.points.get(first + index) else {
            return;
        };
        self.best = Some(BestPoint {
            at_bounds: self.touched(&point.numbers, &values),
            point: values,
            number: first + index + 1,
            generation,
            evaluation: point.evaluation,
            cases,
            key: point.key,
            command,
            row: None,
        });
    }

    /// Returns the dimensions whose bounds a point touches, with the bound.
    fn touched(&self, numbers: &[f64], values: &[SweepValue]) -> Vec<(String, String)> {
        let dimensions = self.dimensions.iter().zip(numbers).zip(values);
        dimensions
            .filter_map(|((dimension, &number), value)| {
                let share = dimension.share_of(number);
                let touches = !(TOUCHES..=1.0 - TOUCHES).contains(&share);
                touches.then(|| (dimension.key.clone(), value.shown().to_owned()))
            })
            .collect()
    }

    /// Completes the result: verdict and hash.
    #[must_use]
    pub fn judged(mut self, is_interrupted: bool) -> Self {
        let best = self.best.as_ref();
        self.verdict = if is_interrupted {
            OptimizationVerdict::Interrupted
        } else if 2 * self.without_value() > self.points.len() {
            OptimizationVerdict::Unobserved
        } else if best.is_some_and(|best| best.evaluation.class == RunClass::Feasible) {
            OptimizationVerdict::Found
        } else {
            OptimizationVerdict::Infeasible
        };
        self.saved = self.duration_s.map(|duration| {
            let runs = self.points.iter().map(|point| point.evaluation);
            // A run with an error has not been ended by a fall.
            let completed = runs.filter(|run| run.class != RunClass::Error);
            let [ran, all] = completed.fold([0.0, 0.0], |[ran, all], run| {
                [ran + run.simulated_s, all + duration]
            });
            if all > 0.0 { (all - ran) / all } else { 0.0 }
        });
        let mut hasher = blake3::Hasher::new();
        for point in &self.points {
            for number in point.numbers.iter().chain([&point.evaluation.cost]) {
                hasher.update(&number.to_le_bytes());
            }
        }
        self.hash = hasher.finalize().to_hex().to_string();
        self
    }

    /// Returns the number of points without a value of the objective, for another reason than a
    /// fall: falls are ordered by their time.
    pub fn without_value(&self) -> usize {
        self.points
            .iter()
            .filter(|point| lacks_value(point))
            .count()
    }

    /// Returns the first of these points.
    pub fn first_without_value(&self) -> Option<&EvaluatedPoint> {
        self.points.iter().find(|point| lacks_value(point))
    }

    /// Returns the first point whose run has an error.
    pub fn first_error(&self) -> Option<&EvaluatedPoint> {
        let is_error = |point: &&EvaluatedPoint| point.evaluation.class == RunClass::Error;
        self.points.iter().find(is_error)
    }

    /// Returns the warning about bounds that the best point touches.
    pub fn warning(&self) -> Option<String> {
        let touched = &self.best.as_ref()?.at_bounds;
        let texts: Vec<String> = touched
            .iter()
            .map(|(key, bound)| format!("{key} ({bound})"))
            .collect();
        (!texts.is_empty()).then(|| {
            format!(
                "the best point touches bounds of the search space, beyond which a better one may \
                 be: {}",
                texts.join(", ")
            )
        })
    }
}

fn lacks_value(point: &EvaluatedPoint) -> bool {
    let Evaluation {
        class, fell_at_s, ..
    } = point.evaluation;
    class == RunClass::Unobserved && fell_at_s.is_none()
}

impl OptimizedDimension {
    /// Returns the share of the range at a number.
    pub fn share_of(&self, number: f64) -> f64 {
        let place = |number: f64| {
            if self.logarithmic {
                libm::log(number)
            } else {
                number
            }
        };
        let (from, to) = (place(self.from), place(self.to));
        (place(number) - from) / (to - from)
    }
}

impl EvaluationCounts {
    fn add(&mut self, evaluation: &Evaluation) {
        self.evaluations += 1;
        self.fell += usize::from(evaluation.fell_at_s.is_some());
        let count = match evaluation.class {
            RunClass::Feasible => &mut self.feasible,
            RunClass::Infeasible => &mut self.infeasible,
            RunClass::Unobserved => &mut self.unobserved,
            RunClass::Error => &mut self.error,
        };
        *count += 1;
    }
}

/// Median; the mean of both middle ones of an even number.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(0.5 * lower + 0.5 * upper)
}
