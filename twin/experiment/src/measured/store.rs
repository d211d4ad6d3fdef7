//! Store of the measured parts of a study.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use twinrig_campaign::sweep::{Partition, RowKey, RowStore};
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
        /// Time spent on it \[s\].
        spent_s: f64,
        /// Result; none if the budget cut it.
        result: Option<Value>,
    },
}

/// Store of the measured parts of a study, on this machine by this build.
pub struct PartStore {
    /// Rows of starts, and those of parts by the start that measured them.
    rows: RowStore<PartRow, PartRow>,
    /// Number of the starts so far.
    starts: usize,
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

    /// Opens the store in a folder, of a study that depends on `parts`: program, files and
    /// settings.
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
        let rows = RowStore::open(folder, Partition::WHOLE, None, |row| row)?;
        let starts = (1..).take_while(|&start| rows.get(&start_key(start)).is_some());
        Ok(Self {
            starts: starts.count(),
            rows,
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

    /// Returns start, time \[s\] and result of each measurement of a part.
    fn measurements(&self, key: RowKey) -> impl Iterator<Item = (usize, f64, Option<&Value>)> {
        (1..=self.starts).filter_map(move |start| match self.rows.get(&part_key(key, start))? {
            PartRow::Part { spent_s, result } => Some((start, *spent_s, result.as_ref())),
            PartRow::Start(_) => None,
        })
    }

    /// Returns the time that all starts have spent on a part \[s\].
    pub(super) fn spent_s(&self, key: RowKey) -> f64 {
        self.measurements(key).map(|(_, spent_s, _)| spent_s).sum()
    }

    /// Returns the result of a part, if it is kept.
    pub(super) fn find<T: Measured>(&mut self, key: RowKey) -> Option<T> {
        let (start, found) = self
            .measurements(key)
            .find_map(|(start, _, result)| Some((start, T::deserialize(result?).ok()?)))?;
        self.used.insert(start);
        self.reused += 1;
        Some(found)
    }

    /// Returns the number of this start.
    pub(super) fn this_start(&mut self) -> Result<usize, StudyError> {
        if let Some(this) = self.this {
            return Ok(this);
        }
        self.starts += 1;
        self.append(start_key(self.starts), PartRow::Start(self.load))?;
        self.used.insert(self.starts);
        Ok(*self.this.insert(self.starts))
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
        self.append(part_key(key, start), PartRow::Part { spent_s, result })
    }

    fn append(&mut self, key: RowKey, row: PartRow) -> Result<(), StudyError> {
        let appended = self.rows.append(key, row);
        let appended = appended.map_err(|error| StudyError::Store(error.to_string()));
        appended.map(|_| ())
    }

    /// Returns the starts whose results are used.
    pub(super) fn starts(&self) -> Starts {
        let load = |start| match self.rows.get(&start_key(start)) {
            Some(PartRow::Start(load)) => *load,
            _ => None,
        };
        let start = |&start: &usize| Start {
            start,
            load: load(start),
        };
        let reused = (self.reused > 0).then(|| {
            let (parts, folder) = (self.reused, self.folder.display());
            format!("parts of earlier starts: {parts}; without {folder}, all are measured again")
        });
        Starts {
            starts: self.used.iter().map(start).collect(),
            notes: self.rows.warnings().iter().cloned().chain(reused).collect(),
        }
    }
}

/// Returns the key of a start.
fn start_key(start: usize) -> RowKey {
    RowKey::of([&b"start"[..], start.to_string().as_bytes()])
}

/// Returns the key of the measurement of a part by a start.
fn part_key(part: RowKey, start: usize) -> RowKey {
    RowKey::of([part.to_string().as_bytes(), start.to_string().as_bytes()])
}
