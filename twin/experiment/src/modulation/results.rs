//! Results of a study of footstep modulation.

use serde::Serialize;
use serde_json::{Value, json};
use twinrig_kernel::Unit;

use super::rerun::{Prepared, Rerun};
use super::{
    Counting, Displacement, DisplacementTable, ModelForm, ModulationCase, ModulationInput,
    ModulationPlan,
};
use crate::gait::run::GaitRun;
use crate::machine::Machine;
use crate::parallel::RunResult;

/// Mean displacement against the change that counts as erratic \[m\]: a fifth of the least change
/// of the thesis, and far above the rounding of a mean of zero.
const ERRATIC_M: f64 = 0.5e-3;

/// Slope of the displacement by geometry: feet that stand still on the ground, and a trunk that
/// takes the speed of its feet at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IdealSlope {
    /// k = 1/d: a foot moves by the step length in the share d of the cycle in which it stands. d
    /// is the commanded duty factor, or the measured one where none is commanded.
    pub by_duty: f64,
    /// k = stride over step length, both of the reference run.
    pub by_stride: f64,
    /// k₀ = ½ − 1/(2 d), in the mean over the points of the cycle: half of the change by the foot
    /// itself, and half a cycle of the changed speed.
    pub first_step: f64,
}

/// Results of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseResult {
    /// The case.
    pub case: ModulationCase,
    /// Names of the legs.
    pub legs: Vec<String>,
    /// Times of the changes \[s\].
    pub points_s: Vec<f64>,
    /// Period of the first leg \[s\].
    pub period_s: f64,
    /// Mean duty factor of the reference run.
    pub measured_duty: f64,
    /// Number of re-runs.
    pub runs: usize,
    /// Number of those that fell.
    pub fell: usize,
    /// Reasons of those that failed.
    pub failed: Vec<String>,
    /// Displacements of all footsteps.
    pub displacements: Vec<Displacement>,
    /// Statistics, for each way of counting.
    pub tables: Vec<DisplacementTable>,
    /// Slope by geometry; none if the variable is not a length.
    pub ideal: Option<IdealSlope>,
    /// Reason of a case without results.
    pub why: Option<String>,
}

impl CaseResult {
    pub(crate) fn new(
        case: &ModulationCase,
        prepared: &RunResult<Prepared>,
        runs: &[RunResult<GaitRun>],
        plan: &ModulationPlan,
        is_length: bool,
    ) -> Self {
        let mut result = Self {
            case: case.clone(),
            legs: Vec::new(),
            points_s: Vec::new(),
            period_s: 0.0,
            measured_duty: 0.0,
            runs: 0,
            fell: 0,
            failed: Vec::new(),
            displacements: Vec::new(),
            tables: Vec::new(),
            ideal: None,
            why: None,
        };
        let prepared = match prepared {
            Ok(prepared) => prepared,
            Err(why) => {
                // Without its remedy, which is that of a study of one case.
                result.why = why.lines().next().map(str::to_owned);
                return result;
            }
        };
        for (index, run) in runs.iter().enumerate() {
            result.runs += 1;
            match run {
                Ok(run) => {
                    result.fell += usize::from(run.fell_at_s.is_some());
                    let of_run = prepared.displacements(run, Rerun::of(index, plan), plan);
                    result.displacements.extend(of_run);
                }
                Err(why) => result.failed.push(why.clone()),
            }
        }
        let table =
            |counting| DisplacementTable::new(counting, &result.displacements, &plan.changes);
        result.tables = Counting::ALL.map(table).into();
        let reference = &prepared.reference;
        result.legs.clone_from(&reference.run.legs);
        result.points_s = prepared.points.iter().map(|at| at.as_secs_f64()).collect();
        result.period_s = reference.periods_s.first().copied().unwrap_or(0.0);
        result.measured_duty = reference.duty;
        let duty = case.duty.unwrap_or(reference.duty);
        result.ideal = (is_length && case.value > 0.0 && duty > 0.0).then(|| IdealSlope {
            by_duty: 1.0 / duty,
            by_stride: reference.stride_m / case.value,
            first_step: 0.5 - 0.5 / duty,
        });
        result
    }

