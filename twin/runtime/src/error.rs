use thiserror::Error;
use twinrig_kernel::{LivelockError, SimTime, SnapshotError};

use crate::{PanicReport, PlantFault, TaskError, TimingError, VariableError, WiringError};

/// Why a rig cannot be built, or cannot go on.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RigError {
    /// Its signals do not connect.
    #[error(transparent)]
    Wiring(#[from] WiringError),
    /// A modelled time cannot be.
    #[error("compute time: {0}")]
    Compute(TimingError),
    /// The schedule has a period of no time, or of too much.
    #[error("the {what} period is zero or past 584 years")]
    BadPeriod {
        /// Which period.
        what: &'static str,
    },
    /// The plant stopped.
    #[error(transparent)]
    Plant(#[from] PlantFault),
    /// A transfer failed.
    #[error("{task} failed at {time}: {source}")]
    Task {
        /// The task.
        task: String,
        /// When.
        time: SimTime,
        /// How.
        source: TaskError,
    },
    /// A task asked to be woken before now.
    #[error("{task} asked at {time} to be woken at {wanted}, which is past")]
    WakeInThePast {
        /// The task.
        task: String,
        /// Now.
        time: SimTime,
        /// When it wanted to be woken.
        wanted: SimTime,
    },
    /// The process wrote an infinity or something that is no number.
    #[error("{process} wrote {value} to `{signal}` at {time}")]
    NotFinite {
        /// The process.
        process: String,
        /// The signal it wrote.
        signal: String,
        /// What it wrote.
        value: f64,
        /// When the iteration began.
        time: SimTime,
    },
    /// There is no such process variable.
    #[error("{process} has no variable `{name}`{}", did_you_mean(near))]
    NoSuchVariable {
        /// The process.
        process: String,
        /// The name asked for.
        name: String,
        /// What may have been meant.
        near: Vec<String>,
    },
    /// A process variable was not set.
    #[error("change at {at}: {source}")]
    Change {
        /// When it was to be set.
        at: SimTime,
        /// Why it was not.
        source: VariableError,
    },
    /// A change was scheduled for an instant that is past.
    #[error("a change cannot be scheduled for {at}, it is {now} already")]
    ChangeInThePast {
        /// When it was to be made.
        at: SimTime,
        /// Now.
        now: SimTime,
    },
    /// The program is to end ([`crate::interrupt`]). All that was to happen up to then has happened.
    #[error("interrupted at {time}")]
    Interrupted {
        /// When.
        time: SimTime,
    },
    /// Time stood still.
    #[error(transparent)]
    Livelock(#[from] LivelockError),
    /// A plant shall take the place of another that has other ports.
    #[error(
        "{other} cannot take the place of {present}: where that has {has}, it has {instead}; record and expect the same of both"
    )]
    OtherPorts {
        /// The plant that is there.
        present: String,
        /// The one that was to be put there.
        other: String,
        /// The first port in which they differ, of the one that is there.
        has: String,
        /// And of the other.
        instead: String,
    },
    /// A plant cannot say where it is in words that others understand.
    #[error("{plant} has no words for where it is, so no other plant can go on from there")]
    NamelessState {
        /// The plant.
        plant: String,
    },
    /// A part panicked in real time. In virtual time the caller of the rig catches it ([`crate::caught`]).
    #[error(transparent)]
    Panic(#[from] PanicReport),
    /// The system gives no thread.
    #[error("cannot start a thread for {what}: {why}")]
    Thread {
        /// What it was for.
        what: String,
        /// Why not.
        why: String,
    },
    /// A saved state does not fit.
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
