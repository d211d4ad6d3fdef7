//! Runs at one step size: stability, error against the reference, run time.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_report::number::instant;
use twinrig_rig::Variant;

use crate::budget::Share;
use crate::plants::plant_run::{Ending, PlantRun};
use crate::plants::precision::RUNAWAY;
use crate::plants::reference::{Reference, RunContext, ended};
use crate::plants::row::Row;
use crate::plants::search::Probe;
use crate::plants::stability_job::Runs;
use crate::plants::trace::{Errors, Trace};

/// Thresholds of the kinetic energy, from its peaks in the quarters of a run. It grows if the peak
/// in the last quarter exceeds [`GROWTH`] times both that in the first quarter and that in the
/// reference's last. It does not decay, although the reference's does, if it exceeds the
/// reference's last peak by the same factor and is still this share of the peak in the third
/// quarter: an instability that joint stops bound neither diverges nor comes to rest.
const NO_DECAY: f64 = 0.9;
/// See [`NO_DECAY`].
pub(crate) const GROWTH: f64 = 2.0;
/// Rest: kinetic energy below this share of the reference's greatest.
pub(crate) const REST: f64 = 1e-6;
/// Sampling period of the kinetic energy; longer steps are sampled once each.
pub(crate) const SAMPLE_PERIOD: SimDuration = SimDuration::from_millis(2);
/// Greatest number of steps of a run: an instability shows by then.
pub(crate) const STEPS_MOST: u64 = 40_000;
/// Number of runs whose median gives the cost per step.
const REPETITIONS: usize = 3;

impl Runs<'_> {
    /// Runs a variant over the compared time and returns its trace and error against the reference.
    pub(crate) fn against(
        &self,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<(Trace, Option<Errors>)> {
        let scenario = self.context.factory.input().duration;
        let compared = self
            .plan
            .compared
            .unwrap_or(scenario)
            .min(self.plan.duration);
        let context = RunContext {
            grid: sampling_period(step),
            end: SimTime::ZERO + compared.max(sampling_period(step)),
            ..self.context
        };
        let (trace, ending) = context.record(variant, share, |_| false).ok()?;
        if matches!(ending, Ending::OverBudget(_)) {
            return None;
        }
        let errors = reference.and_then(|reference| trace.errors_between(&reference.trace));
        let errors = errors.filter(|_| ending == Ending::Completed);
        Some((trace, errors))
    }

    /// Returns the end time of a run with steps of `step`.
    fn end(&self, step: SimDuration) -> SimTime {
        self.context.end.min(SimTime::ZERO + step * STEPS_MOST)
    }

    /// Determines whether a variant with steps of `step` stays bounded.
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
        let context = RunContext {
            grid: sampling_period(step),
            end,
            ..self.context
        };
        let recorded = context.record(variant, share, |kinetic| kinetic > RUNAWAY * peak);
        let (trace, ending) = match recorded {
            Ok(recorded) => recorded,
            Err(why) => return Probe::Unknown(why),
        };
        match &ending {
            Ending::Completed => {}
            Ending::Stopped(at) => {
                return Probe::Unstable(format!("kinetic energy runs away at {}", instant(*at)));
            }
            Ending::OverBudget(_) => {
                let why = ended(&ending, share).map(|(_, why)| why);
                return Probe::OverBudget(why.unwrap_or_default());
            }
            Ending::Fault(fault) if variant.setting.tolerance().is_some() => {
                return Probe::Refused(fault.to_string());
            }
            Ending::Fault(_) | Ending::NotFinite(_) => {
                let why = ended(&ending, share).map(|(_, why)| why);
                return Probe::Unstable(why.unwrap_or_default());
            }
        }
        let own = trace.kinetic_by_quarter(end_s);
        let [first, .., last] = own;
        let rest = if peak.is_finite() { REST * peak } else { 0.0 };
        // A commanded robot starts from rest: without a reference, growth is no sign.
        let judged = known.is_some() || !self.context.commands.change();
        if judged && last > GROWTH * first.max(late) + rest {
            return Probe::Unstable(format!(
                "kinetic energy grows: its peak is {first:.2e} J in the first quarter and {last:.2e} J in the last"
            ));
        }
        let decays_in_reference = known.is_some_and(|(_, quarters)| !does_not_decay(quarters));
        if decays_in_reference && does_not_decay(own) && last > GROWTH * late + rest {
            return Probe::Unstable(format!(
                "kinetic energy stays: its peak in the last quarter is {last:.2e} J, and should have gone to {late:.2e} J"
            ));
        }
        Probe::Stable
    }

    /// Records the error of a stable step against the reference.
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
        row.drift_m = trace.violation;
        row.least_substep_s = trace.least_substep_s;
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

    /// Measures the cost per step.
    pub(crate) fn time(&self, row: &mut Row, variant: &Variant, step: SimDuration, share: Share) {
        let Some(mean) = row.mean_step_s.filter(|&mean| mean > 0.0) else {
            return;
        };
        let mut times = Vec::new();
        let mut simulated_s = 0.0;
        for _ in 0..REPETITIONS {
            let grid = sampling_period(step);
            let intervals = self.end(step).as_nanos() / grid.as_nanos();
            let plant_run = PlantRun {
                grid,
                end: SimTime::ZERO + grid * intervals,
                ..self.context.plant_run(share)
            };
            let timed = self
                .context
                .with_plant(variant, |plant| plant_run.timed(plant));
            let Ok((Ending::Completed, run_s)) = timed else {
                break;
            };
            simulated_s = plant_run.end.as_secs_f64();
            times.push(run_s);
        }
        times.sort_by(f64::total_cmp);
        if let Some(&median) = times.get(times.len() / 2) {
            row.note_time(median, simulated_s, times.len() as u64);
            row.cost_per_step_s = Some(median / simulated_s * mean);
        }
    }
}

/// Returns whether kinetic energy, by its peaks in the quarters of a run, does not decay.
fn does_not_decay([_, _, third, last]: [f64; 4]) -> bool {
    last > NO_DECAY * third
}

/// Returns the sampling period of a run with steps of `step`: a multiple of the step.
fn sampling_period(step: SimDuration) -> SimDuration {
    let nanos = step.as_nanos().max(1);
    SimDuration::from_nanos(nanos) * (SAMPLE_PERIOD.as_nanos() / nanos).max(1)
}
