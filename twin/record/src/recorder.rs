//! The writing side: a run becomes an MCAP file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use mcap::records::Metadata;
use mcap::write::NoSeek;
use mcap::{Attachment, WriteOptions, Writer};
use twinrig_kernel::{Layout, SimDuration, SimTime};
use twinrig_runtime::Group;

use crate::cdr::{self, CdrWriter};
use crate::channels::{Channel, Sampled, add_group, add_topic, add_traces};
use crate::poses::Poses;
use crate::{Digest, EPOCH, Message, RecordError, Skeleton, Topic};

/// What is known of a run before it starts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunInfo {
    /// Name and text of every file the run was made from: scenario, robot.
    pub files: Vec<(String, Vec<u8>)>,
    /// The seed of its random streams.
    pub seed: u64,
    /// Which build ran it: version, commit.
    pub build: String,
    /// Whatever else tells this run from others: overridden keys, the plant.
    pub notes: BTreeMap<String, String>,
    /// The names of its tasks, by their numbers in [`twinrig_runtime::RunEvent`].
    pub tasks: Vec<String>,
    /// The names of the process variables, by their numbers in [`twinrig_runtime::RunEvent`].
    pub variables: Vec<String>,
    /// The names of the lanes whose bytes are kept, by their numbers in [`twinrig_runtime::Observer::bytes`].
    pub traces: Vec<String>,
}

/// A group of signals that are sampled together, and which of them are kept.
pub struct RecordedGroup<'a> {
    /// Which group.
    pub group: Group,
    /// How the values of a sample are laid out.
    pub layout: &'a Layout,
    /// Whether the signal of that name is recorded.
    pub keep: &'a dyn Fn(&str) -> bool,
}

/// The name of a group in a recording.
pub const fn group_name(group: Group) -> &'static str {
    match group {
        Group::Plant => "plant",
        Group::ProcessInputs => "process-inputs",
        Group::ProcessOutputs => "process-outputs",
        Group::Diagnostics => "gauges",
    }
}

/// How often what is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cadence {
    /// Simulated time between two sets of coordinate frames, odometry and joint states; `None` writes none.
    pub frames: Option<SimDuration>,
    /// Simulated time after which a chunk is closed and handed to the file. What was written by then
    /// survives whatever happens to the process.
    pub flush: SimDuration,
}

impl Default for Cadence {
    /// 50 sets of frames and one flush a simulated second.
    fn default() -> Self {
        Self {
            frames: Some(SimDuration::from_millis(20)),
            flush: SimDuration::from_secs(1),
        }
    }
}

/// A chunk is closed at this size however little time has passed.
const CHUNK_BYTES_MAX: usize = 4 << 20;

/// Writes a run into an MCAP file.
///
/// The first failure is kept and everything after it is dropped, so that a run need not look at each
/// call: [`Recorder::failure`] tells, and [`Recorder::finish`] returns it.
///
/// Call [`Recorder::sample`] and [`Recorder::message`] in order of time, [`Recorder::finish`] at the end. A
/// recorder that is merely dropped still closes the file, but without fingerprint.
pub struct Recorder<W: Write> {
    writer: Writer<NoSeek<W>>,
    groups: [Option<Sampled>; 4],
    topics: [Option<Channel>; Topic::ALL.len()],
    traces: Vec<Channel>,
    poses: Option<(Poses, SimDuration)>,
    poses_due: SimTime,
    flush: SimDuration,
    flush_due: SimTime,
    unflushed_bytes: usize,
    /// The message that is being made.
    scratch: Vec<u8>,
    failure: Option<RecordError>,
    pub(crate) tasks: Vec<String>,
    pub(crate) variables: Vec<String>,
}

