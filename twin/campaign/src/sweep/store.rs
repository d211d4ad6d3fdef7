//! Store of rows on disk, from which an interrupted sweep continues.
//!
//! A store is a folder with a file for each partition; a process locks the file that it appends to,
//! and the system releases the lock when the process ends, in whatever way. A line is JSON: the
//! first digits of the hash of the rest, the key of the row, and the row. It is one write, so that
//! a killed process leaves whole lines and at most one torn one. A line that is torn or whose hash
//! differs is not used: its run is repeated.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::row::{RowKey, SweepRow};

/// Every n-th point of a sweep, for one of n machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Partition {
    /// Number of the partition, from 1.
    pub part: usize,
    /// Number of partitions.
    pub of: usize,
}

impl Partition {
    /// The only partition: all points.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// Returns whether the point `index`, from 0, belongs to the partition.
    pub fn contains(self, index: usize) -> bool {
        index % self.of == self.part - 1
    }

    /// Returns whether it is the only one.
    pub fn is_whole(self) -> bool {
        self == Self::WHOLE
    }

    fn file_name(self) -> String {
        match self {
            Self::WHOLE => format!("all.{ENDING}"),
            Self { part, of } => format!("part-{part}-of-{of}.{ENDING}"),
        }
    }
}

/// As on the command line: `2/3`.
impl std::fmt::Display for Partition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

/// From `2/3`: the second of three.
impl FromStr for Partition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/');
        let numbers = numbers.and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((part, of)) if part >= 1 && part <= of => Ok(Self { part, of }),
            _ => Err("it is written i/n, with i from 1 to n: 2/3".to_owned()),
        }
    }
}

/// Error of a store.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Another process appends to the file.
    #[error(
        "another sweep is writing {}\n  = help: wait for its end, choose another folder, or divide the work by --partition i/n",
        path.display()
    )]
    Locked {
        /// The file.
        path: PathBuf,
    },
    /// A file or folder cannot be read or written.
    #[error("cannot use {}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
}

/// Ending of the files of a store.
const ENDING: &str = "jsonl";
/// Hexadecimal digits of the hash of a line: 64 bits, against accidents.
const CHECK_DIGITS: usize = 16;

/// An open store.
#[derive(Debug)]
pub struct RowStore {
    folder: PathBuf,
    path: PathBuf,
    /// Locked until the store is dropped.
    file: File,
    /// Keys of the sweep; rows of other sweeps are not kept in memory.
    wanted: BTreeSet<RowKey>,
    rows: BTreeMap<RowKey, SweepRow>,
    warnings: Vec<String>,
}

