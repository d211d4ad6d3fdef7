//! Recordings of runs. A run becomes an MCAP file that viewers and the `mcap` packages of other
//! languages read, with every number bit for bit; the same run gives the same bytes of file, every
//! time. A run that is cut off leaves a file that is readable up to its last flush. What a run did,
//! in order, is condensed into a [`Fingerprint`]; where two recordings part is found by
//! [`first_divergence`], and by how much two that are not meant to be the same differ, footstep by footstep, by
//! [`compare_events`].
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
//! let mut recorder = Recorder::new(Vec::new(), &info, &[group], &Skeleton::default(), Cadence::default())?;
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
//! # What a file holds
//!
//! Every channel has CDR messages and a `ros2msg` schema, complete with the types in it: that is the profile `ros2`.
//!
//! * a channel for each group of signals: one `float64` field a signal; names and units as they are in the run stand in the
//!   channel's metadata under `signals`, the name of the group under `group`,
//! * a channel for each [`Topic`], with messages of a standard type where there is one: [`Message`]s, and coordinate
//!   frames, odometry and joint states of the plant,
//! * a channel for each wire whose bytes are kept, with its name under `trace`,
//! * the files the run was made from as attachments,
//! * metadata `run` (seed, build, notes) and, if it came to its end, `result` (fingerprint, simulated
//!   time).
//!
//! Log times are simulated times plus [`EPOCH`]. Recordings of builds before 0.1.0, with JSON messages and bare bytes, are
//! read, too.
//!
//! # What it does not do
//!
//! It does not compress (numbers of a simulation hardly do, and it costs more than all the rest), does
//! not read compressed files, does not decide what is recorded, does not find footsteps (it reads those
//! that a run has found), and does not re-run anything.

mod aligned;
mod cdr;
mod channels;
mod divergence;
mod error;
mod fingerprint;
mod framing;
mod index;
mod messages;
mod observe;
mod poses;
mod recorder;
mod recording;
mod ros;
mod schema;
mod topic;

pub use aligned::{
    Drift, Ends, EventComparison, LegFootsteps, PARTS, Pairing, Pairings, RecordedFootstep, SHARES,
    SignalDrift, compare_events, median, pair_footsteps,
};
pub use divergence::{Comparison, Divergence, divergence_within, first_divergence};
pub use error::RecordError;
pub use fingerprint::{Digest, Fingerprint};
pub use messages::{
    ChangeMessage, EventMessage, ExpectationMessage, FootstepMessage, Message, VerdictMessage,
};
pub use poses::{Skeleton, SkeletonLeg};
pub use recorder::{Cadence, RecordedGroup, Recorder, RunInfo, group_name};
pub use recording::{Recording, Sample, SampledGroup, Series};
pub use schema::{EPOCH, Signal};
pub use topic::Topic;
