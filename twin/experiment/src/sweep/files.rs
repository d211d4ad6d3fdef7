//! Files of the result of a sweep.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use twinrig_campaign::sweep::{Partition, ResultRow, SweepResult, effects_csv};
use twinrig_rig::error::Error as RigError;

use super::rows::SweepRows;
use crate::error::Error;

/// Writes `rows.csv`, `sweep.json`, `report.html` and, of a screening, `effects.csv` into a folder;
/// returns their paths. The caller has the lock of `partition`.
pub(super) fn write(
    result: &SweepResult,
    rows: &mut SweepRows,
    partition: Partition,
    folder: &Path,
) -> Result<Vec<PathBuf>, Error> {
    let new = |name: &str| NewFile::create(folder.join(name), partition);
    let (mut csv, mut json) = (new("rows.csv")?, new("sweep.json")?);
    write_rows(result, rows, &mut csv, &mut json)?;
    let mut written = vec![csv.finish()?, json.finish()?];
    let effects = result.elementary_effects();
    let effects = (!effects.is_empty()).then(|| ("effects.csv", effects_csv(&effects)));
    let page = ("report.html", crate::sweep_page(result).html());
    for (name, text) in std::iter::once(page).chain(effects) {
        written.push(replace(folder.join(name), partition, &text)?);
    }
    Ok(written)
}

/// Writes the table and the result for programs, for which each row is read once.
fn write_rows(
    result: &SweepResult,
    rows: &mut SweepRows,
    csv: &mut NewFile,
    json: &mut NewFile,
) -> Result<(), Error> {
    let table = result.table();
    csv.write(&table.header())?;
    let mut read = |row: &ResultRow| {
        let complete = rows.read(result, row)?;
        csv.write(&table.line(row, &complete.row))?;
        Ok(complete)
    };
    let with_rows = result.json(&mut read);
    let written = serde_json::to_writer_pretty(&mut json.out, &with_rows);
    if let Some(error) = with_rows.failed() {
        return Err(error);
    }
    written.map_err(|error| json.failed(error.into()))?;
    json.write("\n")
}

/// Writes a file completely or not at all; returns its path.
pub(crate) fn replace(path: PathBuf, partition: Partition, text: &str) -> Result<PathBuf, Error> {
    let mut file = NewFile::create(path, partition)?;
    file.write(text)?;
    file.finish()
}

/// A file that is written completely or not at all: a reader never finds a part of it.
struct NewFile {
    path: PathBuf,
    beside: PathBuf,
    out: BufWriter<File>,
}

impl NewFile {
    fn create(path: PathBuf, partition: Partition) -> Result<Self, Error> {
        let beside = beside(&path, partition);
        match File::create(&beside) {
            Ok(file) => Ok(Self {
                path,
                beside,
                out: BufWriter::new(file),
            }),
            Err(source) => Err(RigError::Write { path, source }.into()),
        }
    }

    fn write(&mut self, text: &str) -> Result<(), Error> {
        let written = self.out.write_all(text.as_bytes());
        written.map_err(|source| self.failed(source))
    }

    /// Puts the file into its place; returns its path.
    fn finish(mut self) -> Result<PathBuf, Error> {
        let flushed = self.out.flush();
        let moved = flushed.and_then(|()| std::fs::rename(&self.beside, &self.path));
        match moved {
            Ok(()) => Ok(self.path.clone()),
            Err(source) => Err(self.failed(source)),
        }
    }

    fn failed(&self, source: std::io::Error) -> Error {
        let path = self.path.clone();
        RigError::Write { path, source }.into()
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        // It is there after an error, which is the one to report.
        let _ = std::fs::remove_file(&self.beside);
    }
}

/// Returns a name that nothing else writes to: sweeps into one folder, of which a process may run
/// several, have different partitions.
fn beside(path: &Path, Partition { part, of }: Partition) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}-{part}-of-{of}", std::process::id()));
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partitions_of_a_process_have_temporary_files_of_their_own() {
        let name = |part, of| beside(Path::new("rows.csv"), Partition { part, of });
        assert_ne!(name(1, 2), name(2, 2));
        assert_ne!(name(1, 2), name(1, 3));
    }
}
