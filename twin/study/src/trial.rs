//! Runs at one step: whether it is stable, how far it is from the reference, what it costs.

use twinrig_kernel::{SimDuration, SimTime};

use crate::budget::Share;
use crate::factory::Variant;
use crate::number::instant;
use crate::plant_run::{Ending, PlantRun};
use crate::precision::RUNAWAY;
use crate::reference::{Reference, Stage, ended};
use crate::row::Row;
use crate::search::Probe;
use crate::stability::Job;
use crate::trace::{Errors, Trace};

/// Kinetic energy grows if its peak in the last quarter of a run exceeds so many times that in the first, and in the last
/// quarter of the reference. It stays, which is no better where it should go, if it exceeds that of the reference by so much
/// and is still this share of what it was in the third: what grows until stops bound it does not explode, and does not rest.
const STAYS: f64 = 0.9;
/// See [`STAYS`].
pub(crate) const GROWN: f64 = 2.0;
/// What is less than this share of the reference's greatest kinetic energy is rest.
pub(crate) const REST: f64 = 1e-6;
/// Kinetic energy is looked at so often, or at each step where those are longer.
pub(crate) const LOOK: SimDuration = SimDuration::from_millis(2);
/// A run ends after so many steps: what is not stable shows by then.
pub(crate) const STEPS_MOST: u64 = 40_000;
/// Runs whose median is the cost of a step.
const REPETITIONS: usize = 3;

impl Job<'_> {
    /// A run over what is compared, and how far it is from the reference.
    pub(crate) fn against(
        &self,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<(Trace, Option<Errors>)> {
        let scene = self.stage.factory.scene().duration;
        let compared = self.plan.compared.unwrap_or(scene).min(self.plan.duration);
        let stage = Stage {
            grid: looks(step),
            end: SimTime::ZERO + compared.max(looks(step)),
            ..self.stage
        };
        let (trace, ending) = stage.record(variant, share, |_| false).ok()?;
        if matches!(ending, Ending::TooSlow(_)) {
            return None;
        }
        let errors = reference.and_then(|reference| trace.errors_between(&reference.trace));
        let errors = errors.filter(|_| ending == Ending::Whole);
        Some((trace, errors))
    }

    /// The end of a run with steps of `step`.
    fn end(&self, step: SimDuration) -> SimTime {
        self.stage.end.min(SimTime::ZERO + step * STEPS_MOST)
    }

    /// Whether a variant with steps of `step` stays bounded.
    pub(crate) fn probe(
        &self,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Probe {
        let end = self.end(step);
        let end_s = end.as_secs_f64();
        let known = reference.map(|reference| {
            let trace = &reference.trace;
            (trace.kinetic_bound(), trace.kinetic_by_quarter(end_s))
        });
        let (peak, [.., late]) = known.unwrap_or((f64::INFINITY, [0.0; 4]));
        let stage = Stage {
            grid: looks(step),
            end,
            ..self.stage
        };
        let recorded = stage.record(variant, share, |kinetic| kinetic > RUNAWAY * peak);
        let (trace, ending) = match recorded {
            Ok(recorded) => recorded,
            Err(why) => return Probe::Unknown(why),
        };
        match &ending {
            Ending::Whole => {}
            Ending::Enough(at) => {
                return Probe::Unstable(format!("kinetic energy runs away at {}", instant(*at)));
            }
            Ending::TooSlow(_) => {
                let why = ended(&ending, share).map(|(_, why)| why);
                return Probe::TooSlow(why.unwrap_or_default());
            }
            Ending::Fault(_) | Ending::NotFinite(_) => {
                let why = ended(&ending, share).map(|(_, why)| why);
                return Probe::Unstable(why.unwrap_or_default());
            }
        }
        let own = trace.kinetic_by_quarter(end_s);
        let [first, .., last] = own;
        let rest = if peak.is_finite() { REST * peak } else { 0.0 };
        if last > GROWN * first.max(late) + rest {
            return Probe::Unstable(format!(
                "kinetic energy grows: its peak is {first:.2e} J in the first quarter and {last:.2e} J in the last"
            ));
        }
        let should_go = known.is_some_and(|(_, quarters)| !stays(quarters));
        if should_go && stays(own) && last > GROWN * late + rest {
            return Probe::Unstable(format!(
                "kinetic energy stays: its peak in the last quarter is {last:.2e} J, and should have gone to {late:.2e} J"
            ));
        }
        Probe::Stable
    }

    /// Notes how far a stable step is from the reference.
    pub(crate) fn compare(
        &self,
        row: &mut Row,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<Errors> {
        let (trace, errors) = self.against(variant, step, reference, share)?;
        row.note_work(&trace.work, trace.reached_s());
        row.energy_residual_j = Some(trace.residual);
        row.drift_m = trace.drift;
        if let Some(errors) = &errors {
            row.note_errors(errors);
            row.wrong = errors.foot_rms > self.plan.wrong_m;
        } else {
            let why = "there is no reference";
            row.why = Some(match row.why.take() {
                Some(before) => format!("{before}; {why}"),
                None => why.to_owned(),
            });
        }
        errors
    }

    /// What a step costs.
    pub(crate) fn time(&self, row: &mut Row, variant: &Variant, step: SimDuration, share: Share) {
        let Some(mean) = row.mean_step_s.filter(|&mean| mean > 0.0) else {
            return;
        };
        let mut times = Vec::new();
        let mut simulated_s = 0.0;
        for _ in 0..REPETITIONS {
            let grid = looks(step);
            let whole = self.end(step).as_nanos() / grid.as_nanos();
            let plant_run = PlantRun {
                grid,
                end: SimTime::ZERO + grid * whole,
                ..self.stage.plant_run(share)
            };
            let timed = self
                .stage
                .with_plant(variant, |plant| plant_run.timed(plant));
            let Ok((Ending::Whole, took_s)) = timed else {
                break;
            };
            simulated_s = plant_run.end.as_secs_f64();
            times.push(took_s);
        }
        times.sort_by(f64::total_cmp);
        if let Some(&median) = times.get(times.len() / 2) {
            row.note_time(median, simulated_s, times.len() as u64);
            row.cost_per_step_s = Some(median / simulated_s * mean);
        }
    }
}

/// Whether kinetic energy, by its peaks in the quarters of a run, is not on its way to rest.
fn stays([_, _, third, last]: [f64; 4]) -> bool {
    last > STAYS * third
}

/// How often a run with steps of `step` is looked at: at whole steps.
fn looks(step: SimDuration) -> SimDuration {
    let nanos = step.as_nanos().max(1);
    SimDuration::from_nanos(nanos) * (LOOK.as_nanos() / nanos).max(1)
}
