//! Resources of an FMU: the files that a recording keeps for its replay, and a manifest.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use twinrig_scenario::Setting;

use crate::assembly::Assembly;
use crate::assembly::sources::{ROBOT_FILE, SCENARIO_FILE};
use crate::error::Error;
use crate::fmu::error::FmuError;
use crate::fmu::part::FmuPart;
use crate::registry::Registry;
use crate::run::recording::{kept_files, pairs, settings_of};

/// The file that describes the others.
pub(crate) const MANIFEST: &str = "twinrig.json";
/// Version of this program.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Maximum size of one file: more than any scenario, robot or model.
const FILE_BYTES_MAX: u64 = 256 << 20;

/// Contents of the manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Manifest {
    version: String,
    part: FmuPart,
    settings: Vec<[String; 2]>,
    files: Vec<String>,
}

/// The resources of an FMU, in memory.
#[derive(Clone, Debug)]
pub(crate) struct Resources {
    manifest: Manifest,
    files: Vec<(String, Vec<u8>)>,
}

impl Resources {
    /// Returns the resources of a part of a scenario.
    pub(crate) fn of(assembly: &Assembly<'_>, part: FmuPart) -> Self {
        let files = kept_files(assembly);
        let manifest = Manifest {
            version: VERSION.to_owned(),
            part,
            settings: pairs(&assembly.scenario().settings),
            files: files.iter().map(|(name, _)| name.clone()).collect(),
        };
        Self { manifest, files }
    }

    /// Reads the resources in a folder.
    pub(crate) fn read(folder: &Path) -> Result<Self, FmuError> {
        let path = folder.join(MANIFEST);
        let no_manifest = |why: String| FmuError::Manifest {
            path: path.clone(),
            why,
        };
        let text = read_file(&path)?;
        let manifest: Manifest = serde_json::from_slice(&text)
            .map_err(|error| no_manifest(format!("it cannot be parsed: {error}")))?;
        if manifest.version != VERSION {
            return Err(FmuError::Version {
                exported: manifest.version,
                library: VERSION,
            });
        }
        let read = |name: &String| {
            // Names of files in the folder, and of no others.
            let is_plain = Path::new(name).file_name() == Some(name.as_ref());
            if !is_plain {
                return Err(no_manifest(format!("`{name}` is no name of a file")));
            }
            Ok((name.clone(), read_file(&folder.join(name))?))
        };
        let files = manifest.files.iter().map(read);
        let files = files.collect::<Result<_, _>>()?;
        Ok(Self { manifest, files })
    }

    /// Returns all files by name, the manifest first.
    pub(crate) fn files(&self) -> Vec<(&str, Vec<u8>)> {
        let mut manifest = serde_json::to_vec_pretty(&self.manifest).unwrap_or_default();
        manifest.push(b'\n');
        let files = self.files.iter();
        let files = files.map(|(name, bytes)| (name.as_str(), bytes.clone()));
        [(MANIFEST, manifest)].into_iter().chain(files).collect()
    }

    pub(crate) fn part(&self) -> FmuPart {
        self.manifest.part
    }

    /// Returns a hash of all resources.
    pub(crate) fn key(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for (name, bytes) in self.files() {
            for part in [name.as_bytes(), &bytes] {
                hasher.update(&(part.len() as u64).to_le_bytes());
                hasher.update(part);
            }
        }
        *hasher.finalize().as_bytes()
    }

    /// Returns the token that model description and instance must agree on: the first half of
    /// [`Resources::key`], written as tools expect it.
    pub(crate) fn token(&self) -> String {
        let mut token = String::from("{");
        for (n, byte) in self.key().iter().take(16).enumerate() {
            if [4, 6, 8, 10].contains(&n) {
                token.push('-');
            }
            // Writing to a string cannot fail.
            let _ = write!(token, "{byte:02x}");
        }
        token.push('}');
        token
    }

    /// Checks the token of the model description.
    pub(crate) fn check_token(&self, given: &str) -> Result<(), FmuError> {
        let expected = self.token();
        if given == expected {
            return Ok(());
        }
        let given = given.to_owned();
        Err(FmuError::Token { given, expected })
    }

    /// Builds the scenario.
    pub(crate) fn assembly<'r>(&self, registry: &'r Registry) -> Result<Assembly<'r>, Error> {
        let text = |name: &str| {
            let file = self.files.iter().find(|(known, _)| known == name);
            file.map(|(_, bytes)| String::from_utf8_lossy(bytes).into_owned())
        };
        let settings: Vec<Setting> = settings_of(self.manifest.settings.clone());
        let builder = Assembly::builder(registry).settings(&settings);
        let builder = builder.files(self.files.clone());
        let builder = match text(ROBOT_FILE) {
            Some(robot) => builder.robot(robot),
            None => builder,
        };
        builder.recorded(&text(SCENARIO_FILE).unwrap_or_default())
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, FmuError> {
    let failed = |source: std::io::Error| FmuError::Read {
        path: PathBuf::from(path),
        source,
    };
    let length = std::fs::metadata(path).map_err(failed)?.len();
    if length > FILE_BYTES_MAX {
        let why = format!("it has {length} bytes, more than the {FILE_BYTES_MAX} of a resource");
        return Err(failed(std::io::Error::other(why)));
    }
    std::fs::read(path).map_err(failed)
}
