//! Errors of this crate.

use std::path::PathBuf;

use thiserror::Error;

/// Error of writing, reading or comparing recordings.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordError {
    /// A file cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A file cannot be created.
    #[error("cannot create {}", path.display())]
    Create {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// Writing failed, for instance because the disk is full.
    #[error("cannot write the recording")]
    Write(#[from] std::io::Error),
    /// The signals of a group cannot be described.
    #[error("cannot describe the signals of `{group}`")]
    Describe {
        /// Name of the group.
        group: &'static str,
        /// Cause.
        source: serde_json::Error,
    },
    /// The data do not begin as an MCAP file.
    #[error("not an MCAP file: it does not start with the magic bytes")]
    NotMcap,
    /// A complete record has invalid content.
    #[error("the recording is damaged at byte {offset}: {why}")]
    Damaged {
        /// Offset of the record from the start of the file \[bytes\].
        offset: usize,
        /// Description of the damage.
        why: String,
    },
    /// The chunks are compressed, which this reader does not support.
    #[error(
        "chunk at byte {offset} is compressed with `{compression}`; decompress the file with `mcap convert` first"
    )]
    Compressed {
        /// Offset of the chunk from the start of the file \[bytes\].
        offset: usize,
        /// Name of the compression.
        compression: String,
    },
    /// A valid MCAP file that was not written by this program.
    #[error("channel `{channel}` does not describe its signals as a Twinrig recording does: {why}")]
    Foreign {
        /// Topic of the channel.
        channel: String,
        /// Missing or wrong part of the description.
        why: String,
    },
    /// A requested signal was not recorded.
    #[error("no signal `{name}` in this recording{}", nearest.as_ref().map_or_else(String::new, |near| format!("; did you mean `{near}`?")))]
    UnknownSignal {
        /// Requested name.
        name: String,
        /// Nearest recorded name.
        nearest: Option<String>,
    },
    /// A message is not of the type of its topic.
    #[error("message {index} of {topic} cannot be decoded: {why}")]
    Decode {
        /// Name of the topic.
        topic: &'static str,
        /// Index of the message within the topic, from 0.
        index: usize,
        /// Cause.
        why: String,
    },
}
