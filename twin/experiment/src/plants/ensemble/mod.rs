//! Ensembles of perturbed walks: statistics of each model where single trajectories diverge.

mod gait;
pub(crate) mod interval;

pub use interval::Interval;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Stream, stream};
use twinrig_rig::start::perturb_trunk;
use twinrig_rig::{MethodOffer, MethodSetting, PlantOffer, Scales, SettingKind, Variant};

use crate::budget::{Share, Weight};
use crate::error::StudyError;
use crate::measured::Measured;
use crate::plants::plant_run::{Ending, PlantRun};
use crate::plants::precision_job::{Job, Runs};
use crate::plants::reference::ended;
use crate::plants::row::VariantKey;
use crate::plants::transport::{SETTLING, TOLERANCE, TRANSPORT_DURATION, usual_method};
use crate::stopwatch::Stopwatch;
use gait::{GaitRecorder, Quantity};

/// Name of the random stream of the perturbations: the same for every model.
const STREAM: &str = "study/ensemble";
/// Divisors of the scenario's step, the largest first: the shortest step that the budget allows, at
/// most half of the scenario's.
const FINER: [u64; 3] = [20, 10, 4];
const FINEST_ANYWAY: u64 = 2;
/// One walk of so many is repeated at a coarser setting.
const COARSER_SHARE: usize = 5;
/// Share of the time for the walks at the finer setting.
const MAIN_SHARE: f64 = 0.8;

/// Walks of a model from perturbed starts, under the same commands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    /// Plant, method and setting.
    #[serde(flatten)]
    pub key: VariantKey,
    /// Simulated duration of each walk \[s\].
    pub simulated_s: f64,
    /// Number of completed walks.
    pub completed: usize,
    /// Number of walks in which the robot fell.
    pub fell: usize,
    /// Number of walks that failed otherwise.
    pub failed: usize,
    /// Reason of the first failure, or of the absence of walks.
    pub why: Option<String>,
    /// Quantities of the completed walks.
    pub quantities: Vec<QuantityInterval>,
}

/// Quantity of a gait over an ensemble.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuantityInterval {
    /// Name: `speed`, `duty factor`, `phase LEG`, `footstep spread`.
    pub quantity: String,
    /// Unit; empty for shares.
    pub unit: String,
    /// Mean, with the 95 % confidence interval.
    #[serde(flatten)]
    pub interval: Interval,
    /// Change of the mean at twice the step or ten times the tolerance: the error of the method.
    pub method_error: Option<f64>,
}

impl QuantityInterval {
    /// Returns the interval widened by the error of the method; `None` if that is unknown.
    pub(crate) fn widened(&self) -> Option<Interval> {
        let by = self.method_error?;
        Some(Interval {
            low: self.interval.low - by,
            high: self.interval.high + by,
            ..self.interval
        })
    }

    /// Returns the mean and half the width of the interval with unit, both to the second digit of
    /// the latter.
    pub fn rounded(&self) -> (String, String) {
        let half = 0.5 * (self.interval.high - self.interval.low);
        // Lengths of millimetres and less.
        let (scale, unit) = match &*self.unit {
            "m" => (1e3, " mm"),
            "m/s" => (1.0, " m/s"),
            _ => (1.0, ""),
        };
        let digits = if half > 0.0 {
            (1.0 - libm::floor(libm::log10(scale * half))).clamp(0.0, 5.0)
        } else {
            5.0
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 5"
        )]
        let digits = digits as usize;
        let mean = format!("{:.digits$}", scale * self.interval.mean);
        (mean, format!("{:.digits$}{unit}", scale * half))
    }
}

impl Ensemble {
    /// Records the errors of the method from the same walks at a coarser setting.
    fn note_method_errors(&mut self, coarser: &Self) {
        for quantity in &mut self.quantities {
            let mut others = coarser.quantities.iter();
            let other = others.find(|other| other.quantity == quantity.quantity);
            let change = other.map(|other| other.interval.mean - quantity.interval.mean);
            quantity.method_error = change.map(f64::abs);
        }
    }
}

/// Returns the number of ensembles.
pub(crate) fn parts(plants: &[PlantOffer], walks: usize) -> usize {
    if walks > 0 { plants.len() } else { 0 }
}

impl Measured for Ensemble {}

impl Job<'_> {
    /// Computes the ensemble of each plant.
    pub(crate) fn ensembles(&mut self, plants: &[PlantOffer]) -> Result<Vec<Ensemble>, StudyError> {
        let runs = self.runs;
        let walks = runs.plan.ensemble;
        if walks == 0 {
            return Ok(Vec::new());
        }
        let mut ensembles = Vec::new();
        for plant in plants {
            let label = format!("{}, ensemble", plant.plant);
            let Some(method) = usual_method(plant) else {
                self.parts.begin(&label, Weight::Ensemble)?;
                continue;
            };
            let content = ("ensemble", &plant.plant, method, walks);
            let ensemble = self
                .parts
                .measure(&label, Weight::Ensemble, &content, |share| {
                    runs.affordable_ensemble(plant, method, share)
                })?;
            ensembles.push(ensemble);
        }
        Ok(ensembles)
    }
}