    /// Returns the statistics by one way of counting; none without results.
    pub fn table(&self, counting: Counting) -> Option<&DisplacementTable> {
        self.tables.iter().find(|table| table.counting == counting)
    }

    /// Returns gait, plant and factor.
    pub fn label(&self) -> String {
        let ModulationCase {
            gait,
            plant,
            factor,
            ..
        } = &self.case;
        format!("{gait}, {plant}, {factor}")
    }
}

/// Results of a study of modulation, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationStudy {
    /// Subject of the study.
    pub input: ModulationInput,
    /// Its parameters.
    pub plan: ModulationPlan,
    /// Results of each case.
    pub cases: Vec<CaseResult>,
}

/// Row of the CSV file.
#[derive(Serialize)]
struct CsvRow<'a> {
    gait: &'a str,
    plant: &'a str,
    factor: &'a str,
    counting: Counting,
    by: f64,
    point: usize,
    change_s: Option<f64>,
    leg: Option<&'a String>,
    step: usize,
    displacement_m: Option<f64>,
}

impl ModulationStudy {
    /// Returns a change of the variable with its unit, in millimetres if it is a length.
    pub fn change_text(&self, by: f64) -> String {
        match self.input.unit {
            Unit::Meter => format!("{} mm", short(1e3 * by)),
            Unit::One => short(by),
            unit => format!("{} {}", short(by), unit.symbol()),
        }
    }

    /// Returns whether the greatest mean displacement of a table against the change counts as
    /// erratic.
    pub fn is_erratic(table: &DisplacementTable) -> bool {
        table.opposite_m() > ERRATIC_M
    }

    /// Returns the error of a study of which no re-run has a result.
    pub fn error(&self) -> Option<String> {
        let runs: usize = self.cases.iter().map(|case| case.runs).sum();
        let mut failed = self.cases.iter().flat_map(|case| &case.failed);
        let first = failed.next()?.lines().next().unwrap_or_default();
        let all_failed = 1 + failed.count() == runs;
        all_failed.then(|| format!("error: none of {runs} re-runs has a result: {first}"))
    }

    /// Returns a summary that agrees with the tables.
    pub fn headline(&self) -> String {
        let done: Vec<&CaseResult> = self.cases.iter().filter(|it| it.why.is_none()).collect();
        match done[..] {
            [] => "No case has results.".to_owned(),
            [case] => self.headline_of(case),
            _ => Self::headline_of_all(&done),
        }
    }

    fn headline_of(&self, case: &CaseResult) -> String {
        let mut sentences = Vec::new();
        for table in &case.tables {
            let counting = table.counting.name();
            let Some(model) = table.model(ModelForm::BilinearWithFirstStep) else {
                sentences.push(format!("By {counting} there is no displacement."));
                continue;
            };
            let first = table.first_step.map_or(String::new(), |share| {
                format!(
                    ", the first step with the change in {:.0} %",
                    (100.0 * share).floor()
                )
            });
            let opposite = table.opposite.map_or_else(
                || "no mean is against it".to_owned(),
                |cell| {
                    format!(
                        "the greatest mean against it is {:.1} mm (step {}, {})",
                        1e3 * table.opposite_m(),
                        cell.step,
                        self.change_text(cell.by)
                    )
                },
            );
            sentences.push(format!(
                "By {counting} the displacement is {:.2} Δ per step (R² {:.3}){first}; {opposite}.",
                model.slope, model.r_squared
            ));
        }
        sentences.extend(falls(&[case]));
        sentences.join(" ")
    }

