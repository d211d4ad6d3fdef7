//! Store of rows on disk, from which an interrupted sweep continues.
//!
//! A store is a folder with a file for each partition; a process locks the file that it appends to,
//! and the system releases the lock when the process ends, in whatever way. A line is JSON: the
//! first digits of the hash of the rest, the key of the row, and the row. It is one write, so that
//! a killed process leaves whole lines and at most one torn one. A line that is torn or whose hash
//! differs is not used: its run is repeated.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::log::{DamagedLines, RowLog, StoreError};
use super::partition::Partition;
use super::row::{RowKey, SweepRow};

/// An open store: a log, with the rows of a sweep in memory.
#[derive(Debug)]
pub struct RowStore {
    log: RowLog,
    kept: KeptRows,
    warnings: Vec<String>,
}

/// Rows of a sweep; those of other sweeps are not kept.
#[derive(Debug)]
struct KeptRows {
    wanted: BTreeSet<RowKey>,
    rows: BTreeMap<RowKey, SweepRow>,
}

impl KeptRows {
    fn keep(&mut self, key: RowKey, row: SweepRow) {
        if self.wanted.contains(&key) {
            self.rows.entry(key).or_insert(row);
        }
    }

    fn are_complete(&self) -> bool {
        let mut keys = self.wanted.iter();
        keys.all(|key| self.rows.contains_key(key))
    }
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
        let mut kept = KeptRows {
            wanted,
            rows: BTreeMap::new(),
        };
        let opened = RowLog::open(folder, partition, &mut |key, row| kept.keep(key, row));
        let (log, opened) = opened?;
        let mut store = Self {
            log,
            kept,
            warnings: opened.torn.iter().map(ToString::to_string).collect(),
        };
        store.read_others()?;
        store.warn_of_rows(opened.damaged);
        Ok(store)
    }

    /// Reads the files of the other partitions, which may have grown.
    ///
    /// # Errors
    /// [`StoreError`] if a file cannot be read.
    pub fn read_others(&mut self) -> Result<(), StoreError> {
        let kept = &mut self.kept;
        let damaged = self.log.read_others(&mut |key, row| kept.keep(key, row))?;
        self.warn_of_rows(damaged);
        Ok(())
    }

    /// Reports damaged lines, unless their runs have been repeated: they stay in the file.
    fn warn_of_rows(&mut self, damaged: impl IntoIterator<Item = DamagedLines>) {
        if self.kept.are_complete() {
            return;
        }
        for lines in damaged {
            let warning = lines.to_string();
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
    }

    /// Returns the row of a key.
    pub fn get(&self, key: &RowKey) -> Option<&SweepRow> {
        self.kept.rows.get(key)
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
        self.log.append(key, &row)?;
        self.kept.rows.insert(key, row);
        Ok(())
    }
}
