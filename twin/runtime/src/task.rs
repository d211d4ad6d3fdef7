use std::fmt;
use std::ops::Range;

use thiserror::Error;
use twinrig_kernel::{Port, SimDuration, SimTime};

use crate::{BusHealth, DeviceError, PanicReport, Part, PlantFault};

/// A recurring transfer with a device: the manager starts it when the process has ended and the
/// task is idle, and does not interfere until it is done.
///
/// Order of the calls: [`Part::connect`] and [`IoTask::open`] once, then for each transfer
/// [`IoTask::begin`], [`IoTask::wake`] at every instant requested by the task, and
/// [`IoTask::to_process`] when it is done. A task whose devices have their own timing (boards tick
/// also without requests) is woken between transfers, too.
pub trait IoTask: Part {
    /// Returns the name, unique within a rig, used in messages and recordings.
    fn name(&self) -> &str;

    /// Returns the ports: outputs are data provided to the process (sensors), inputs are data read
    /// from it (commands). Constant over the life of the task.
    fn ports(&self) -> Vec<Port>;

    /// Opens the device, at time 0: the first control step waits until all tasks are open. Most
    /// tasks open without delay.
    ///
    /// # Errors
    /// [`TaskError`] if the device cannot be used; the run ends.
    fn open(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        let _ = (now, plant);
        Ok(Progress::Done)
    }

    /// Begins a transfer. `from_process` contains the task's input ports, concatenated in order:
    /// outputs of the process iteration that has just ended.
    ///
    /// # Errors
    /// [`TaskError`] if the device or the plant fails; the run ends.
    fn begin(
        &mut self,
        now: SimTime,
        from_process: &[f64],
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError>;

    /// Continues the transfer, or opening, at the requested instant; between transfers, handles the
    /// devices' own events, which again returns [`Progress::Done`].
    ///
    /// # Errors
    /// [`TaskError`] if the device or the plant fails; the run ends.
    fn wake(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError>;

    /// Returns the wake-up time of an idle task, if any; called whenever the task is done.
    fn idle_wake(&self) -> Option<SimTime> {
        None
    }

    /// Returns the results of the last finished transfer: the task's output ports, concatenated in
    /// order. Read only while the task is idle; before the first transfer, these are the initial
    /// inputs of the process.
    fn to_process(&self) -> &[f64];

    /// Returns the nominal duration of a transfer that the device paces itself, such as the period
    /// of its frames; none where a transfer is to end within a control step.
    fn period(&self) -> Option<SimDuration> {
        None
    }

    /// Returns the traffic up to `now`; none where the task has no bus.
    fn bus_health(&self, now: SimTime) -> Option<BusHealth> {
        let _ = now;
        None
    }
}

/// Progress of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// In progress; the task is woken at that instant, which may be now but not earlier.
    WakeAt(SimTime),
    /// Finished, with valid data.
    Done,
}

/// Access to the plant, advanced to exactly the present time before each call returns.
///
/// Samples are of the state at this instant; commands apply from this instant on. The order in
/// which tasks sample and actuate at one instant therefore has no effect.
pub trait PlantAccess {
    /// Returns the outputs `signals` at the present time, in the layout of
    /// [`PlantSignals::outputs`](crate::PlantSignals::outputs).
    ///
    /// # Errors
    /// [`PlantFault`] if the plant fails while advancing to the present time.
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault>;

    /// Returns the inputs `signals`, to be written, in the layout of
    /// [`PlantSignals::inputs`](crate::PlantSignals::inputs).
    ///
    /// # Errors
    /// [`PlantFault`] if the plant fails while advancing to the present time.
    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault>;

    /// Moves the present time to `to` if nothing else happens until then, this instant included;
    /// returns whether it did. A part that has several events before those of all others handles
    /// them in one call. By default the time stands still during a call.
    fn run_ahead(&mut self, to: SimTime) -> bool {
        let _ = to;
        false
    }
}

/// Failure of a transfer, which ends the run.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TaskError {
    /// The plant failed while it was advanced to the instant of the transfer.
    #[error(transparent)]
    Plant(#[from] PlantFault),
    /// The device failed: no answer, port lost.
    #[error("{why}")]
    Device {
        /// The reason.
        why: String,
    },
    /// The real port failed.
    #[error(transparent)]
    Port(#[from] DeviceError),
    /// A phase exceeded its limit, in real time.
    #[error(
        "{place}: {what} took more than {limit}; is the device switched on, and its cable plugged in?"
    )]
    TimeLimit {
        /// The phase.
        what: Phase,
        /// Location of the device.
        place: String,
        /// The limit.
        limit: SimDuration,
    },
    /// The driver panicked in real time: a bug in it.
    #[error(transparent)]
    Panic(#[from] PanicReport),
    /// The driver's thread did not end in time: a bug in the driver, a thread that was not
    /// scheduled, or a blocked device.
    #[error("{place}: {what} did not end, and the driver's thread did not return: {why}")]
    Lost {
        /// The phase.
        what: Phase,
        /// Location of the device.
        place: String,
        /// State of the thread.
        why: String,
    },
}

/// Phase of a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Preparation of the devices.
    Opening,
    /// Exchange of data with the devices.
    Transfer,
    /// Transition of the devices into a safe state.
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