    fn headline_of_all(cases: &[&CaseResult]) -> String {
        let mut factors: Vec<&str> = Vec::new();
        for case in cases {
            if !factors.contains(&&*case.case.factor) {
                factors.push(&case.case.factor);
            }
        }
        let counted = |factor: &str, counting: Counting| {
            let of_factor = cases.iter().filter(|it| it.case.factor == factor);
            let tables: Vec<&DisplacementTable> =
                of_factor.filter_map(|it| it.table(counting)).collect();
            let erratic = tables
                .iter()
                .filter(|table| Self::is_erratic(table))
                .count();
            let models = tables.iter();
            let models = models.filter_map(|table| table.model(ModelForm::BilinearWithFirstStep));
            let none = [f64::INFINITY, f64::NEG_INFINITY];
            let [low, high] = models.fold(none, |[low, high], model| {
                [low.min(model.r_squared), high.max(model.r_squared)]
            });
            let range = if low > high {
                String::new()
            } else {
                format!(" (R² {} to {})", short(low), short(high))
            };
            let (of, counting) = (tables.len(), counting.name());
            format!("{erratic} of {of} by {counting}{range}")
        };
        let parts = factors.iter().map(|factor| {
            let parts = Counting::ALL.map(|counting| counted(factor, counting));
            format!("{factor}: {}", parts.join(", "))
        });
        let parts: Vec<String> = parts.collect();
        let sentence = format!(
            "Cases with a mean displacement of more than {} mm against the change: {}.",
            short(1e3 * ERRATIC_M),
            parts.join("; ")
        );
        let sentences = std::iter::once(sentence).chain(falls(cases));
        sentences.collect::<Vec<_>>().join(" ")
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        let cases: Vec<Value> = self.cases.iter().map(case_json).collect();
        json!({
            "study": "modulation",
            "scenario": self.input.name,
            "files": self.input.files,
            "machine": machine,
            "command": command,
            "variable": self.input.variable,
            "unit": self.input.unit.symbol(),
            "changes": self.plan.changes,
            "points": self.plan.points,
            "steps": self.plan.steps,
            "headline": self.headline(),
            "cases": cases,
            "left_out": self.input.left_out,
        })
    }

    /// Returns all displacements as comma-separated values.
    pub fn csv(&self) -> String {
        let rows = self.cases.iter().flat_map(|case| {
            case.displacements.iter().map(|it| CsvRow {
                gait: &case.case.gait,
                plant: &case.case.plant,
                factor: &case.case.factor,
                counting: it.counting,
                by: it.by,
                point: it.point,
                change_s: case.points_s.get(it.point).copied(),
                leg: case.legs.get(it.leg),
                step: it.step,
                displacement_m: it.along_m,
            })
        });
        crate::csv::table(&rows.collect::<Vec<_>>(), "", &[])
    }
}

/// Returns a sentence on runs without a complete result; none if there are none.
fn falls(cases: &[&CaseResult]) -> Option<String> {
    let sum = |of: &dyn Fn(&CaseResult) -> usize| cases.iter().map(|case| of(case)).sum::<usize>();
    let (fell, failed) = (sum(&|it| it.fell), sum(&|it| it.failed.len()));
    (fell + failed > 0).then(|| {
        let runs = sum(&|it| it.runs);
        format!("Of {runs} re-runs {fell} fell and {failed} failed.")
    })
}

fn case_json(case: &CaseResult) -> Value {
    json!({
        "gait": case.case.gait,
        "plant": case.case.plant,
        "factor": case.case.factor,
        "value": case.case.value,
        "after_s": case.case.after.as_secs_f64(),
        "points_s": case.points_s,
        "period_s": case.period_s,
        "commanded_duty": case.case.duty,
        "measured_duty": case.measured_duty,
        "ideal": case.ideal,
        "runs": case.runs,
        "fell": case.fell,
        "failed": case.failed,
        "tables": case.tables,
        "why": case.why,
    })
}

/// Formats a number without trailing zeros.
fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        text => text.replace('-', "−"),
    }
}
