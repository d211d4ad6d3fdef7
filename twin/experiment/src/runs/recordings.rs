//! List of the recordings of a sweep, each on the machine of its run.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use twinrig_campaign::sweep::{Partition, RowKey};
use twinrig_rig::error::Error as RigError;

use crate::error::Error;

/// Header of the list.
const HEADER: &str = "key,machine,path\n";

/// Place of a recording, which stays where it was made.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RecordingPlace {
    /// Name of the machine.
    pub(crate) host: String,
    pub(crate) path: String,
}

impl RecordingPlace {
    /// Returns the place of a recording on this machine.
    pub(crate) fn here(path: &Path) -> Self {
        Self {
            host: host_name(),
            path: path.display().to_string(),
        }
    }
}

/// Returns the name of this machine, which Linux has in a file.
pub(crate) fn host_name() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname");
    name.unwrap_or_default().trim().to_owned()
}

/// Appends to `recordings.csv`: key of the row, machine, path. It is no part of the results, which
/// do not depend on machines.
pub(crate) struct RecordingList {
    path: PathBuf,
    file: Option<File>,
}

impl RecordingList {
    /// Returns the list of a partition in the folder of the results.
    pub(crate) fn new(folder: &Path, partition: Partition) -> Self {
        let name = if partition.is_whole() {
            "recordings.csv".to_owned()
        } else {
            format!("recordings-{}-of-{}.csv", partition.part, partition.of)
        };
        Self {
            path: folder.join(name),
            file: None,
        }
    }

    /// Appends a recording.
    pub(super) fn append(&mut self, key: RowKey, place: &RecordingPlace) -> Result<(), Error> {
        let RecordingPlace { host, path } = place;
        // A path may have a comma.
        let mut line = format!("{key},{host},\"{}\"\n", path.replace('"', "\"\""));
        let mut write = || {
            if self.file.is_none() {
                let mut options = OpenOptions::new();
                let file = options.append(true).create(true).open(&self.path)?;
                if file.metadata()?.len() == 0 {
                    line.insert_str(0, HEADER);
                }
                self.file = Some(file);
            }
            // One write, so that a killed process leaves whole lines.
            self.file
                .as_mut()
                .map_or(Ok(()), |file| file.write_all(line.as_bytes()))
        };
        write().map_err(|source| {
            Error::from(RigError::Write {
                path: self.path.clone(),
                source,
            })
        })
    }
}
