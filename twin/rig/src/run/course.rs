//! Course of a run: from a wired rig to the time that it reaches.

use std::io::Write;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{
    BusSummary, EnergyBalance, LimitViolation, Rig, RigError, WorkCounts, catch_panic,
};

use crate::assembly::Assembly;
use crate::error::Error;
use crate::run::interrupt;
use crate::run::observers::{RunObservers, RunProgress};

/// Maximum simulated time between checks for interrupts, failed recordings and progress updates.
const SLICE: SimDuration = SimDuration::from_millis(100);
/// Maximum number of the shortest periods between these checks.
const SLICE_PERIODS: u64 = 4096;

/// Result of a run apart from its observations.
pub struct Course {
    /// Simulated time at the end of the run.
    pub reached: SimTime,
    /// Wall time of the run \[s\].
    pub wall_s: f64,
    /// Error that ended the run prematurely.
    pub error: Option<String>,
    /// Whether a plant was simulated.
    pub simulated: bool,
    /// Energy balance and work counts of the plant, if it is in a valid state.
    pub plant: Option<(EnergyBalance, WorkCounts)>,
    /// Traffic of the buses whose drivers are in a valid state.
    pub buses: Vec<BusSummary>,
    /// Limits that the plant and the commands have exceeded, if they are in a valid state.
    pub limits: Vec<LimitViolation>,
}

impl Course {
    /// Returns the result of a rig in virtual time after its run.
    pub fn of(rig: &Rig, wall_s: f64, ran: Result<SimTime, Stopped>) -> Self {
        let (reached, stopped) = match ran {
            Ok(reached) => (reached, None),
            Err(stopped) => (rig.now(), Some(stopped)),
        };
        // After a panic the state of the parts is invalid.
        let is_valid = !matches!(stopped, Some(Stopped::Panic(_)));
        Self {
            reached,
            wall_s,
            error: stopped.map(|stopped| stopped.to_string()),
            simulated: true,
            plant: is_valid.then(|| (rig.plant().energy(), rig.plant().work())),
            buses: if is_valid { rig.buses() } else { Vec::new() },
            limits: if is_valid {
                let mut limits = rig.plant().limit_violations();
                limits.extend(rig.process().limit_violations());
                limits
            } else {
                Vec::new()
            },
        }
    }
}

/// Reason for the premature end of a run.
#[derive(Debug, thiserror::Error)]
pub enum Stopped {
    /// Interrupt by the user.
    #[error("{}", interrupt::message(*.0))]
    Interrupted(SimTime),
    /// Failure of a part.
    #[error(transparent)]
    Failed(Error),
    /// Panic of a part.
    #[error(transparent)]
    Panic(Error),
    /// End of the scenario before the start of control.
    #[error(
        "at {0} the devices were still being initialised, and control had not started\n  = help: increase `duration`"
    )]
    NotOpen(SimTime),
}

/// Returns the first multiple of `period` after `now`; none on overflow.
fn next_multiple(now: SimTime, period: SimDuration) -> Option<SimTime> {
    let count = now.as_nanos() / period.as_nanos().max(1);
    let next = period.checked_mul(count.checked_add(1)?)?;
    SimTime::ZERO.checked_add(next)
}

/// Runs to `end`, to a fall that ends the run, to a regular end by the plant, or to a failure of
/// the recording; returns the time reached. The observers receive the `progress`.
///
/// # Errors
/// The reason of a premature end.
pub fn run<W: Write>(
    assembly: &Assembly<'_>,
    rig: &mut Rig,
    observers: &mut RunObservers<'_, W>,
    progress: &RunProgress<'_>,
    end: SimTime,
) -> Result<SimTime, Stopped> {
    let ran = catch_panic(|| run_in_slices(assembly, rig, observers, progress, end));
    ran.unwrap_or_else(|source| {
        let file = assembly.scenario().file.clone();
        Err(Stopped::Panic(Error::Panic { file, source }))
    })
}

/// Returns the simulated time between checks for interrupts and progress updates.
fn slice(assembly: &Assembly<'_>) -> SimDuration {
    let observe = assembly.scenario().observe.period;
    let shortest = assembly.period().min(observe).as_nanos();
    let nanos = shortest.max(1).saturating_mul(SLICE_PERIODS);
    SLICE.min(SimDuration::from_nanos(nanos))
}

fn run_in_slices<W: Write>(
    assembly: &Assembly<'_>,
    rig: &mut Rig,
    observers: &mut RunObservers<'_, W>,
    progress: &RunProgress<'_>,
    end: SimTime,
) -> Result<SimTime, Stopped> {
    let slice = slice(assembly);
    let mut now = rig.now();
    let scenario = assembly.scenario();
    // A fall ends the run at the observation that detects it.
    let observation = scenario
        .ends_with_a_fall()
        .then_some(scenario.observe.period);
    while now < end {
        if observers.ended_at().is_some() {
            return Ok(now);
        }
        let next = now.checked_add(slice).map_or(end, |next| next.min(end));
        let observed = observation.and_then(|period| next_multiple(now, period));
        now = observed.map_or(next, |observed| observed.min(next));
        observers.poll(&RunProgress {
            now: rig.now(),
            ..*progress
        });
        let ran = rig.run_until(now, observers);
        if interrupt::is_requested() {
            // Takes precedence over other errors.
            return Err(Stopped::Interrupted(rig.now()));
        }
        if let Err(RigError::Plant(fault)) = &ran
            && rig.plant().has_ended()
        {
            observers.end_at(fault.time);
            return Ok(fault.time);
        }
        ran.map_err(|error| Stopped::Failed(assembly.rig_error(error)))?;
        if observers.is_broken() {
            // Closing the recording returns the error.
            return Ok(now);
        }
    }
    if !rig.is_open() {
        return Err(Stopped::NotOpen(end));
    }
    Ok(end)
}
