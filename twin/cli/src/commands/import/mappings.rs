//! Mappings of logs, by path or by name.

use std::path::Path;

use twinrig_document::{Library, suggestion};
use twinrig_record::LogMapping;
use twinrig_rig::error::Error;

use crate::error::TwinError;

/// Mappings that every build contains.
const MAPPINGS: Library = Library {
    folder: "mappings",
    embedded: &[
        (
            "servo-bench-sts",
            include_str!("../../../files/mappings/servo-bench-sts.toml"),
        ),
        (
            "servo-bench-xl330",
            include_str!("../../../files/mappings/servo-bench-xl330.toml"),
        ),
    ],
};

/// Returns the mapping of this name, or at this path.
pub(super) fn find(name: Option<&str>) -> Result<LogMapping, TwinError> {
    let here = Path::new("");
    let Some(name) = name else {
        let known = MAPPINGS.names(here).join(", ");
        return Err(TwinError::from(Error::InvalidOptions {
            why: "there is no mapping".to_owned(),
            help: format!("give a file or a name with --mapping; known are {known}"),
        }));
    };
    let Some(document) = MAPPINGS.find(name, here)? else {
        let names = MAPPINGS.names(here);
        let names = names.iter().map(String::as_str);
        return Err(TwinError::from(Error::InvalidOptions {
            why: format!("there is no mapping `{name}`"),
            help: suggestion(name, "known mappings", names),
        }));
    };
    Ok(LogMapping::read(&document)?)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;

    use super::*;

    /// The files are links into the folder of the repository.
    #[test]
    fn embedded_mappings_are_those_of_the_repository() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../mappings");
        let paths = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path());
        let stored: BTreeMap<String, String> = paths
            .filter(|path| {
                path.extension()
                    .is_some_and(|extension| extension == "toml")
            })
            .map(|path| {
                let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
                (name, fs::read_to_string(path).unwrap())
            })
            .collect();
        let pair = |(name, text): &(&str, &str)| ((*name).to_owned(), (*text).to_owned());
        assert_eq!(
            MAPPINGS
                .embedded
                .iter()
                .map(pair)
                .collect::<BTreeMap<_, _>>(),
            stored
        );
        for (name, _) in MAPPINGS.embedded {
            find(Some(name)).unwrap();
        }
    }
}
