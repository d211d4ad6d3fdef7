//! Log of rows on disk: one file to append to, and those of other processes beside it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::partition::Partition;
use super::row::RowKey;

/// Error of a store.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Another process appends to the file.
    #[error(
        "another process is writing {}\n  = help: wait for its end, or choose another folder by --out; processes share runs by --partition i/n, but not measurements of run times",
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
    /// A row that was complete is so no longer.
    #[error(
        "{} has been changed meanwhile\n  = help: the same command repeats the runs whose rows are lost",
        path.display()
    )]
    Changed {
        /// The file.
        path: PathBuf,
    },
}

/// Ending of the files of a store.
const ENDING: &str = "jsonl";
/// Hexadecimal digits of the hash of a line: 64 bits, against accidents.
const CHECK_DIGITS: usize = 16;

/// Place of a row on disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowPlace {
    /// Number of the file in its log.
    pub(super) file: u32,
    /// Byte at which the line begins.
    pub(super) at: u64,
}

/// A log of rows of one type that is open to be appended to. It keeps no rows in memory.
#[derive(Debug)]
pub(super) struct RowLog<R> {
    folder: PathBuf,
    /// Locked until the log is dropped.
    file: File,
    /// The file that is appended to, and then those of other partitions.
    files: Vec<LogFile>,
    row: PhantomData<fn(&R) -> R>,
}

/// A file of a log, as far as it has been read.
#[derive(Debug)]
struct LogFile {
    path: PathBuf,
    /// Length of its complete lines.
    complete: u64,
    /// Damaged ones among them.
    damaged: usize,
}

impl LogFile {
    fn of(path: PathBuf) -> Self {
        Self {
            path,
            complete: 0,
            damaged: 0,
        }
    }

    fn failed(&self, source: std::io::Error) -> StoreError {
        StoreError::File {
            path: self.path.clone(),
            source,
        }
    }

    fn damaged(&self) -> Option<DamagedLines> {
        (self.damaged > 0).then(|| self.lines(self.damaged))
    }

    fn lines(&self, count: usize) -> DamagedLines {
        DamagedLines {
            path: self.path.clone(),
            count,
        }
    }

    /// Reads the complete lines that are new, and passes the byte at which each begins, its key and
    /// its row to `visit`.
    fn read<R: DeserializeOwned>(
        &mut self,
        visit: &mut dyn FnMut(u64, RowKey, R),
    ) -> Result<(), StoreError> {
        let mut file = File::open(&self.path).map_err(|source| self.failed(source))?;
        let found = file.seek(SeekFrom::Start(self.complete));
        found.map_err(|source| self.failed(source))?;
        let mut reader = BufReader::new(file);
        let mut line = Vec::new();
        loop {
            line.clear();
            let length = reader.read_until(b'\n', &mut line);
            let length = length.map_err(|source| self.failed(source))?;
            // The last line of another process may still be incomplete.
            let Some((b'\n', text)) = line.split_last() else {
                return Ok(());
            };
            match read_line(text) {
                Some((key, row)) => visit(self.complete, key, row),
                None => self.damaged += 1,
            }
            self.complete += length as u64;
        }
    }
}

/// Lines of a file that were not used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DamagedLines {
    /// The file.
    pub(super) path: PathBuf,
    /// Number of lines.
    pub(super) count: usize,
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
    pub(super) fn open(
        folder: &Path,
        partition: Partition,
        visit: &mut dyn FnMut(RowKey, R, RowPlace),
    ) -> Result<(Self, OpenedLog), StoreError> {
        let path = folder.join(format!("{}.{ENDING}", partition.file_stem()));
        let mut own = LogFile::of(path);
        let made = std::fs::create_dir_all(folder);
        made.map_err(|source| own.failed(source))?;
        let mut options = OpenOptions::new();
        let file = options.read(true).append(true).create(true).open(&own.path);
        let file = file.map_err(|source| own.failed(source))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(StoreError::Locked { path: own.path }),
            Err(TryLockError::Error(source)) => return Err(own.failed(source)),
        }
        own.read(&mut |at, key, row| visit(key, row, RowPlace { file: 0, at }))?;
        // A line that a killed process left is not continued by the next one.
        let length = file.metadata().map_err(|source| own.failed(source))?.len();
        let is_torn = own.complete < length;
        if is_torn {
            let cut = file.set_len(own.complete);
            cut.map_err(|source| own.failed(source))?;
        }
        let opened = OpenedLog {
            torn: is_torn.then(|| own.lines(1)),
            damaged: own.damaged(),
        };
        let log = Self {
            folder: folder.to_owned(),
            file,
            files: vec![own],
            row: PhantomData,
        };
        Ok((log, opened))
    }

    /// Passes the rows of the other partitions that are new to `visit`; returns the damaged lines
    /// of these files.
    ///
    /// # Errors
    /// [`StoreError`] if a file cannot be read.
    pub(super) fn read_others(
        &mut self,
        visit: &mut dyn FnMut(RowKey, R, RowPlace),
    ) -> Result<Vec<DamagedLines>, StoreError> {
        let failed = |source| StoreError::File {
            path: self.folder.clone(),
            source,
        };
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(&self.folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let is_known = self.files.iter().any(|file| file.path == path);
            if path.extension().is_some_and(|ending| ending == ENDING) && !is_known {
                paths.push(path);
            }
        }
        // Folders have no order.
        paths.sort();
        self.files.extend(paths.into_iter().map(LogFile::of));
        let others = (0..).zip(&mut self.files).skip(1);
        let mut damaged = Vec::new();
        for (file, other) in others {
            other.read(&mut |at, key, row| visit(key, row, RowPlace { file, at }))?;
            damaged.extend(other.damaged());
        }
        Ok(damaged)
    }

    /// Appends a row, which survives the end of the process from then on.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be written.
    pub(super) fn append(&mut self, key: RowKey, row: &R) -> Result<RowPlace, StoreError> {
        let own = &mut self.files[0];
        let line = line(key, row);
        let written = self.file.write_all(&line);
        written.map_err(|source| own.failed(source))?;
        let at = own.complete;
        own.complete += line.len() as u64;
        Ok(RowPlace { file: 0, at })
    }

    /// Returns the files, by the numbers of the places.
    pub(super) fn paths(&self) -> Vec<PathBuf> {
        self.files.iter().map(|file| file.path.clone()).collect()
    }
}

/// Lines that were not used when a log was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct OpenedLog {
    /// An incomplete last line, which has been removed.
    pub(super) torn: Option<DamagedLines>,
    /// Other damaged lines, which remain.
    pub(super) damaged: Option<DamagedLines>,
}

impl<R> Drop for RowLog<R> {
    fn drop(&mut self) {
        // A process that was forked meanwhile has the same open file, and with it the lock.
        // Without success, the lock ends with the last of them.
        let _ = self.file.unlock();
    }
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
pub(super) fn read_line<R: DeserializeOwned>(line: &[u8]) -> Option<(RowKey, R)> {
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
    use crate::sweep::row::SweepRow;

    /// As by a fork: another descriptor of the same open file.
    #[test]
    fn lock_ends_with_the_log() {
        let name = format!("twinrig-sweep-lock-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let open = || RowLog::<SweepRow>::open(&folder, Partition::WHOLE, &mut |_, _, _| {});
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
