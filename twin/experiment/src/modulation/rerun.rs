//! Re-runs of a case with a change of the variable, prepared from its reference run.

use twinrig_kernel::{SimDuration, SimTime};

use super::cycles::{Reference, Shift};
use super::table::{Counting, Displacement};
use super::{ModulationCase, ModulationPlan};
use crate::error::StudyError;
use crate::gait::run::GaitRun;
use crate::parallel::RunResult;

/// Duration of a reference run after the limit cycle is reached: ten footsteps of a slow walk.
pub(super) const REFERENCE: SimDuration = SimDuration::from_secs(20);
/// Periods of a re-run beyond its last footstep, for that footstep to end.
const MARGIN: f64 = 1.5;

/// Place of a re-run among all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rerun {
    pub(super) case: usize,
    pub(super) change: usize,
    pub(super) point: usize,
}

impl Rerun {
    pub(super) fn of(index: usize, plan: &ModulationPlan) -> Self {
        let per_case = plan.points * plan.changes.len();
        let (case, rest) = (index / per_case, index % per_case);
        Self {
            case,
            change: rest / plan.points,
            point: rest % plan.points,
        }
    }
}

/// Reference run of a case, and its re-runs as they follow from it.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    pub(super) reference: Reference,
    pub(super) points: Vec<SimTime>,
    pub(super) end: SimTime,
}

impl Prepared {
    pub(super) fn new(
        case: &ModulationCase,
        run: GaitRun,
        plan: &ModulationPlan,
    ) -> RunResult<Self> {
        if let Some(at_s) = run.fell_at_s {
            let end_s = (case.after + REFERENCE).as_secs_f64();
            return Err(StudyError::ReferenceFell { at_s, end_s }.to_string());
        }
        let after_s = case.after.as_secs_f64();
        // One for the cycle of the points, one for the heading of the last footstep.
        let reference = Reference::new(run, after_s, plan.steps + 2);
        let reference = reference.map_err(|error| error.to_string())?;
        let points_s = reference.points_s(after_s, plan.points);
        let longest_s = reference.periods_s.iter().copied().fold(0.0, f64::max);
        let last_s = points_s.last().copied().unwrap_or(after_s);
        let end_s = last_s + (plan.steps as f64 + MARGIN) * longest_s;
        Ok(Self {
            points: points_s.into_iter().map(instant).collect(),
            end: instant(end_s),
            reference,
        })
    }

    /// Returns the displacements of a re-run.
    pub(super) fn displacements(
        &self,
        run: &GaitRun,
        rerun: Rerun,
        plan: &ModulationPlan,
    ) -> Vec<Displacement> {
        let at_s = self.points[rerun.point].as_secs_f64();
        Counting::ALL
            .into_iter()
            .flat_map(|counting| {
                let shifts = match counting {
                    Counting::Cycle => self.reference.by_cycle(run, at_s, plan.steps),
                    Counting::TouchDown => self.reference.by_touch_down(run, at_s, plan.steps),
                };
                shifts.into_iter().map(move |shift| (counting, shift))
            })
            .map(|(counting, Shift { leg, step, along_m })| Displacement {
                counting,
                by: plan.changes[rerun.change],
                point: rerun.point,
                leg,
                step,
                along_m,
            })
            .collect()
    }
}

fn instant(seconds: f64) -> SimTime {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a time within a run; a cast saturates"
    )]
    let nanos = (1e9 * seconds) as u64;
    SimTime::from_nanos(nanos)
}
