//! Writing of MCAP files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Group;

use crate::cdr::{self, CdrWriter};
use crate::channels::{RecordedGroup, Sampled, add_group, add_topic, add_traces};
use crate::mcap_writer::{Attachment, ChannelId, McapWriter};
use crate::poses::Poses;
use crate::{Digest, EPOCH, Message, RecordError, Skeleton, Topic};

/// Information about a run that is known before its start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunInfo {
    /// Name and contents of each input file of the run: scenario, robot.
    pub files: Vec<(String, Vec<u8>)>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Build identification: version, commit.
    pub build: String,
    /// Further metadata of the run: overridden keys, the plant.
    pub notes: BTreeMap<String, String>,
    /// Names of the tasks, indexed by their numbers in [`twinrig_runtime::RunEvent`].
    pub tasks: Vec<String>,
    /// Names of the process variables, indexed by their numbers in [`twinrig_runtime::RunEvent`].
    pub variables: Vec<String>,
    /// Names of the recorded wire traces, indexed by their numbers in
    /// [`twinrig_runtime::Observer::bytes`].
    pub traces: Vec<String>,
}

/// Intervals of writing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cadence {
    /// Simulated time between two sets of coordinate frames, odometry and joint states; `None`
    /// disables them.
    pub frames: Option<SimDuration>,
    /// Simulated time after which a chunk is closed and written to the file; its contents survive a
    /// crash of the process.
    pub flush: SimDuration,
}

impl Default for Cadence {
    /// 50 sets of frames and one flush per simulated second.
    fn default() -> Self {
        Self {
            frames: Some(SimDuration::from_millis(20)),
            flush: SimDuration::from_secs(1),
        }
    }
}

/// Size at which a chunk is closed before the flush interval has passed.
const CHUNK_BYTES_MAX: usize = 4 << 20;

/// Writer of a run to an MCAP file.
///
/// The first failure is stored and later data are discarded, so that calls need not be checked
/// individually: [`Recorder::failure`] reports it, and [`Recorder::finish`] returns it.
///
/// Call [`Recorder::sample`] and [`Recorder::message`] in order of time, and [`Recorder::finish`]
/// at the end. A recorder that is dropped without it closes the file without a fingerprint.
pub struct Recorder<W: Write> {
    writer: McapWriter<W>,
    groups: [Option<Sampled>; 4],
    topics: [Option<ChannelId>; Topic::ALL.len()],
    traces: Vec<ChannelId>,
    poses: Option<(Poses, SimDuration)>,
    poses_due: SimTime,
    flush: SimDuration,
    flush_due: SimTime,
    /// Buffer of the message being encoded.
    scratch: Vec<u8>,
    failure: Option<RecordError>,
    pub(crate) tasks: Vec<String>,
    pub(crate) variables: Vec<String>,
}

impl Recorder<BufWriter<File>> {
    /// Creates a recorder that writes to a new file at `path`; an existing one is overwritten.
    ///
    /// # Errors
    /// The file cannot be created or written.
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
    /// Creates a recorder that writes to `out`. The frames are derived from the plant, if it is
    /// among `groups`.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub fn new(
        out: W,
        info: &RunInfo,
        groups: &[RecordedGroup<'_>],
        skeleton: &Skeleton,
        cadence: Cadence,
    ) -> Result<Self, RecordError> {
        let library = concat!("twinrig ", env!("CARGO_PKG_VERSION"));
        let mut writer = McapWriter::new(out, "ros2", library)?;
        for (name, text) in &info.files {
            writer.attach(&Attachment {
                name,
                media_type: "application/toml",
                time: EPOCH.as_nanos(),
                data: text,
            })?;
        }
        writer.metadata("run", &run_metadata(info))?;
        let plant = groups.iter().find(|group| group.group == Group::Plant);
        let poses = cadence.frames.zip(plant).map(|(period, plant)| {
            let poses = Poses::new(skeleton, plant.layout, plant.keep);
            (poses, period)
        });
        let mut sampled = [const { None }; 4];
        for declared in groups {
            sampled[declared.group as usize] = Some(add_group(&mut writer, declared)?);
        }
        let mut topics = [const { None }; Topic::ALL.len()];
        let pose_topics = poses.iter().flat_map(|(poses, _)| poses.topics());
        for topic in Topic::MESSAGES.into_iter().chain(pose_topics) {
            topics[topic as usize] = Some(add_topic(&mut writer, topic));
        }
        let traces = add_traces(&mut writer, &info.traces);
        let mut recorder = Self {
            writer,
            traces,
            groups: sampled,
            topics,
            poses,
            poses_due: SimTime::ZERO,
            flush: cadence.flush,
            flush_due: SimTime::ZERO + cadence.flush,
            scratch: Vec::with_capacity(8192),
            failure: None,
            tasks: info.tasks.clone(),
            variables: info.variables.clone(),
        };
        // The input files are on disk before the run starts.
        recorder.writer.flush()?;
        Ok(recorder)
    }