impl Recorder<BufWriter<File>> {
    /// Records into a new file at `path`; an old one is overwritten.
    ///
    /// # Errors
    /// A file that cannot be created or written.
    pub fn create(
        path: &Path,
        info: &RunInfo,
        groups: &[RecordedGroup<'_>],
        skeleton: &Skeleton,
        cadence: Cadence,
    ) -> Result<Self, RecordError> {
        let file = File::create(path).map_err(|source| RecordError::Create {
            path: path.to_owned(),
            source,
        })?;
        Self::new(BufWriter::new(file), info, groups, skeleton, cadence)
    }
}

impl<W: Write> Recorder<W> {
    /// Records into `out`. The frames are taken from the plant, if that is among `groups`.
    ///
    /// # Errors
    /// An `out` that cannot be written.
    pub fn new(
        out: W,
        info: &RunInfo,
        groups: &[RecordedGroup<'_>],
        skeleton: &Skeleton,
        cadence: Cadence,
    ) -> Result<Self, RecordError> {
        let mut writer = WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(concat!("twinrig ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None)
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        for (name, text) in &info.files {
            writer.attach(&Attachment {
                log_time: EPOCH.as_nanos(),
                create_time: EPOCH.as_nanos(),
                name: name.clone(),
                media_type: "application/toml".to_owned(),
                data: text.as_slice().into(),
            })?;
        }
        writer.write_metadata(&run_metadata(info))?;
        let plant = groups.iter().find(|one| one.group == Group::Plant);
        let poses = cadence.frames.zip(plant).map(|(period, plant)| {
            let poses = Poses::new(skeleton, plant.layout, plant.keep);
            (poses, period)
        });
        let mut sampled = [const { None }; 4];
        for declared in groups {
            sampled[declared.group as usize] = Some(add_group(&mut writer, declared)?);
        }
        let mut topics = [const { None }; Topic::ALL.len()];
        let posed = poses.iter().flat_map(|(poses, _)| poses.topics());
        for topic in Topic::OF_MESSAGES.into_iter().chain(posed) {
            topics[topic as usize] = Some(add_topic(&mut writer, topic)?);
        }
        let traces = add_traces(&mut writer, &info.traces)?;
        let mut recorder = Self {
            writer,
            traces,
            groups: sampled,
            topics,
            poses,
            poses_due: SimTime::ZERO,
            flush: cadence.flush,
            flush_due: SimTime::ZERO + cadence.flush,
            unflushed_bytes: 0,
            scratch: Vec::with_capacity(8192),
            failure: None,
            tasks: info.tasks.clone(),
            variables: info.variables.clone(),
        };
        // What a run was made from is on disk before it starts.
        recorder.writer.flush()?;
        Ok(recorder)
    }

    /// Records the kept signals of `group`, whose layout `values` has, at `now`. A group that was not
    /// declared is not recorded.
    #[inline]
    pub fn sample(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if self.failure.is_none()
            && let Err(error) = self.try_sample(now, group, values)
        {
            self.failure = Some(error);
        }
    }

    fn try_sample(
        &mut self,
        now: SimTime,
        group: Group,
        values: &[f64],
    ) -> Result<(), RecordError> {
        self.flush_if_due(now)?;
        let Some(Sampled {
            channel,
            ranges,
            message,
        }) = &mut self.groups[group as usize]
        else {
            return Ok(());
        };
        if !ranges.is_empty() {
            let mut rest = &mut message[cdr::HEADER.len()..];
            for range in ranges {
                let kept = &values[range.clone()];
                let (bytes, after) = rest.split_at_mut(kept.len() * 8);
                for (bytes, value) in bytes.chunks_exact_mut(8).zip(kept) {
                    bytes.copy_from_slice(&value.to_bits().to_le_bytes());
                }
                rest = after;
            }
            self.unflushed_bytes += message.len();
            self.writer
                .write_to_known_channel(&channel.header(now), message)?;
        }
        if group == Group::Plant && now >= self.poses_due {
            self.write_poses(now, values)?;
        }
        Ok(())
    }

    fn write_poses(&mut self, now: SimTime, values: &[f64]) -> Result<(), RecordError> {
        let Some((poses, period)) = &mut self.poses else {
            self.poses_due = SimTime::from_nanos(u64::MAX);
            return Ok(());
        };
        self.poses_due = now + *period;
        let stamp = cdr::stamp(now);
        for topic in Topic::OF_POSES {
            if let Some(channel) = &mut self.topics[topic as usize]
                && let Some(message) = poses.message(topic, stamp, values)
            {
                self.unflushed_bytes += message.len();
                self.writer
                    .write_to_known_channel(&channel.header(now), message)?;
            }
        }
        Ok(())
    }

    /// Records bytes that passed on a lane at `now`; those of a lane that was not declared are not recorded.
    pub fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        if self.failure.is_none()
            && trace < self.traces.len()
            && let Err(error) = self.try_bytes(now, trace, bytes)
        {
            self.failure = Some(error);
        }
    }

    fn try_bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) -> Result<(), RecordError> {
        self.flush_if_due(now)?;
        CdrWriter::new(&mut self.scratch).octets(bytes);
        self.unflushed_bytes += self.scratch.len();
        let header = self.traces[trace].header(now);
        self.writer.write_to_known_channel(&header, &self.scratch)?;
        Ok(())
    }

    /// Records `message` at `now`.
    pub fn message<M: Message>(&mut self, now: SimTime, message: &M) {
        if self.failure.is_none()
            && let Err(error) = self.try_message(now, message)
        {
            self.failure = Some(error);
        }
    }

    fn try_message<M: Message>(&mut self, now: SimTime, message: &M) -> Result<(), RecordError> {
        self.flush_if_due(now)?;
        let Some(channel) = &mut self.topics[M::TOPIC as usize] else {
            return Ok(());
        };
        message.write(cdr::stamp(now), &mut CdrWriter::new(&mut self.scratch));
        self.unflushed_bytes += self.scratch.len();
        self.writer
            .write_to_known_channel(&channel.header(now), &self.scratch)?;
        Ok(())
    }

    fn flush_if_due(&mut self, now: SimTime) -> Result<(), RecordError> {
        if now >= self.flush_due || self.unflushed_bytes > CHUNK_BYTES_MAX {
            self.flush_due = now + self.flush;
            self.unflushed_bytes = 0;
            self.writer.flush()?;
        }
        Ok(())
    }

    /// The first thing that went wrong, if anything has.
    pub fn failure(&self) -> Option<&RecordError> {
        self.failure.as_ref()
    }

    /// Adds the fingerprint and the simulated time reached, closes the file and gives back `W`.
    ///
    /// # Errors
    /// The first failure of the whole recording.
    pub fn finish(mut self, fingerprint: Digest, reached: SimTime) -> Result<W, RecordError> {
        if let Some(error) = self.failure.take() {
            return Err(error);
        }
        self.writer.write_metadata(&Metadata {
            name: "result".to_owned(),
            metadata: BTreeMap::from([
                ("fingerprint".to_owned(), fingerprint.to_string()),
                ("simulated_ns".to_owned(), reached.as_nanos().to_string()),
            ]),
        })?;
        self.writer.finish()?;
        let mut out = self.writer.into_inner().into_inner();
        out.flush().map_err(mcap::McapError::Io)?;
        Ok(out)
    }
}

fn run_metadata(info: &RunInfo) -> Metadata {
    let mut metadata = info.notes.clone();
    metadata.insert("seed".to_owned(), info.seed.to_string());
    metadata.insert("build".to_owned(), info.build.clone());
    Metadata {
        name: "run".to_owned(),
        metadata,
    }
}
