//! Results of a study of load feedback.

use serde::Serialize;
use serde_json::{Value, json};

use super::load_match::{LegLoad, LoadCurve};
use super::step_slope::{StepSlope, step_slopes};
use super::{ControlStep, FeedbackCase, FeedbackInput, FeedbackPlan, FeedbackRun};
use crate::gait::run::GaitRun;
use crate::machine::Machine;
use crate::modulation::CaseResult;
use crate::parallel::RunResult;

/// Time over which the loads of a leg are drawn \[s\].
const DRAWN_S: f64 = 1.0;

/// Results of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FeedbackResult {
    /// The case.
    #[serde(skip)]
    pub case: FeedbackCase,
    /// Time of a fall \[s\].
    pub fell_at_s: Option<f64>,
    /// Mean speed of the trunk; none after a fall \[m/s\].
    pub speed_m_s: Option<f64>,
    /// Mean duty factor of the fore and of the hind legs.
    pub duty: [Option<f64>; 2],
    /// Time of the first command that differs from that of the reference, from the first step of
    /// the controller; none if all are equal \[s\].
    pub differs_after_s: Option<f64>,
    /// Root mean square of the difference of the phases from those of the reference \[rad\].
    pub phases_rad: Option<f64>,
    /// Loads of the legs.
    pub loads: Vec<LegLoad>,
    /// Displacement of footsteps after a change of the variable.
    pub steps: Vec<StepSlope>,
    /// Reason of a case without displacements.
    pub undisplaced: Option<String>,
    /// True load of the first leg, and the load that the controller takes: time \[s\], \[N\].
    #[serde(skip)]
    pub curves: [Vec<[f64; 2]>; 2],
    /// Reason of a case without results.
    pub why: Option<String>,
}

impl FeedbackResult {
    pub(crate) fn new(
        case: &FeedbackCase,
        run: &RunResult<FeedbackRun>,
        reference: &RunResult<FeedbackRun>,
        modulated: Result<&CaseResult, &str>,
        plan: &FeedbackPlan,
    ) -> Self {
        let none = FeedbackRun::default();
        let (found, why) = match run {
            Ok(run) => (run, None),
            Err(why) => (&none, Some(why.clone())),
        };
        let reference = reference.as_ref().unwrap_or(&none);
        let (steps, undisplaced) = match modulated {
            Ok(result) => (step_slopes(&result.tables), result.why.clone()),
            Err(why) => (Vec::new(), Some(why.to_owned())),
        };
        let is_fore = |leg: &str| case.fore.iter().any(|fore| fore == leg);
        let duty = |fore: bool| {
            let legs = found.gait.legs.iter().enumerate();
            let legs = legs.filter(|(_, leg)| is_fore(leg) == fore);
            mean(legs.filter_map(|(leg, _)| duty(&found.gait, leg, plan.after_s)))
        };
        Self {
            case: case.clone(),
            fell_at_s: found.gait.fell_at_s,
            speed_m_s: speed(&found.gait, plan.after_s),
            duty: [duty(true), duty(false)],
            differs_after_s: differs_after(&found.control, &reference.control),
            phases_rad: phases(&found.control, &reference.control, plan.phases_s),
            loads: loads(found, plan.after_s),
            steps,
            undisplaced,
            curves: curves(found, plan.after_s),
            why,
        }
    }

    /// Returns the root mean square error over all legs \[N\].
    pub fn error_n(&self) -> Option<f64> {
        root_mean_square(self.loads.iter().map(|load| load.error_n))
    }

    /// Returns the root mean square of the error without the delay over all legs \[N\].
    pub fn rest_n(&self) -> Option<f64> {
        root_mean_square(self.loads.iter().filter_map(|load| load.rest_n))
    }

    /// Returns the mean delay over the legs \[s\].
    pub fn delay_s(&self) -> Option<f64> {
        mean(self.loads.iter().filter_map(|load| load.delay_s))
    }

