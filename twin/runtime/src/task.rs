use std::fmt;
use std::ops::Range;

use thiserror::Error;
use twinrig_kernel::{Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError};

use crate::{DeviceError, PanicReport, PlantFault, WiringError};

/// One transfer with a device, over and over: the manager starts it when the process has ended and the
/// task is idle, and leaves it alone until it is done.
///
/// The methods come in this order: [`IoTask::connect`] and [`IoTask::open`] once, then for each transfer
/// [`IoTask::begin`], [`IoTask::wake`] at every instant the task asked for, and [`IoTask::to_process`] when it
/// is done. A task whose far end lives on by itself (boards tick, whether spoken to or not) is woken between
/// transfers, too.
pub trait IoTask: Send {
    /// Name, for messages and recordings. No two tasks of a rig share one.
    fn name(&self) -> &str;

    /// Output ports are data that it brings to the process (sensors), input ports data that it takes
    /// from the process (commands). The same at every call.
    fn ports(&self) -> Vec<Port>;

    /// Tells the task what the far end looks like: where in the flat vectors of [`PlantAccess`] its signals
    /// lie. A task that talks to hardware has no need of it.
    ///
    /// # Errors
    /// [`WiringError`] if the plant has not the signals that the task is to carry.
    fn connect(&mut self, plant: &PlantSignals) -> Result<(), WiringError> {
        let _ = plant;
        Ok(())
    }

    /// Gets the device ready, at time 0: the first control step waits until all tasks are. Most are at once.
    ///
    /// # Errors
    /// [`TaskError`] if the device cannot be used; the run ends.
    fn open(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        let _ = (now, plant);
        Ok(Progress::Done)
    }

    /// Begins a transfer. `from_process` holds the task's input ports, end to end, in order: the outputs
    /// of the process iteration that has just ended.
    ///
    /// # Errors
    /// [`TaskError`] if the device or the plant fails; the run ends.
    fn begin(
        &mut self,
        now: SimTime,
        from_process: &[f64],
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError>;

    /// Goes on with the transfer, or with opening, at the instant the task asked for; between transfers, with
    /// what happens at the far end meanwhile, which is [`Progress::Done`] again.
    ///
    /// # Errors
    /// [`TaskError`] if the device or the plant fails; the run ends.
    fn wake(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError>;

    /// When the task wants to be woken although it is at no transfer; asked whenever it is done.
    fn idle_wake(&self) -> Option<SimTime> {
        None
    }

    /// What can be seen of the task beside what it brings to the process: counters of its driver and of the
    /// boards at its far end. Output ports, the same at every call.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the gauges at `now`, end to end, in order. Looking changes nothing.
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let _ = (now, values);
    }

    /// Names of the lanes on which bytes pass, each in one direction: `sbcp/out`, `sbcp/in`.
    fn traces(&self) -> Vec<String> {
        Vec::new()
    }

    /// Hands over what has passed since the last call, in order, by number of the lane.
    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        let _ = passed;
    }

    /// What the last finished transfer brought: the task's output ports, end to end, in order. Read only
    /// while the task is idle; before the first transfer it is what the process is to see until then.
    fn to_process(&self) -> &[f64];

    /// Saves everything that later transfers depend on, the one under way included.
    fn save(&self) -> Snapshot;

    /// Goes back to a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is not of such a task.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}

/// How far a transfer has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// It goes on at that instant, which may be now but not earlier; the task is woken then.
    Again(SimTime),
    /// It is done, and its data are valid.
    Done,
}

/// The far end of the wires: the plant, advanced to exactly now before any call answers.
///
/// What is sampled is the state at this instant; what is actuated is held from this instant on. So the
/// order in which tasks sample and actuate at one instant makes no difference.
pub trait PlantAccess {
    /// The plant's outputs at now, as laid out in [`PlantSignals::outputs`]: those in `signals`.
    ///
    /// # Errors
    /// [`PlantFault`] if the plant fails on the way to now.
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault>;

    /// The plant's inputs, as laid out in [`PlantSignals::inputs`]: those in `signals`, to be written.
    ///
    /// # Errors
    /// [`PlantFault`] if the plant fails on the way to now.
    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault>;
}

/// The signals of the far end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PlantSignals {
    /// What can be actuated.
    pub inputs: Layout,
    /// What can be sampled.
    pub outputs: Layout,
}

/// A transfer that ended the run.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TaskError {
    /// The plant failed while it was advanced to the instant of the transfer.
    #[error(transparent)]
    Plant(#[from] PlantFault),
    /// The device failed: it does not answer, its port is gone.
    #[error("{why}")]
    Device {
        /// How.
        why: String,
    },
    /// The real port failed.
    #[error(transparent)]
    Port(#[from] DeviceError),
    /// It took longer than it may, in real time.
    #[error(
        "{place}: {what} took more than {limit}; is the device switched on, and its cable plugged in?"
    )]
    TimeLimit {
        /// What took so long.
        what: Phase,
        /// Where the device is.
        place: String,
        /// How long it may take.
        limit: SimDuration,
    },
    /// The driver panicked in real time: a bug in it.
    #[error(transparent)]
    Panic(#[from] PanicReport),
    /// The driver's thread did not come back in its time: a bug in the driver, or a system that did not let it run or hung in
    /// the device.
    #[error("{place}: {what} did not end, and neither did its driver's thread as it should: {why}")]
    Lost {
        /// What it was at.
        what: Phase,
        /// Where the device is.
        place: String,
        /// What is known of it.
        why: String,
    },
}

/// What a driver is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// It gets the devices ready.
    Opening,
    /// It exchanges data with them.
    Transfer,
    /// It leaves them in a safe state.
    Closing,
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Opening => "opening",
            Self::Transfer => "the transfer",
            Self::Closing => "closing",
        })
    }
}