impl Runs<'_> {
    /// Returns the ensemble of a plant at the finest setting that the share allows, with the error
    /// of the method.
    fn affordable_ensemble(
        &self,
        plant: &PlantOffer,
        method: &MethodOffer,
        share: Share,
    ) -> Ensemble {
        let walks = self.plan.ensemble;
        let variant = |setting| Variant {
            plant: plant.plant.clone(),
            method: method.name.clone(),
            setting,
            scales: Scales::AS_IS,
        };
        let step = self.context.factory.input().step;
        let usual = variant(match method.set_by {
            SettingKind::Step => MethodSetting::Step(step),
            SettingKind::Tolerance => MethodSetting::Tolerance(TOLERANCE),
        });
        let setting = match usual.setting {
            MethodSetting::Step(_) => {
                let walk_s = self.timed_walk(&usual, share).unwrap_or(f64::INFINITY);
                let affordable = |divisor: &u64| {
                    walk_s * (*divisor as f64) * (walks as f64) < MAIN_SHARE * share.seconds
                };
                let divisor = FINER.into_iter().find(affordable).unwrap_or(FINEST_ANYWAY);
                MethodSetting::Step(SimDuration::from_nanos(step.as_nanos() / divisor))
            }
            tolerance @ MethodSetting::Tolerance(_) => tolerance,
        };
        let main = share.fraction(MAIN_SHARE);
        let mut ensemble = self.ensemble(&variant(setting), walks, main);
        let few = walks.div_ceil(COARSER_SHARE).max(2);
        let rest = share.fraction(1.0 - MAIN_SHARE);
        let coarser = self.ensemble(&variant(setting.coarser()), few, rest);
        ensemble.note_method_errors(&coarser);
        ensemble
    }

    fn ensemble_run(&self, share: Share) -> PlantRun<'_> {
        let input = self.context.factory.input();
        let grid = input.step.max(SimDuration::from_nanos(1));
        let end = TRANSPORT_DURATION.min(input.duration);
        PlantRun {
            grid,
            end: SimTime::ZERO + grid * (end.as_nanos() / grid.as_nanos()),
            ..self.context.plant_run(share)
        }
    }

    /// Returns the run time of a walk from a perturbed start, if it completes \[s\].
    fn timed_walk(&self, variant: &Variant, share: Share) -> Option<f64> {
        let stopwatch = Stopwatch::start();
        let walk = self.perturbed_walk(variant, share, &mut stream(0, STREAM));
        matches!(walk, Ok((_, Ending::Completed))).then(|| stopwatch.elapsed_s())
    }

    /// Runs the walks of a variant until the share is spent.
    fn ensemble(&self, variant: &Variant, walks: usize, share: Share) -> Ensemble {
        let end = self.ensemble_run(share).end;
        let mut ensemble = Ensemble {
            key: variant.into(),
            simulated_s: end.as_secs_f64(),
            completed: 0,
            fell: 0,
            failed: 0,
            why: None,
            quantities: Vec::new(),
        };
        let mut all: Vec<Quantity> = Vec::new();
        let mut perturbations = stream(0, STREAM);
        for n in 0..walks {
            match self.perturbed_walk(variant, share, &mut perturbations) {
                Ok((gait, Ending::Completed)) => {
                    ensemble.completed += 1;
                    all.extend(gait.quantities());
                }
                Ok((gait, _)) if gait.fell => ensemble.fell += 1,
                Ok((_, Ending::OverBudget(_))) => {
                    let why = format!("the budget ended after {n} of {walks} walks");
                    ensemble.why.get_or_insert(why);
                    break;
                }
                Ok((_, ending)) => {
                    ensemble.failed += 1;
                    if let Some((_, why)) = ended(&ending, share) {
                        ensemble.why.get_or_insert(why);
                    }
                }
                Err(why) => {
                    // It fails alike for every perturbation.
                    ensemble.why.get_or_insert(why);
                    break;
                }
            }
        }
        ensemble.quantities = intervals(&all);
        ensemble
    }

    /// Runs a variant from a start perturbed by the next numbers of `perturbations`.
    fn perturbed_walk(
        &self,
        variant: &Variant,
        share: Share,
        perturbations: &mut Stream,
    ) -> Result<(GaitRecorder, Ending), String> {
        let plant_run = self.ensemble_run(share);
        let settled_s = SETTLING * plant_run.end.as_secs_f64();
        let settled = SimTime::ZERO + SimDuration::try_from_secs_f64(settled_s).unwrap_or_default();
        let run = self.context.with_plant(variant, |plant| {
            perturb_trunk(plant, perturbations)?;
            let mut gait =
                GaitRecorder::of(plant, settled).ok_or("it has no output body/position")?;
            let ending = plant_run.run(plant, |now, plant| gait.sample(now, plant));
            Ok::<_, String>((gait, ending))
        });
        run?
    }
}

/// Returns the interval of each quantity, in the order of the first walk.
fn intervals(all: &[Quantity]) -> Vec<QuantityInterval> {
    let mut names: Vec<(&str, &'static str)> = Vec::new();
    for (name, unit, _) in all {
        if !names.contains(&(name, unit)) {
            names.push((name, unit));
        }
    }
    let intervals = names.into_iter().filter_map(|(name, unit)| {
        let values = all.iter().filter(|(known, ..)| known == name);
        let values: Vec<f64> = values.map(|(.., value)| *value).collect();
        Some(QuantityInterval {
            quantity: name.to_owned(),
            unit: unit.to_owned(),
            interval: Interval::of(&values)?,
            method_error: None,
        })
    });
    intervals.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_is_rounded_to_two_digits_of_its_uncertainty() {
        let rounded = |unit: &str, mean, half| {
            let interval = Interval {
                mean,
                low: mean - half,
                high: mean + half,
                deviation: half,
            };
            let quantity = String::new();
            let quantity = QuantityInterval {
                quantity,
                unit: unit.to_owned(),
                interval,
                method_error: None,
            };
            let (mean, half) = quantity.rounded();
            format!("{mean} ± {half}")
        };
        assert_eq!(rounded("m/s", 0.957_123, 0.000_12), "0.95712 ± 0.00012 m/s");
        assert_eq!(rounded("m", 0.001_5, 0.000_2), "1.50 ± 0.20 mm");
        assert_eq!(rounded("", 0.5, 0.0), "0.50000 ± 0.00000");
    }
}