    /// Returns plant and source.
    pub fn label(&self) -> String {
        format!("{}, {}", self.case.plant, self.case.source)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    mean(values.map(|value| value * value)).map(libm::sqrt)
}

/// Returns the distance between the first and the last position of the trunk, over the time
/// between.
fn speed(run: &GaitRun, after_s: f64) -> Option<f64> {
    if run.fell_at_s.is_some() {
        return None;
    }
    let later = || run.motion.iter().filter(|it| it.at_s >= after_s);
    let (from, to) = (later().next()?, later().next_back()?);
    let way = [0, 1].map(|axis| to.trunk_m[axis] - from.trunk_m[axis]);
    let elapsed_s = to.at_s - from.at_s;
    (elapsed_s > 0.0).then(|| libm::hypot(way[0], way[1]) / elapsed_s)
}

/// Returns the mean share of the stance in the cycles of a leg.
fn duty(run: &GaitRun, leg: usize, after_s: f64) -> Option<f64> {
    let mut steps = run.footsteps_of(leg);
    steps.retain(|step| step.touch_down_s >= after_s);
    let (first, last) = (steps.first()?, steps.last()?);
    let cycles = steps[..steps.len() - 1].iter();
    let stance = cycles.filter_map(|step| Some(step.lift_off_s? - step.touch_down_s));
    let elapsed_s = last.touch_down_s - first.touch_down_s;
    (elapsed_s > 0.0).then(|| stance.sum::<f64>() / elapsed_s)
}

/// Returns the time of the first step with other commands, from the first step on: with a bus the
/// controller starts later, and steps of one number are compared.
fn differs_after(run: &[ControlStep], reference: &[ControlStep]) -> Option<f64> {
    let start_s = run.first()?.at_s;
    let mut pairs = run.iter().zip(reference);
    let other = pairs.find(|(a, b)| a.commands != b.commands)?;
    Some(other.0.at_s - start_s)
}

fn phases(run: &[ControlStep], reference: &[ControlStep], within_s: f64) -> Option<f64> {
    let start_s = run.first()?.at_s;
    let pairs = run.iter().zip(reference);
    let pairs = pairs.take_while(|(step, _)| step.at_s - start_s <= within_s);
    let differences = pairs.flat_map(|(a, b)| {
        let phases = a.phases_rad.iter().zip(&b.phases_rad);
        phases.map(|(a, b)| libm::remainder(a - b, std::f64::consts::TAU))
    });
    root_mean_square(differences)
}

fn loads(run: &FeedbackRun, after_s: f64) -> Vec<LegLoad> {
    // A robot that lies has no gait.
    let end_s = run.gait.fell_at_s.unwrap_or(f64::INFINITY);
    let counts = |at_s: f64| (after_s..end_s).contains(&at_s);
    let taken: Vec<&ControlStep> = run.control.iter().filter(|it| counts(it.at_s)).collect();
    let times_s: Vec<f64> = taken.iter().map(|step| step.at_s).collect();
    let from = run.observed_s.partition_point(|at_s| *at_s < after_s);
    let to = run.observed_s.partition_point(|at_s| *at_s < end_s);
    let legs = run.gait.legs.iter().enumerate();
    legs.filter_map(|(leg, name)| {
        let of = |loads: &[f64]| loads.get(leg).copied();
        let own: Vec<f64> = taken.iter().filter_map(|it| of(&it.loads_n)).collect();
        let plant = run.loads_n.get(from..to)?.iter();
        let plant: Vec<f64> = plant.filter_map(|loads| of(loads)).collect();
        let taken = LoadCurve {
            times_s: &times_s,
            loads_n: &own,
        };
        let true_load = LoadCurve {
            times_s: run.observed_s.get(from..to)?,
            loads_n: &plant,
        };
        LegLoad::new(name, taken, true_load)
    })
    .collect()
}

fn curves(run: &FeedbackRun, after_s: f64) -> [Vec<[f64; 2]>; 2] {
    let drawn = |at_s: f64| (after_s..after_s + DRAWN_S).contains(&at_s);
    let plant = run.observed_s.iter().zip(&run.loads_n);
    let plant = plant.filter_map(|(at_s, loads)| Some([*at_s, *loads.first()?]));
    let taken = run.control.iter();
    let taken = taken.filter_map(|step| Some([step.at_s, *step.loads_n.first()?]));
    [
        plant.filter(|it| drawn(it[0])).collect(),
        taken.filter(|it| drawn(it[0])).collect(),
    ]
}

/// Results of a study of load feedback, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackStudy {
    /// Subject of the study.
    pub input: FeedbackInput,
    /// Its parameters.
    pub plan: FeedbackPlan,
    /// Name of the variable whose change displaces footsteps.
    pub variable: String,
    /// Results of each case.
    pub cases: Vec<FeedbackResult>,
}

