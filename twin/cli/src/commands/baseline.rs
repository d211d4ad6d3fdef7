//! Baselines: a folder with the recordings of runs, with which later runs are compared, and with
//! the tolerances of that.

mod moved;
mod tolerances;

use std::path::{Path, PathBuf};

use twinrig_record::{EventComparison, Recording, VerdictMessage, compare_events};
use twinrig_rig::report::{Against, Line, Report};
use twinrig_view::parting;

use super::compare::EventDifference;
use super::diff::{cut_off, open};
use crate::error::TwinError;
pub(super) use tolerances::TEMPLATE;
use tolerances::Tolerances;

/// Name of the file with the tolerances.
pub(super) const TOLERANCES: &str = "baseline.toml";

/// Folder of recordings.
pub(super) struct Baseline {
    folder: PathBuf,
    tolerances: Tolerances,
}

/// A recording beside that of its baseline.
pub(super) struct Compared {
    /// All differences are within the tolerances.
    pub(super) same: bool,
    /// The difference by which the runs part; none of runs that are equal to a millionth.
    pub(super) parting: Option<String>,
    /// Footsteps and signals beyond their tolerances, old and new.
    pub(super) moved: Vec<String>,
}

/// Metadata in which a run and its baseline agree, with their names.
const IDENTITY: [(&str, &str); 2] = [("scenario", "scenario"), ("seed", "seed")];

impl Baseline {
    /// Reads a folder and its tolerances; without a file of them, the defaults are used.
    pub(super) fn open(folder: &Path) -> Result<Self, TwinError> {
        if !folder.is_dir() {
            return Err(TwinError::Refused {
                path: folder.to_owned(),
                why: "there is no such folder".to_owned(),
                help: "a baseline is a folder, which `twin accept DIR RECORDING` makes".to_owned(),
            });
        }
        Ok(Self {
            tolerances: Tolerances::read(&folder.join(TOLERANCES))?,
            folder: folder.to_owned(),
        })
    }

    /// Returns the path of the recording with which `recording` is compared: that of its name.
    pub(super) fn path_of(&self, recording: &Path) -> PathBuf {
        self.folder.join(recording.file_name().unwrap_or_default())
    }

    /// Returns the names of the recordings.
    pub(super) fn names(&self) -> Vec<String> {
        let listed = std::fs::read_dir(&self.folder).into_iter().flatten();
        let names = listed.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let is_recording =
            |name: &String| Path::new(name).extension().is_some_and(|it| it == "mcap");
        let mut names: Vec<String> = names.filter(is_recording).collect();
        names.sort();
        names
    }

    /// Compares a report and its recording with the baseline, and adds the result to the report.
    pub(super) fn judge(&self, report: &mut Report, recording: &Path) -> Result<(), TwinError> {
        let (path, old) = self.recording(recording)?;
        let new = open(recording)?;
        let compared = self.compare(&path, &old, &new)?;
        let unnoticed = !compared.same && report.expectations.iter().all(Line::holds);
        let noticed = unnoticed.then(|| "not noticed by any expectation".to_owned());
        let differences = compared.parting.into_iter().chain(noticed);
        let measured = measured(&old)?;
        let of_name = |name: &str| measured.iter().find(|(known, _)| known == name)?.1;
        let lines = report.expectations.iter();
        report.against = Some(Against {
            baseline: path.display().to_string(),
            same: compared.same,
            differences: differences.chain(compared.moved).collect(),
            measured: lines.map(|line| of_name(&line.outcome.name)).collect(),
        });
        Ok(())
    }

    /// Opens the recording of the baseline for `recording`.
    fn recording(&self, recording: &Path) -> Result<(PathBuf, Recording), TwinError> {
        let path = self.path_of(recording);
        let refused = |why: String, help: &str| TwinError::Refused {
            path: path.clone(),
            why,
            help: help.to_owned(),
        };
        if !path.is_file() {
            let why = "the baseline has no recording of this run".to_owned();
            let names = self.names().join(", ");
            let help = format!(
                "its recordings are: {names}; seed, plant and settings are in their names; `twin \
                 accept DIR RECORDING` adds one"
            );
            return Err(refused(why, &help));
        }
        let old = open(&path)?;
        if cut_off(&old).is_some() || !old.is_complete() {
            let why = "the recording was cut off, so that it is no baseline".to_owned();
            return Err(refused(why, "`twin accept` replaces it"));
        }
        Ok((path, old))
    }

    /// Compares two recordings.
    pub(super) fn compare(
        &self,
        path: &Path,
        old: &Recording,
        new: &Recording,
    ) -> Result<Compared, TwinError> {
        for (key, name) in IDENTITY {
            let [in_old, in_new] = [old, new].map(|it| it.note(key).unwrap_or("unknown"));
            if in_old != in_new {
                return Err(TwinError::Refused {
                    path: path.to_owned(),
                    why: format!(
                        "the recording is of another run: its {name} is `{in_old}`, not `{in_new}`"
                    ),
                    help: "`twin accept` replaces it".to_owned(),
                });
            }
        }
        if old.fingerprint().is_some() && old.fingerprint() == new.fingerprint() {
            return Ok(Compared {
                same: true,
                parting: None,
                moved: Vec::new(),
            });
        }
        let end = |recording: &Recording| recording.reached().unwrap_or_default();
        let ends = [end(old), end(new)];
        let comparison = compare_events(old, new, ends);
        let comparison: EventComparison =
            comparison.map_err(|source| TwinError::Compare { source })?;
        let parting = parting(old, new, &comparison, "the baseline");
        let parting = parting.map(|it| format!("first differs from the baseline {}", it.text));
        let file = self.folder.join(TOLERANCES);
        self.tolerances.check(&comparison.signals, &file)?;
        let beyond = self.tolerances.beyond(&comparison.signals);
        let mut moved = moved::moved(&comparison, &self.tolerances, &beyond, ends);
        let (within, bounds) = (beyond.is_empty(), self.tolerances.bounds());
        let difference = EventDifference::within(comparison, bounds, ends, [None; 2]);
        // Signals are judged where there are no footsteps.
        moved.extend(difference.first_signal_beyond());
        Ok(Compared {
            same: difference.same && within,
            parting,
            moved,
        })
    }
}

/// Returns the measured values of the expectations of a recording, by name.
fn measured(recording: &Recording) -> Result<Vec<(String, Option<f64>)>, TwinError> {
    let verdicts = recording.messages::<VerdictMessage>();
    let verdicts = verdicts.map_err(|source| TwinError::Compare { source })?;
    let expectations = verdicts.into_iter().flat_map(|(_, it)| it.expectations);
    Ok(expectations.map(|it| (it.name, it.measured)).collect())
}
