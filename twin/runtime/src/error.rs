use thiserror::Error;
use twinrig_kernel::{LivelockError, SimTime, SnapshotError};

use crate::{
    PanicReport, PlantFault, SensorModelError, TaskError, TimingError, VariableError, WiringError,
};

/// Failure to build a rig or to continue a run.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RigError {
    /// Signals do not connect.
    #[error(transparent)]
    Wiring(#[from] WiringError),
    /// This system has no real time.
    #[error("real time needs Linux: run in virtual time here, or in real time there")]
    NeedsLinux,
    /// The compute time is invalid.
    #[error("compute time: {0}")]
    Compute(TimingError),
    /// A period of the schedule is zero or overflows.
    #[error("the {what} period is zero or past 584 years")]
    BadPeriod {
        /// The period: `control`, `observation`.
        what: &'static str,
    },
    /// A sensor cannot be added.
    #[error("the sensor `{name}` of `{signal}`: {source}")]
    Sensor {
        /// The sensor.
        name: String,
        /// The signal.
        signal: String,
        /// The cause.
        source: SensorModelError,
    },
    /// The plant failed.
    #[error(transparent)]
    Plant(#[from] PlantFault),
    /// A transfer failed.
    #[error("{task} failed at {time}: {source}")]
    Task {
        /// The task.
        task: String,
        /// The time.
        time: SimTime,
        /// The cause.
        source: TaskError,
    },
    /// A task requested a wake-up before now.
    #[error("{task} requested a wake-up at {wanted}, which is before the present time {time}")]
    WakeInThePast {
        /// The task.
        task: String,
        /// Now.
        time: SimTime,
        /// The requested time.
        wanted: SimTime,
    },
    /// An iteration of the process failed ([`crate::Process::fault`]).
    #[error("{process} failed at {time}: {why}")]
    Process {
        /// The process.
        process: String,
        /// The cause.
        why: String,
        /// Beginning of the iteration.
        time: SimTime,
    },
    /// The process wrote an infinity or NaN.
    #[error("{process} wrote {value} to `{signal}` at {time}")]
    NotFinite {
        /// The process.
        process: String,
        /// The signal.
        signal: String,
        /// The value.
        value: f64,
        /// Beginning of the iteration.
        time: SimTime,
    },
    /// There is no such process variable.
    #[error("{process} has no variable `{name}`{}", did_you_mean(near))]
    NoSuchVariable {
        /// The process.
        process: String,
        /// The requested name.
        name: String,
        /// Similar names.
        near: Vec<String>,
    },
    /// There is no such output of the process.
    #[error("{process} has no output `{name}`{}", did_you_mean(near))]
    NoSuchOutput {
        /// The process.
        process: String,
        /// The requested name.
        name: String,
        /// Similar names.
        near: Vec<String>,
    },
    /// An output of the process cannot be replaced by these values.
    #[error("`{signal}` cannot be replaced by {values:?}: it has {size} finite values")]
    BadOverride {
        /// The signal.
        signal: String,
        /// Its number of values.
        size: usize,
        /// The refused values.
        values: Vec<f64>,
    },
    /// An output of the process cannot be replaced by values of this magnitude.
    #[error(
        "`{signal}` = {value} {unit} is not in [-{most}, {most}] {unit}: give a value within it"
    )]
    OverrideOutOfRange {
        /// The signal.
        signal: String,
        /// Its unit.
        unit: &'static str,
        /// The refused value.
        value: f64,
        /// The greatest magnitude.
        most: f64,
    },
    /// A run past the end of the scenario.
    #[error("the scenario ends at {end}, before {to}: give a longer `duration`")]
    PastEnd {
        /// The requested time.
        to: SimTime,
        /// The end ([`crate::Rig::set_end`]).
        end: SimTime,
    },
    /// A process variable was not set.
    #[error("change at {at}: {source}")]
    Change {
        /// The scheduled time.
        at: SimTime,
        /// The cause.
        source: VariableError,
    },
    /// A change was scheduled for an instant that is past.
    #[error("a change cannot be scheduled for {at}, it is {now} already")]
    ChangeInThePast {
        /// The requested time.
        at: SimTime,
        /// Now.
        now: SimTime,
    },
    /// The program was requested to end ([`crate::interrupt`]). All events up to that time have
    /// been handled.
    #[error("interrupted at {time}")]
    Interrupted {
        /// The time.
        time: SimTime,
    },
    /// Too many events at one instant.
    #[error(transparent)]
    Livelock(#[from] LivelockError),
    /// The plant cannot be replaced by one with other ports.
    #[error(
        "{other} cannot replace {present}: {present} has {has}, {other} has {instead} in its place; record and expect the same signals of both"
    )]
    PortMismatch {
        /// The present plant.
        present: String,
        /// The replacement.
        other: String,
        /// First port that differs, of the present plant.
        has: String,
        /// The same of the replacement.
        instead: String,
    },
    /// The plant has no state in names shared with other plants.
    #[error("{plant} has no plant-independent state, so no other plant can resume from it")]
    NoSharedState {
        /// The plant.
        plant: String,
    },
    /// A part panicked in real time. In virtual time the caller of the rig catches panics
    /// ([`crate::catch_panic`]).
    #[error(transparent)]
    Panic(#[from] PanicReport),
    /// The system refused to create a thread.
    #[error("cannot start a thread for {what}: {why}")]
    Thread {
        /// Purpose of the thread.
        what: String,
        /// The system's error.
        why: String,
    },
    /// A snapshot does not match.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
}

fn did_you_mean(near: &[String]) -> String {
    if near.is_empty() {
        String::new()
    } else {
        format!("; did you mean `{}`?", near.join("` or `"))
    }
}
