//! Store of the measured parts of a study.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use twinrig_campaign::sweep::{Partition, RowKey, RowLog};
use twinrig_scenario::Setting;

use super::Measured;
use super::starts::{Start, Starts};
use crate::error::{Error, StudyError};
use crate::machine::Machine;
use crate::options::request::{StudyContext, StudyFrame};
use crate::runs::scene::RunScene;

/// Name of the folder of the rows, beside the files of the study.
const FOLDER: &str = "parts";

/// Row of the log.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum PartRow {
    /// A start of the program that measured a part, with the load of the machine.
    Start(Option<f64>),
    /// A part.
    Part {
        /// Number of the start.
        start: usize,
        /// Time spent on it \[s\].
        spent_s: f64,
        /// Result; none if the budget cut it.
        result: Option<Value>,
    },
}

/// What is known of a part.
#[derive(Debug, Default)]
struct KnownPart {
    spent_s: f64,
    start: usize,
    result: Option<Value>,
}

/// Rows on disk, and the parts that they have.
struct KnownParts {
    parts: BTreeMap<RowKey, KnownPart>,
    loads: Vec<Option<f64>>,
}

impl KnownParts {
    fn add(&mut self, key: RowKey, row: PartRow) {
        match row {
            PartRow::Start(load) => self.loads.push(load),
            PartRow::Part {
                start,
                spent_s,
                result,
            } => {
                let known = self.parts.entry(key).or_default();
                known.spent_s += spent_s;
                if result.is_some() {
                    (known.start, known.result) = (start, result);
                }
            }
        }
    }
}

/// Store of the measured parts of a study, on this machine by this build.
pub struct PartStore {
    log: RowLog<PartRow>,
    known: KnownParts,
    /// Hash of everything that all parts depend on.
    study: RowKey,
    /// Load at this start.
    load: Option<f64>,
    /// Number of this start, once it has measured a part.
    this: Option<usize>,
    /// Starts whose results are used.
    used: BTreeSet<usize>,
    /// Number of parts of earlier starts.
    reused: usize,
    folder: PathBuf,
    notes: Vec<String>,
}

impl PartStore {
    /// Opens the store of a study of a scenario with these settings, beside its files.
    ///
    /// # Errors
    /// Errors of the scenario and of the store.
    pub(crate) fn of_study(
        context: &StudyContext<'_>,
        frame: &StudyFrame<'_>,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let scenario = &frame.scenarios[0];
        let (scene, _) = RunScene::read(context.registry, scenario, settings, None)?;
        let build = context.registry.build()?;
        let contents = scene.contents();
        let parts = [build.as_bytes(), frame.name.as_bytes(), &contents];
        let folder = frame.out.join(frame.stem()).join(FOLDER);
        Self::open(&folder, &parts, context.machine)
    }

    /// Opens the store in a folder, of a study that depends on `parts`: program, files
    /// and settings.
    ///
    /// # Errors
    /// Errors of the store.
    pub fn open(folder: &Path, parts: &[&[u8]], machine: &Machine) -> Result<Self, Error> {
        // Run times of another machine are other run times; its load is that of a start.
        let unloaded = Machine {
            load: None,
            ..machine.clone()
        };
        let hardware = format!("{unloaded:?}");
        let parts = parts.iter().copied();
        let study = RowKey::of(parts.chain([hardware.as_bytes()]));
        let mut known = KnownParts {
            parts: BTreeMap::new(),
            loads: Vec::new(),
        };
        let add = &mut |key, row| known.add(key, row);
        let (log, opened) = RowLog::open(folder, Partition::WHOLE, add)?;
        let notes = opened.torn.iter().chain(&opened.damaged);
        Ok(Self {
            notes: notes.map(ToString::to_string).collect(),
            log,
            known,
            study,
            load: machine.load,
            this: None,
            used: BTreeSet::new(),
            reused: 0,
            folder: folder.to_owned(),
        })
    }

    /// Returns the key of a part.
    pub(super) fn key(&self, scope: &str, content: &dyn Debug) -> RowKey {
        let (study, content) = (self.study.to_string(), format!("{content:?}"));
        RowKey::of([study.as_bytes(), scope.as_bytes(), content.as_bytes()])
    }

    /// Returns the time that all starts have spent on a part \[s\].
    pub(super) fn spent_s(&self, key: RowKey) -> f64 {
        self.known.parts.get(&key).map_or(0.0, |part| part.spent_s)
    }

    /// Returns the result of a part, if it is kept.
    pub(super) fn find<T: Measured>(&mut self, key: RowKey) -> Option<T> {
        let known = self.known.parts.get(&key)?;
        let found = T::deserialize(known.result.as_ref()?).ok()?;
        self.used.insert(known.start);
        self.reused += 1;
        Some(found)
    }

    /// Returns the number of this start.
    pub(super) fn this_start(&mut self) -> Result<usize, StudyError> {
        if let Some(this) = self.this {
            return Ok(this);
        }
        let number = self.known.loads.len() + 1;
        self.append(
            RowKey::of([number.to_string().as_bytes()]),
            PartRow::Start(self.load),
        )?;
        self.used.insert(number);
        Ok(*self.this.insert(number))
    }

    /// Keeps the result of a part, or only the time if the budget cut it.
    pub(super) fn keep<T: Measured>(
        &mut self,
        key: RowKey,
        spent_s: f64,
        result: Option<&T>,
    ) -> Result<(), StudyError> {
        let start = self.this_start()?;
        // JSON has no infinite numbers: what cannot be read again is not kept.
        let result = result.and_then(|result| serde_json::to_value(result).ok());
        let result = result.filter(|value| T::deserialize(value).is_ok());
        let row = PartRow::Part {
            start,
            spent_s,
            result,
        };
        self.append(key, row)
    }

    fn append(&mut self, key: RowKey, row: PartRow) -> Result<(), StudyError> {
        let appended = self.log.append(key, &row);
        appended.map_err(|error| StudyError::Store(error.to_string()))?;
        self.known.add(key, row);
        Ok(())
    }

    /// Returns the starts whose results are used.
    pub(super) fn starts(&self) -> Starts {
        let start = |&start: &usize| Start {
            start,
            load: self.known.loads.get(start - 1).copied().flatten(),
        };
        let reused = (self.reused > 0).then(|| {
            let (parts, folder) = (self.reused, self.folder.display());
            format!("{parts} parts are of earlier starts; without {folder}, all are measured again")
        });
        Starts {
            starts: self.used.iter().map(start).collect(),
            notes: self.notes.iter().cloned().chain(reused).collect(),
        }
    }
}
