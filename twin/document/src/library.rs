//! Documents of one folder, found by name.

use std::path::{Path, PathBuf};

use crate::document::Document;
use crate::error::DocumentError;

/// Documents of one folder, such as `robots`, with copies embedded in every build, so that an
/// installed program works in an empty folder.
#[derive(Clone, Copy, Debug)]
pub struct Library {
    /// Name of the folder.
    pub folder: &'static str,
    /// Names and texts of the embedded documents.
    pub embedded: &'static [(&'static str, &'static str)],
}

impl Library {
    /// Reads the document `name`, for a scenario in the folder `beside`; `None` if there is none.
    /// The first of these that exists:
    ///
    /// 1. if `name` is a path (contains `/` or ends in `.toml`): that file, relative to `beside`,
    ///    and no other;
    /// 2. `FOLDER/NAME.toml` in `beside` or in the nearest of its ancestor folders;
    /// 3. the embedded copy.
    ///
    /// The values of overlays that it includes are in place of its own
    /// ([`Document::with_overlays`]).
    ///
    /// The current directory has no influence, so that a run does not depend on where it is
    /// started; a relative `beside` is made absolute before its ancestors are searched.
    ///
    /// # Errors
    /// If the document cannot be read or is not TOML.
    pub fn find(&self, name: &str, beside: &Path) -> Result<Option<Document>, DocumentError> {
        if is_path(name) {
            return read(&beside.join(name)).map(Some);
        }
        let file = format!("{name}.toml");
        let mut paths = self.folders(beside).map(|folder| folder.join(&file));
        if let Some(path) = paths.find(|path| path.is_file()) {
            return read(&path).map(Some);
        }
        self.find_embedded(name)
    }

    /// Returns the embedded copy of the document `name`; `None` if there is none.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn find_embedded(&self, name: &str) -> Result<Option<Document>, DocumentError> {
        let mut embedded = self.embedded.iter();
        let found = embedded.find(|(known, _)| *known == name);
        let parse = |(_, text): &(&str, &str)| {
            Document::parse(&format!("{}/{name}.toml", self.folder), text)
        };
        found.map(parse).transpose()
    }

    /// Returns the names that [`Library::find`] finds from `beside`, sorted.
    pub fn names(&self, beside: &Path) -> Vec<String> {
        let mut names = self.embedded_names();
        for folder in self.folders(beside) {
            let Ok(entries) = std::fs::read_dir(folder) else {
                continue;
            };
            for path in entries.flatten().map(|entry| entry.path()) {
                let stem = path.file_stem().and_then(|stem| stem.to_str());
                if let (Some(stem), true) = (stem, path.extension().is_some_and(|e| e == "toml")) {
                    names.push(stem.to_owned());
                }
            }
        }
        names.sort();
        names.dedup();
        names
    }

    /// Returns the names of the embedded documents.
    pub(crate) fn embedded_names(&self) -> Vec<String> {
        let names = self.embedded.iter().map(|(name, _)| (*name).to_owned());
        names.collect()
    }

    fn folders(&self, beside: &Path) -> impl Iterator<Item = PathBuf> {
        let absolute = std::path::absolute(beside).unwrap_or_else(|_| beside.to_owned());
        let folders: Vec<_> = absolute
            .ancestors()
            .map(|folder| folder.join(self.folder))
            .collect();
        folders.into_iter()
    }
}

/// Reads a file with its overlays.
fn read(path: &Path) -> Result<Document, DocumentError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut document = Document::read(path)?.with_overlays(folder)?;
    document.folder = Some(folder.to_owned());
    Ok(document)
}

pub(crate) fn is_path(name: &str) -> bool {
    let path = Path::new(name);
    let extension = path.extension();
    name.contains(['/', '\\']) || extension.is_some_and(|extension| extension == "toml")
}
