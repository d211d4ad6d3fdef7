//! Store of rows on disk, from which an interrupted sweep continues.
//!
//! A store is a folder with a file for each partition; a process locks the file that it appends to,
//! and the system releases the lock when the process ends, in whatever way. A line is JSON: the
//! first digits of the hash of the rest, the key of the row, and the row. It is one write, so that
//! a killed process leaves whole lines and at most one torn one. A line that is torn or whose hash
//! differs is not used: its run is repeated.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::log::{DamagedLines, RowLog, RowPlace, StoreError};
use super::partition::Partition;
use super::reader::RowReader;
use super::row::{RowKey, SweepRow};

/// An open store: rows `R` on disk, and of each a value `T` in memory.
pub struct RowStore<T, R = SweepRow> {
    /// None: the store is in memory alone.
    log: Option<RowLog<R>>,
    kept: KeptValues<T, R>,
    warnings: Vec<String>,
}

/// A value with the place of its row; none of a row in memory alone.
type Kept<T> = (T, Option<RowPlace>);

/// Values of the rows.
struct KeptValues<T, R> {
    value: Box<dyn FnMut(R) -> T>,
    /// By key; none for a wanted row that is missing.
    values: BTreeMap<RowKey, Option<Kept<T>>>,
    /// Whether rows of further keys are kept, too.
    all: bool,
}

impl<T, R> KeptValues<T, R> {
    fn keep(&mut self, key: RowKey, row: R, place: RowPlace) {
        let Self { value, values, all } = self;
        let missing = match values.get_mut(&key) {
            None if *all => values.entry(key).or_default(),
            Some(missing @ None) => missing,
            _ => return,
        };
        *missing = Some((value(row), Some(place)));
    }

    fn are_complete(&self) -> bool {
        !self.all && self.values.values().all(Option::is_some)
    }
}

impl<T, R: Serialize + DeserializeOwned> RowStore<T, R> {
    /// Opens the store in `folder`, which it creates, to append the rows of a partition. Reads the
    /// rows of all partitions with a `wanted` key, of all keys if there is no list of them, and
    /// keeps the value of each.
    ///
    /// # Errors
    /// [`StoreError`] if another process appends to the same partition, or a file cannot be used.
    pub fn open(
        folder: &Path,
        partition: Partition,
        wanted: Option<Vec<RowKey>>,
        value: impl FnMut(R) -> T + 'static,
    ) -> Result<Self, StoreError> {
        let mut store = Self::in_memory(value);
        let kept = &mut store.kept;
        kept.all = wanted.is_none();
        kept.values = wanted
            .into_iter()
            .flatten()
            .map(|key| (key, None))
            .collect();
        let opened = RowLog::open(folder, partition, &mut |key, row, place| {
            kept.keep(key, row, place);
        });
        let (log, opened) = opened?;
        store.log = Some(log);
        store.warnings = opened.torn.iter().map(ToString::to_string).collect();
        store.read_others()?;
        store.warn_of_rows(opened.damaged);
        Ok(store)
    }

    /// Returns an empty store without files, for rows of any key.
    pub fn in_memory(value: impl FnMut(R) -> T + 'static) -> Self {
        Self {
            log: None,
            kept: KeptValues {
                value: Box::new(value),
                values: BTreeMap::new(),
                all: true,
            },
            warnings: Vec::new(),
        }
    }

    /// Reads the files of the other partitions as far as they have grown.
    ///
    /// # Errors
    /// [`StoreError`] if a file cannot be read.
    pub fn read_others(&mut self) -> Result<(), StoreError> {
        let Self { log, kept, .. } = self;
        if let Some(log) = log {
            let damaged = log.read_others(&mut |key, row, place| kept.keep(key, row, place))?;
            self.warn_of_rows(damaged);
        }
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

    /// Returns the value of the row of a key.
    pub fn get(&self, key: &RowKey) -> Option<&T> {
        self.kept.values.get(key)?.as_ref().map(|(value, _)| value)
    }

    /// Returns where the row of a key is on disk.
    pub fn place(&self, key: &RowKey) -> Option<RowPlace> {
        self.kept.values.get(key)?.as_ref()?.1
    }

    /// Returns the row of a key, read from disk; none if it is not there.
    ///
    /// # Errors
    /// [`StoreError`] if the file cannot be read.
    pub fn row(&self, key: RowKey) -> Result<Option<R>, StoreError> {
        let place = self.place(&key);
        place.map(|place| self.reader().row(key, place)).transpose()
    }

    /// Returns a reader of single rows.
    pub fn reader(&self) -> RowReader<R> {
        RowReader::new(self.log.as_ref().map_or_else(Vec::new, RowLog::paths))
    }

    /// Returns messages about lines that are not used.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Appends a row, which survives the end of the process from then on; returns its value.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be written.
    pub fn append(&mut self, key: RowKey, row: R) -> Result<&T, StoreError> {
        let log = self.log.as_mut();
        let place = log.map(|log| log.append(key, &row)).transpose()?;
        let KeptValues { value, values, .. } = &mut self.kept;
        let kept = values.entry(key).or_default();
        let (value, _) = kept.insert((value(row), place));
        Ok(value)
    }
}

impl<T, R> fmt::Debug for RowStore<T, R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("RowStore");
        shown.field("warnings", &self.warnings);
        shown.finish_non_exhaustive()
    }
}
