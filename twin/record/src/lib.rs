//! Recordings of runs. A run is written to an MCAP file that viewers and the `mcap` packages of
//! other languages read, with every number bit for bit; the same run always yields the same bytes.
//! An interrupted run leaves a file that is readable up to its last flush. A [`Fingerprint`] is a
//! hash of all samples, bytes and events of a run in order; [`first_divergence`] finds the first
//! difference of two recordings, and [`compare_events`] quantifies, aligned by footsteps, the
//! difference of runs that are not expected to be identical.
//!
//! ```
//! use twinrig_kernel::{Direction, Layout, Port, SimTime, Unit};
//! use twinrig_record::*;
//! use twinrig_runtime::{Group, Observer};
//!
//! let ports = [Port::output("body/position", Unit::Meter, 3)];
//! let layout = Layout::of(&ports, Direction::Output);
//! let group = RecordedGroup { group: Group::Plant, layout: &layout, keep: &|_| true };
//! let info = RunInfo { seed: 1, ..RunInfo::default() };
//! let (skeleton, cadence) = (Skeleton::default(), Cadence::default());
//! let mut recorder = Recorder::new(Vec::new(), &info, &[group], &skeleton, cadence)?;
//! let mut fingerprint = Fingerprint::new();
//! for step in 0..10 {
//!     let now = SimTime::from_nanos(2_000_000 * step);
//!     let values = [0.1 * step as f64, 0.0, 0.14];
//!     recorder.samples(now, Group::Plant, &values); // as a rig does
//!     fingerprint.samples(now, Group::Plant, &values);
//! }
//! let file = recorder.finish(fingerprint.digest(), SimTime::from_nanos(18_000_000))?;
//!
//! let recording = Recording::from_bytes(file)?;
//! assert_eq!(recording.seed(), Some(1));
//! let series = recording.series("body/position")?;
//! assert_eq!(series.values[3..6], [0.1, 0.0, 0.14]);
//! # Ok::<(), RecordError>(())
//! ```
//!
//! Contents of a file
//!
//! Each channel has CDR messages and a complete `ros2msg` schema (profile `ros2`).
//!
//! * one channel per group of signals, with one `float64` field per signal; the names and units of
//!   the signals are in the metadata of the channel under `signals`, the name of the group under
//!   `group`,
//! * one channel per [`Topic`], with a standard message type where one exists: [`Message`]s, and
//!   coordinate frames, odometry and joint states of the plant,
//! * one channel per wire whose bytes are recorded, with its name under `lane`,
//! * the input files of the run as attachments,
//! * metadata `run` (seed, build, notes) and, if the run completed, `result` (fingerprint,
//!   simulated time).
//!
//! Log times are simulated times plus [`EPOCH`]. Recordings of builds before 0.1.0, with JSON
//! messages and unencoded bytes, are also read.
//!
//! Logs of other programs
//!
//! [`import_log`] reads JSON, CSV, MCAP and bags of rosbag2 by a [`LogMapping`] of their columns, and
//! [`ImportedLog::write`] makes a recording of them:
//!
//! ```
//! use twinrig_document::Document;
//! use twinrig_record::{LogLimits, LogMapping, Recording, import_log_from};
//!
//! let mapping = "
//!     time = { column = 't', unit = 'ms' }
//!     signal = [{ name = 'servo/position', column = 'angle', unit = 'deg' }]";
//! let mapping = LogMapping::read(&Document::parse("mapping.toml", mapping)?)?;
//! let log = "t,angle\n0,0\n5.5,180\n".as_bytes();
//! let log = import_log_from("log.csv", log, &mapping, LogLimits::default())?;
//! let recording = Recording::from_bytes(log.write(Vec::new(), "example")?)?;
//! let series = recording.series("servo/position")?;
//! assert_eq!(series.values, [0.0, std::f64::consts::PI]);
//! assert_eq!(series.times[1].as_nanos(), 5_500_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Out of scope
//!
//! Compression (simulated data hardly compress, and it costs more than the rest of recording),
//! reading of compressed files, the selection of recorded signals, the detection of footsteps
//! (those detected during the run are read), and re-running.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_record;

mod aligned;
mod cdr;
mod channels;
mod divergence;
mod encoder;
mod error;
mod fingerprint;
mod framing;
mod hash_tree;
mod import;
mod index;
mod mcap_writer;
mod messages;
mod observe;
mod poses;
mod recorder;
mod recording;
mod ros;
mod run_info;
mod schema;
mod sink;
#[cfg(test)]
mod tests;
mod topic;

pub use aligned::{
    Drift, Ends, EventComparison, LegFootsteps, PARTS, Pairing, Pairings, PartingPoint,
    RecordedFootstep, SHARES, SignalDrift, compare_events, median, pair_footsteps,
};
pub use channels::{RecordedGroup, group_name};
pub use divergence::{Comparison, Divergence, divergence_within, first_divergence};
pub use encoder::Encoder;
pub use error::RecordError;
pub use fingerprint::{Digest, Fingerprint};
pub use import::{
    Conversion, ImportedGroup, ImportedLog, ImportedSignal, LogColumn, LogError, LogFault,
    LogFormat, LogGap, LogGroup, LogLimits, LogMapping, LogNote, LogOrigin, LogPeriods, LogPlace,
    LogSetting, LogSignal, MissingValues, NoteText, Ratio, SETTING_PREFIX, Word, import_log,
    import_log_from,
};
pub use index::SampledGroup;
pub use messages::{
    ChangeMessage, EventMessage, ExpectationMessage, FootstepMessage, Message, VerdictMessage,
};
pub use poses::{FrameSampler, FrameSeries, LegLinks, Skeleton, SkeletonAbduction, SkeletonLeg};
pub use recorder::{Cadence, Recorder};
pub use recording::{Recording, Sample, Series};
pub use run_info::RunInfo;
pub use schema::{EPOCH, Signal};
pub use sink::{ChannelId, Sink};
pub use topic::Topic;
