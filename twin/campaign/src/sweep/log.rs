//! Log of rows on disk: one file to append to, and those of other processes beside it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::partition::Partition;
use super::row::{RowKey, SweepRow};

/// Error of a store.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Another process appends to the file.
    #[error(
        "another process is writing {}\n  = help: wait for its end, or choose another folder by --out; several processes share a sweep by --partition i/n",
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

/// A log of rows of one type that is open to be appended to. It keeps no rows in memory.
#[derive(Debug)]
pub struct RowLog<R = SweepRow> {
    folder: PathBuf,
    path: PathBuf,
    /// Locked until the log is dropped.
    file: File,
    row: PhantomData<fn(&R) -> R>,
}

/// Lines of a file that were not used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DamagedLines {
    /// The file.
    pub path: PathBuf,
    /// Number of lines.
    pub count: usize,
}

/// `2 damaged lines in rows/all.jsonl; their runs are repeated`.
impl std::fmt::Display for DamagedLines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (lines, their) = if self.count == 1 {
            ("line", "its run is")
        } else {
            ("lines", "their runs are")
        };
        let Self { path, count } = self;
        let path = path.display();
        write!(f, "{count} damaged {lines} in {path}; {their} repeated")
    }
}

impl<R: Serialize + DeserializeOwned> RowLog<R> {
    /// Opens the log in `folder`, which it creates, to append the rows of a partition, and passes
    /// the rows of this partition to `visit`. Of a line that a killed process left incomplete,
    /// nothing remains; it is returned.
    ///
    /// # Errors
    /// [`StoreError`] if another process appends to the same partition, or a file cannot be used.
    pub fn open(
        folder: &Path,
        partition: Partition,
        visit: &mut dyn FnMut(RowKey, R),
    ) -> Result<(Self, OpenedLog), StoreError> {
        let path = folder.join(format!("{}.{ENDING}", partition.file_stem()));
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
        let (complete, damaged) = read(&path, visit)?;
        // A line that a killed process left is not continued by the next one.
        let length = file.metadata().map_err(failed)?.len();
        let is_torn = complete < length;
        if is_torn {
            file.set_len(complete).map_err(failed)?;
        }
        let lines = |count| DamagedLines {
            path: path.clone(),
            count,
        };
        let opened = OpenedLog {
            torn: is_torn.then(|| lines(1)),
            damaged: (damaged > 0).then(|| lines(damaged)),
        };
        let log = Self {
            folder: folder.to_owned(),
            path,
            file,
            row: PhantomData,
        };
        Ok((log, opened))
    }

    /// Passes the rows of the other partitions to `visit`; returns their damaged lines.
    ///
    /// # Errors
    /// [`StoreError`] if a file cannot be read.
    pub fn read_others(
        &self,
        visit: &mut dyn FnMut(RowKey, R),
    ) -> Result<Vec<DamagedLines>, StoreError> {
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
            let (_, count) = read(&path, visit)?;
            if count > 0 {
                damaged.push(DamagedLines { path, count });
            }
        }
        Ok(damaged)
    }

    /// Returns the row of a key that this process may append to, read from disk.
    ///
    /// # Errors
    /// [`StoreError`] if the file cannot be read.
    pub fn find(&self, key: RowKey) -> Result<Option<R>, StoreError> {
        let mut found = None;
        read(&self.path, &mut |other, row| {
            if other == key {
                found.get_or_insert(row);
            }
        })?;
        Ok(found)
    }

    /// Appends a row, which survives the end of the process from then on.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be written.
    pub fn append(&mut self, key: RowKey, row: &R) -> Result<(), StoreError> {
        let written = self.file.write_all(&line(key, row));
        written.map_err(|source| StoreError::File {
            path: self.path.clone(),
            source,
        })
    }
}

/// Lines that were not used when a log was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OpenedLog {
    /// An incomplete last line, which has been removed.
    pub torn: Option<DamagedLines>,
    /// Other damaged lines, which remain.
    pub damaged: Option<DamagedLines>,
}

impl<R> Drop for RowLog<R> {
    fn drop(&mut self) {
        // A process that was forked meanwhile has the same open file, and with it the lock.
        // Without success, the lock ends with the last of them.
        let _ = self.file.unlock();
    }
}

/// Reads a file; returns the length of its complete lines, and the number of damaged ones.
fn read<R: DeserializeOwned>(
    path: &Path,
    visit: &mut dyn FnMut(RowKey, R),
) -> Result<(u64, usize), StoreError> {
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
            Some((key, row)) => visit(key, row),
            None => damaged += 1,
        }
    }
    Ok((complete, damaged))
}

#[derive(Serialize)]
struct WrittenEntry<'a, R> {
    key: RowKey,
    row: &'a R,
}

#[derive(Deserialize)]
struct ReadEntry<R> {
    key: String,
    row: R,
}

/// Returns the line of a row, with its line break.
fn line<R: Serialize>(key: RowKey, row: &R) -> Vec<u8> {
    // Rows have only string keys and finite numbers, which can be serialised.
    let entry = serde_json::to_string(&WrittenEntry { key, row }).unwrap_or_default();
    let rest = entry.strip_prefix('{').unwrap_or_default();
    format!("{{\"check\":\"{}\",{rest}\n", check(rest.as_bytes())).into_bytes()
}

/// Returns the row of a line without its line break; none for a damaged line.
fn read_line<R: DeserializeOwned>(line: &[u8]) -> Option<(RowKey, R)> {
    let line = line.strip_prefix(b"{\"check\":\"")?;
    let (digits, rest) = line.split_at_checked(CHECK_DIGITS)?;
    let rest = rest.strip_prefix(b"\",")?;
    if check(rest).as_bytes() != digits {
        return None;
    }
    let entry: ReadEntry<R> = serde_json::from_slice(&[b"{", rest].concat()).ok()?;
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
    fn lock_ends_with_the_log() {
        let name = format!("twinrig-sweep-lock-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let open = || RowLog::<SweepRow>::open(&folder, Partition::WHOLE, &mut |_, _| {});
        let (log, _) = open().unwrap();
        let inherited = log.file.try_clone().unwrap();
        assert!(open().is_err());
        drop(log);
        let reopened = open().map(drop);
        drop(inherited);
        let _ = std::fs::remove_dir_all(&folder);
        reopened.unwrap();
    }
}
