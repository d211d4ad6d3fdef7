//! Single rows on disk.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::marker::PhantomData;
use std::path::PathBuf;

use serde::de::DeserializeOwned;

use super::log::{RowPlace, StoreError, read_line};
use super::row::RowKey;

/// Greatest number of open files of a reader: a process has some hundreds.
const OPEN_MOST: usize = 64;

/// Reads rows from where they are on disk, best in the order in which they were written. It does
/// not hold the lock of a store.
#[derive(Debug)]
pub struct RowReader<R> {
    paths: Vec<PathBuf>,
    /// Open files, each with its position.
    open: BTreeMap<u32, (BufReader<File>, u64)>,
    line: Vec<u8>,
    row: PhantomData<fn() -> R>,
}

impl<R: DeserializeOwned> RowReader<R> {
    pub(super) fn new(paths: Vec<PathBuf>) -> Self {
        Self {
            paths,
            open: BTreeMap::new(),
            line: Vec::new(),
            row: PhantomData,
        }
    }

    /// Returns the row of a key, which is at this place.
    ///
    /// # Errors
    /// [`StoreError`] if the file cannot be read, or has another line there.
    pub fn row(&mut self, key: RowKey, place: RowPlace) -> Result<R, StoreError> {
        let Some(path) = self.paths.get(place.file as usize) else {
            return Err(StoreError::Changed {
                path: PathBuf::new(),
            });
        };
        let failed = |source| StoreError::File {
            path: path.clone(),
            source,
        };
        if !self.open.contains_key(&place.file) && self.open.len() >= OPEN_MOST {
            self.open.clear();
        }
        let (reader, position) = match self.open.entry(place.file) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let file = File::open(path).map_err(failed)?;
                new.insert((BufReader::new(file), 0))
            }
        };
        // The next line is mostly in the buffer.
        let found = reader.seek_relative(place.at.cast_signed() - position.cast_signed());
        found.map_err(failed)?;
        self.line.clear();
        let length = reader.read_until(b'\n', &mut self.line);
        *position = place.at + length.map_err(failed)? as u64;
        let text = self.line.strip_suffix(b"\n");
        match text.and_then(read_line) {
            Some((found, row)) if found == key => Ok(row),
            _ => Err(StoreError::Changed { path: path.clone() }),
        }
    }
}
