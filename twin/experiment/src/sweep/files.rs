//! Files of the result of a sweep.

use std::path::{Path, PathBuf};

use twinrig_campaign::sweep::{Partition, SweepResult, effects_csv};
use twinrig_rig::error::Error as RigError;

use crate::error::Error;

/// Writes `rows.csv`, `sweep.json`, `report.html` and, of a screening, `effects.csv` into a folder;
/// returns their paths. The caller has the lock of `partition`.
pub(super) fn write(
    result: &SweepResult,
    partition: Partition,
    folder: &Path,
) -> Result<Vec<PathBuf>, Error> {
    let effects = result.elementary_effects();
    let effects = (!effects.is_empty()).then(|| ("effects.csv", effects_csv(&effects)));
    let texts = [
        ("rows.csv", result.csv()),
        ("sweep.json", format!("{:#}\n", result.json())),
        ("report.html", crate::sweep_page(result).html()),
    ];
    let written = texts.into_iter().chain(effects).map(|(name, text)| {
        let path = folder.join(name);
        replace(&path, partition, &text).map_err(|source| {
            Error::from(RigError::Write {
                path: path.clone(),
                source,
            })
        })?;
        Ok(path)
    });
    written.collect()
}

/// Writes a file completely or not at all: a reader never finds a part of it.
pub(crate) fn replace(path: &Path, partition: Partition, text: &str) -> std::io::Result<()> {
    let beside = beside(path, partition);
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&beside);
    }
    written
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
