//! Files of a session: numbered after those of earlier ones, which stay.

use std::path::{Path, PathBuf};

use twinrig_rig::Assembly;

use crate::branch::Branch;
use crate::sets::write_whole;

/// Names of the files `STEM-NUMBER.EXTENSION` in a folder.
pub(crate) struct Files {
    folder: PathBuf,
    stem: String,
    /// First number of this session.
    first: usize,
}

impl Files {
    pub(crate) fn new(assembly: &Assembly<'_>, folder: &Path) -> Self {
        let file = Path::new(&assembly.scenario().file);
        let stem = file.file_stem().unwrap_or_default();
        let stem = stem.to_string_lossy().into_owned();
        Self {
            first: first_free(folder, &stem),
            folder: folder.to_owned(),
            stem,
        }
    }

    /// Returns the path of a scenario, by its number in the session.
    pub(crate) fn scenario(&self, number: usize) -> PathBuf {
        self.path(number, "toml")
    }

    /// Returns the path of the recording of a session on hardware.
    #[cfg(feature = "server")]
    pub(crate) fn recording(&self) -> PathBuf {
        self.path(0, "mcap")
    }

    fn path(&self, number: usize, extension: &str) -> PathBuf {
        let number = self.first.saturating_add(number);
        let name = format!("{}-{number}.{extension}", self.stem);
        self.folder.join(name)
    }

    /// Writes the scenario of a branch.
    pub(crate) fn write(
        &self,
        number: usize,
        branch: &Branch,
        assembly: &Assembly<'_>,
        variables: &[(String, twinrig_kernel::Unit)],
    ) -> Result<PathBuf, String> {
        let path = self.scenario(number);
        let text = branch.text(assembly, variables, &self.folder);
        let text = text.map_err(|error| error.to_string())?;
        let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
        std::fs::create_dir_all(&self.folder).map_err(failed)?;
        write_whole(&path, &text).map_err(failed)?;
        Ok(path)
    }
}

/// Returns the first number after those of the files of a stem.
fn first_free(folder: &Path, stem: &str) -> usize {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let number = |file: std::fs::DirEntry| {
        let name = file.file_name().into_string().ok()?;
        let rest = name.strip_prefix(stem)?.strip_prefix('-')?;
        let (number, extension) = rest.split_once('.')?;
        let is_ours = ["toml", "mcap"].contains(&extension);
        number.parse::<usize>().ok().filter(|_| is_ours)
    };
    let last = files.filter_map(number).max();
    last.map_or(0, |last| last.saturating_add(1))
}
