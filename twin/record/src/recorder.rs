//! Writing of MCAP files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Group, RunEvent};

use crate::channels::RecordedGroup;
use crate::encoder::{Encoder, is_regular};
use crate::mcap_writer::{Attachment, McapWriter};
use crate::run_info::RunInfo;
use crate::{Digest, EPOCH, Message, RecordError, Skeleton};

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
    encoder: Encoder<McapWriter<W>>,
    flush: SimDuration,
    flush_due: SimTime,
    failure: Option<RecordError>,
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
        let mut recorder = Self {
            encoder: Encoder::new(writer, info, groups, skeleton, cadence.frames)?,
            flush: cadence.flush,
            flush_due: SimTime::ZERO + cadence.flush,
            failure: None,
        };
        // The input files and the channels are on disk before the run starts.
        recorder.encoder.sink.flush()?;
        recorder.encoder.describe(SimTime::ZERO, &info.description);
        Ok(recorder)
    }

    /// Records the selected signals of `group` at `now`; `values` has the layout of the group.
    /// Undeclared groups are not recorded.
    #[inline]
    pub fn sample(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if self.is_writing(now) {
            self.encoder.sample(now, group, values);
        }
    }

    /// Records bytes transmitted on a wire trace at `now`; those of undeclared traces are not
    /// recorded.
    pub fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        if self.is_writing(now) {
            self.encoder.bytes(now, trace, bytes);
        }
    }

    /// Records `message` at `now`.
    pub fn message<M: Message>(&mut self, now: SimTime, message: &M) {
        if self.is_writing(now) {
            self.encoder.message(now, message);
        }
    }

    /// Records an event that is not one of each control step.
    #[inline]
    pub(crate) fn run_event(&mut self, now: SimTime, event: RunEvent) {
        if !is_regular(event) && self.is_writing(now) {
            self.encoder.event(now, event);
        }
    }

    /// Writes what is due at `now`, and returns whether nothing has failed.
    #[inline]
    fn is_writing(&mut self, now: SimTime) -> bool {
        let is_due = now >= self.flush_due || self.encoder.sink.chunk_bytes() > CHUNK_BYTES_MAX;
        if is_due && self.failure.is_none() {
            self.flush_due = now + self.flush;
            self.failure = self.encoder.sink.flush().err().map(RecordError::from);
        }
        self.failure.is_none()
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
        self.encoder.sink.metadata("result", &result)?;
        Ok(self.encoder.sink.finish()?)
    }
}

fn run_metadata(info: &RunInfo) -> BTreeMap<String, String> {
    let mut metadata = info.notes.clone();
    metadata.insert("seed".to_owned(), info.seed.to_string());
    metadata.insert("build".to_owned(), info.build.clone());
    metadata
}