/// Row of the CSV file.
#[derive(Serialize)]
struct CsvRow<'a> {
    plant: &'a str,
    source: &'a str,
    lag_s: f64,
    speed_m_s: Option<f64>,
    duty_fore: Option<f64>,
    duty_hind: Option<f64>,
    phases_rad: Option<f64>,
    slopes: Vec<f64>,
    leg: &'a str,
    error_n: f64,
    delay_s: Option<f64>,
    rest_n: Option<f64>,
}

impl FeedbackStudy {
    /// Returns whether a case is the reference of its plant.
    pub fn is_reference(&self, case: usize) -> bool {
        self.input.cases[case].reference == case
    }

    /// Returns the cases whose commands are those of the reference, which makes them void.
    pub fn without_effect(&self) -> Vec<&FeedbackResult> {
        let cases = self.cases.iter().enumerate();
        let others = cases.filter(|(index, _)| !self.is_reference(*index));
        let others = others.map(|(_, result)| result);
        others
            .filter(|it| it.why.is_none() && it.differs_after_s.is_none())
            .collect()
    }

    /// Returns a summary that agrees with the tables.
    pub fn headline(&self) -> String {
        let void: Vec<String> = self.without_effect().iter().map(|it| it.label()).collect();
        if !void.is_empty() {
            let void = void.join("; ");
            return format!("Void, since all commands are those of the reference: {void}.");
        }
        if (0..self.cases.len()).all(|case| self.is_reference(case)) {
            return "No other load to compare with: give a second scenario, or --lag.".to_owned();
        }
        let sentences = self.cases.iter().enumerate().filter_map(|(index, result)| {
            if self.is_reference(index) {
                return None;
            }
            let label = result.label();
            if let Some(why) = &result.why {
                return Some(format!("{label}: {why}."));
            }
            if let Some(at_s) = result.fell_at_s {
                return Some(format!("{label}: falls at {at_s:.1} s."));
            }
            let reference = &self.cases[result.case.reference];
            let share = 100.0 * (result.speed_m_s? / reference.speed_m_s? - 1.0);
            let share = format!("{share:+.0} %").replace('-', "−");
            let phases = result.phases_rad?;
            Some(format!(
                "{label}: speed {share}, phases {phases:.2} rad off."
            ))
        });
        sentences.collect::<Vec<_>>().join(" ")
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        let cases = self.cases.iter().enumerate().map(|(index, result)| {
            let case = &result.case;
            json!({
                "plant": case.plant,
                "source": case.source,
                "signal": case.signal,
                "lag_s": case.lag_s,
                "reference": self.is_reference(index),
                "found": result,
            })
        });
        json!({
            "study": "loads",
            "name": self.input.name,
            "files": self.input.files,
            "machine": machine,
            "command": command,
            "after_s": self.plan.after_s,
            "phases_s": self.plan.phases_s,
            "variable": self.variable,
            "changes": self.plan.modulation.changes,
            "points": self.plan.modulation.points,
            "headline": self.headline(),
            "void": self.without_effect().iter().map(|it| it.label()).collect::<Vec<_>>(),
            "cases": cases.collect::<Vec<_>>(),
            "left_out": self.input.left_out,
        })
    }

    /// Returns the loads of the legs as comma-separated values, with the figures of their case.
    pub fn csv(&self) -> String {
        let rows = self.cases.iter().flat_map(|result| {
            result.loads.iter().map(|load| CsvRow {
                plant: &result.case.plant,
                source: &result.case.source,
                lag_s: result.case.lag_s,
                speed_m_s: result.speed_m_s,
                duty_fore: result.duty[0],
                duty_hind: result.duty[1],
                phases_rad: result.phases_rad,
                slopes: result.steps.iter().map(|it| it.slope).collect(),
                leg: &load.leg,
                error_n: load.error_n,
                delay_s: load.delay_s,
                rest_n: load.rest_n,
            })
        });
        crate::csv::table(&rows.collect::<Vec<_>>(), "", &[])
    }
}