    /// Records the selected signals of `group` at `now`; `values` has the layout of the group.
    /// Undeclared groups are not recorded.
    #[inline]
    pub fn sample(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if self.failure.is_none()
            && let Err(error) = self.try_sample(now, group, values)
        {
            self.failure = Some(error);
        }
    }

    #[inline]
    fn try_sample(
        &mut self,
        now: SimTime,
        group: Group,
        values: &[f64],
    ) -> Result<(), RecordError> {
        self.flush_if_due(now)?;
        let Some(sampled) = &self.groups[group as usize] else {
            return Ok(());
        };
        if !sampled.ranges.is_empty() {
            let message = self
                .writer
                .message(sampled.channel, log_time(now), sampled.size);
            let (header, mut rest) = message.split_at_mut(cdr::HEADER.len());
            header.copy_from_slice(&cdr::HEADER);
            for range in &sampled.ranges {
                let kept = &values[range.clone()];
                let (bytes, after) = rest.split_at_mut(kept.len() * 8);
                for (bytes, value) in bytes.chunks_exact_mut(8).zip(kept) {
                    bytes.copy_from_slice(&value.to_bits().to_le_bytes());
                }
                rest = after;
            }
        }
        if group == Group::Plant && now >= self.poses_due {
            self.write_poses(now, values);
        }
        Ok(())
    }

    fn write_poses(&mut self, now: SimTime, values: &[f64]) {
        let Some((poses, period)) = &mut self.poses else {
            self.poses_due = SimTime::from_nanos(u64::MAX);
            return;
        };
        self.poses_due = now + *period;
        let stamp = cdr::stamp(now);
        for topic in Topic::POSES {
            if let Some(channel) = self.topics[topic as usize]
                && let Some(message) = poses.message(topic, stamp, values)
            {
                let room = self.writer.message(channel, log_time(now), message.len());
                room.copy_from_slice(message);
            }
        }
    }

    /// Records bytes transmitted on a wire trace at `now`; those of undeclared traces are not
    /// recorded.
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
        self.write_scratch(self.traces[trace], now);
        Ok(())
    }

    fn write_scratch(&mut self, channel: ChannelId, now: SimTime) {
        let room = self
            .writer
            .message(channel, log_time(now), self.scratch.len());
        room.copy_from_slice(&self.scratch);
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
        if let Some(channel) = self.topics[M::TOPIC as usize] {
            message.write(cdr::stamp(now), &mut CdrWriter::new(&mut self.scratch));
            self.write_scratch(channel, now);
        }
        Ok(())
    }

    fn flush_if_due(&mut self, now: SimTime) -> Result<(), RecordError> {
        if now >= self.flush_due || self.writer.chunk_bytes() > CHUNK_BYTES_MAX {
            self.flush_due = now + self.flush;
            self.writer.flush()?;
        }
        Ok(())
    }

    /// Returns the first failure, if any.
    pub fn failure(&self) -> Option<&RecordError> {
        self.failure.as_ref()
    }

    /// Writes the fingerprint and the simulated time reached, closes the file and returns `W`.
    ///
    /// # Errors
    /// The first failure of the recording.
    pub fn finish(mut self, fingerprint: Digest, reached: SimTime) -> Result<W, RecordError> {
        if let Some(error) = self.failure.take() {
            return Err(error);
        }
        let result = BTreeMap::from([
            ("fingerprint".to_owned(), fingerprint.to_string()),
            ("simulated_ns".to_owned(), reached.as_nanos().to_string()),
        ]);
        self.writer.metadata("result", &result)?;
        Ok(self.writer.finish()?)
    }
}

/// Converts `now` to the time line of recordings \[ns\].
fn log_time(now: SimTime) -> u64 {
    now.as_nanos().saturating_add(EPOCH.as_nanos())
}

fn run_metadata(info: &RunInfo) -> BTreeMap<String, String> {
    let mut metadata = info.notes.clone();
    metadata.insert("seed".to_owned(), info.seed.to_string());
    metadata.insert("build".to_owned(), info.build.clone());
    metadata
}
