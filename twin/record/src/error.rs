//! The errors of this crate.

use std::path::PathBuf;

use thiserror::Error;

/// What can go wrong in writing, reading or comparing a recording.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordError {
    /// A file cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A file cannot be created.
    #[error("cannot create {}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The MCAP writer gave up, for instance because the disk is full.
    #[error("cannot write the recording")]
    Write(#[from] mcap::McapError),
    /// The signals of a group cannot be described.
    #[error("cannot describe the signals of `{group}`")]
    Describe {
        /// The group.
        group: &'static str,
        /// Why not.
        source: serde_json::Error,
    },
    /// The bytes are not those of an MCAP file.
    #[error("this is not an MCAP file: it does not start with the magic bytes")]
    NotMcap,
    /// A whole record makes no sense.
    #[error("the recording is damaged at byte {offset}: {why}")]
    Damaged {
        /// Where the record starts, in bytes from the start of the file.
        offset: usize,
        /// What is wrong with it.
        why: String,
    },
    /// The chunks are compressed, which this reader does not undo.
    #[error(
        "chunk at byte {offset} is compressed with `{compression}`; decompress the file with `mcap convert` first"
    )]
    Compressed {
        /// Where the chunk starts, in bytes from the start of the file.
        offset: usize,
        /// The name of the compression.
        compression: String,
    },
    /// A valid MCAP file that no twin wrote.
    #[error(
        "channel `{channel}` does not describe its signals as a recording of a twin does: {why}"
    )]
    Foreign {
        /// The topic of the channel.
        channel: String,
        /// What is missing or wrong.
        why: String,
    },
    /// A signal is asked for that was not recorded.
    #[error("no signal `{name}` in this recording{}", nearest.as_ref().map_or_else(String::new, |near| format!("; did you mean `{near}`?")))]
    UnknownSignal {
        /// The name asked for.
        name: String,
        /// The recorded name nearest to it.
        nearest: Option<String>,
    },
    /// A message is not of the type that its topic has.
    #[error("message {index} of {topic} does not read: {why}")]
    Decode {
        /// The topic.
        topic: &'static str,
        /// Which message of it, counted from 0.
        index: usize,
        /// Why not.
        why: String,
    },
}