impl RowStore {
    /// Opens the store in `folder`, which it creates, to append the rows of a partition. Reads the
    /// rows with a `wanted` key, of all partitions.
    ///
    /// # Errors
    /// [`StoreError`] if another process appends to the same partition, or a file cannot be used.
    pub fn open(
        folder: &Path,
        partition: Partition,
        wanted: BTreeSet<RowKey>,
    ) -> Result<Self, StoreError> {
        let path = folder.join(partition.file_name());
        let failed = |source| StoreError::File {
            path: path.clone(),
            source,
        };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut options = OpenOptions::new();
        let file = options.read(true).append(true).create(true).open(&path);
        let file = file.map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(StoreError::Locked { path }),
            Err(TryLockError::Error(source)) => return Err(failed(source)),
        }
        let mut store = Self {
            folder: folder.to_owned(),
            path: path.clone(),
            file,
            wanted,
            rows: BTreeMap::new(),
            warnings: Vec::new(),
        };
        let (complete, damaged) = store.read(&path)?;
        // A line that a killed process left is not continued by the next one.
        let length = store.file.metadata().map_err(failed)?.len();
        if complete < length {
            store.file.set_len(complete).map_err(failed)?;
            store.warn(&path, 1);
        }
        store.read_others()?;
        store.warn_of_rows(&path, damaged);
        Ok(store)
    }

    /// Reads the files of the other partitions, which may have grown.
    ///
    /// # Errors
    /// [`StoreError`] if a file cannot be read.
    pub fn read_others(&mut self) -> Result<(), StoreError> {
        let failed = |source| StoreError::File {
            path: self.folder.clone(),
            source,
        };
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(&self.folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if path.extension().is_some_and(|ending| ending == ENDING) && path != self.path {
                paths.push(path);
            }
        }
        // Folders have no order.
        paths.sort();
        let mut damaged = Vec::new();
        for path in paths {
            let (_, count) = self.read(&path)?;
            damaged.push((path, count));
        }
        for (path, count) in damaged {
            self.warn_of_rows(&path, count);
        }
        Ok(())
    }

    /// Reads a file; returns the length of its complete lines, and the number of damaged ones.
    fn read(&mut self, path: &Path) -> Result<(u64, usize), StoreError> {
        let failed = |source| StoreError::File {
            path: path.to_owned(),
            source,
        };
        let mut reader = BufReader::new(File::open(path).map_err(failed)?);
        let (mut complete, mut damaged) = (0, 0);
        let mut line = Vec::new();
        loop {
            line.clear();
            let length = reader.read_until(b'\n', &mut line).map_err(failed)?;
            // The last line of another process may still be incomplete.
            let Some((b'\n', text)) = line.split_last() else {
                break;
            };
            complete += length as u64;
            match read_line(text) {
                Some((key, row)) if self.wanted.contains(&key) => {
                    self.rows.entry(key).or_insert(row);
                }
                Some(_) => {}
                None => damaged += 1,
            }
        }
        Ok((complete, damaged))
    }

    /// Reports damaged lines, unless their runs have been repeated: they stay in the file.
    fn warn_of_rows(&mut self, path: &Path, damaged: usize) {
        let mut keys = self.wanted.iter();
        if damaged > 0 && keys.any(|key| !self.rows.contains_key(key)) {
            self.warn(path, damaged);
        }
    }

    fn warn(&mut self, path: &Path, damaged: usize) {
        let (lines, their) = if damaged == 1 {
            ("line", "its run is")
        } else {
            ("lines", "their runs are")
        };
        let warning = format!(
            "{damaged} damaged {lines} in {}; {their} repeated",
            path.display()
        );
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    /// Returns the row of a key.
    pub fn get(&self, key: &RowKey) -> Option<&SweepRow> {
        self.rows.get(key)
    }

    /// Returns messages about lines that are not used.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Appends a row, which survives the end of the process from then on.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be written.
    pub fn append(&mut self, key: RowKey, row: SweepRow) -> Result<(), StoreError> {
        let written = self.file.write_all(&line(key, &row));
        written.map_err(|source| StoreError::File {
            path: self.path.clone(),
            source,
        })?;
        self.rows.insert(key, row);
        Ok(())
    }
}

impl Drop for RowStore {
    fn drop(&mut self) {
        // A process that was forked meanwhile has the same open file, and with it the lock.
        // Without success, the lock ends with the last of them.
        let _ = self.file.unlock();
    }
}

#[derive(Serialize)]
struct WrittenEntry<'a> {
    key: RowKey,
    row: &'a SweepRow,
}

#[derive(Deserialize)]
struct ReadEntry {
    key: String,
    row: SweepRow,
}

/// Returns the line of a row, with its line break.
fn line(key: RowKey, row: &SweepRow) -> Vec<u8> {
    // Rows have only string keys and finite numbers, which can be serialised.
    let entry = serde_json::to_string(&WrittenEntry { key, row }).unwrap_or_default();
    let rest = entry.strip_prefix('{').unwrap_or_default();
    format!("{{\"check\":\"{}\",{rest}\n", check(rest.as_bytes())).into_bytes()
}

/// Returns the row of a line without its line break; none for a damaged line.
fn read_line(line: &[u8]) -> Option<(RowKey, SweepRow)> {
    let line = line.strip_prefix(b"{\"check\":\"")?;
    let (digits, rest) = line.split_at_checked(CHECK_DIGITS)?;
    let rest = rest.strip_prefix(b"\",")?;
    if check(rest).as_bytes() != digits {
        return None;
    }
    let entry: ReadEntry = serde_json::from_slice(&[b"{", rest].concat()).ok()?;
    Some((RowKey::parse(&entry.key)?, entry.row))
}

fn check(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..CHECK_DIGITS].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As by a fork: another descriptor of the same open file.
    #[test]
    fn lock_ends_with_the_store() {
        let name = format!("twinrig-sweep-lock-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let open = || RowStore::open(&folder, Partition::WHOLE, BTreeSet::new());
        let store = open().unwrap();
        let inherited = store.file.try_clone().unwrap();
        assert!(open().is_err());
        drop(store);
        let reopened = open().map(drop);
        drop(inherited);
        let _ = std::fs::remove_dir_all(&folder);
        reopened.unwrap();
    }
}
