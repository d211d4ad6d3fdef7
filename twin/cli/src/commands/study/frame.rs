//! Options that all studies have.

use std::path::{Path, PathBuf};

use twinrig_scenario::Setting;

use crate::args::{StudyCommand, StudyOptions};
use crate::error::TwinError;
use twinrig_rig::error::Error;

/// Greatest number of scenarios in the name of a file.
const NAMED: usize = 5;

/// Returns the first element that is in a list before.
fn repeated<T: PartialEq>(list: &[T]) -> Option<&T> {
    let mut elements = list.iter().enumerate();
    let found = elements.find(|(index, element)| list[..*index].contains(element));
    found.map(|(_, element)| element)
}

/// Options that all studies have, and name of the study.
#[derive(Clone, Copy)]
pub(super) struct StudyFrame<'a> {
    pub(super) name: &'static str,
    pub(super) scenarios: &'a [PathBuf],
    plants: &'a [String],
    set: &'a [(String, String)],
    pub(super) out: &'a Path,
    pub(super) json: bool,
}

impl<'a> StudyFrame<'a> {
    pub(super) fn of(study: &'a StudyCommand) -> Self {
        let of_plants = |name, options: &'a StudyOptions| Self {
            name,
            scenarios: std::slice::from_ref(&options.scenario),
            plants: &options.plant,
            set: &options.set,
            out: &options.out,
            json: options.json,
        };
        match study {
            StudyCommand::Precision(options) => of_plants("precision", &options.study),
            StudyCommand::Stability(options) => of_plants("stability", &options.study),
            StudyCommand::Coupling(options) => of_plants("coupling", options),
            StudyCommand::Estimate(options) => of_plants("estimate", &options.study),
            StudyCommand::Modulation(options) => Self {
                name: "modulation",
                scenarios: &options.scenarios,
                plants: &options.plant,
                set: &options.set,
                out: &options.out,
                json: options.json,
            },
            StudyCommand::Loads(options) => Self {
                name: "loads",
                scenarios: &options.scenarios,
                plants: &options.plant,
                set: &options.set,
                out: &options.out,
                json: options.json,
            },
            StudyCommand::Radius(options) => Self {
                name: "radius",
                scenarios: std::slice::from_ref(&options.scenario),
                plants: options.plant.as_slice(),
                set: &options.set,
                out: &options.out,
                json: options.json,
            },
            StudyCommand::Robustness(options) => Self {
                name: "robustness",
                scenarios: &options.scenarios,
                plants: &options.plant,
                set: &options.set,
                out: &options.out,
                json: options.json,
            },
            StudyCommand::Transition(options) => Self {
                name: "transition",
                scenarios: std::slice::from_ref(&options.scenario),
                plants: &options.plant,
                set: &options.set,
                out: &options.out,
                json: options.json,
            },
        }
    }

    /// Checks that no element of a list is given twice, which would count twice.
    pub(super) fn check_lists(self, study: &StudyCommand) -> Result<(), TwinError> {
        let twice = |option: &str, element: String| {
            TwinError::from(Error::InvalidOptions {
                why: format!("{option} has `{element}` twice"),
                help: "give it once".to_owned(),
            })
        };
        if let Some(plant) = repeated(self.plants) {
            return Err(twice("--plant", plant.clone()));
        }
        if let StudyCommand::Transition(options) = study
            && let Some(length) = repeated(&options.plateau)
        {
            return Err(twice("--plateau", length.to_string()));
        }
        if let StudyCommand::Radius(options) = study {
            for (option, list) in [("--axis", &options.axis), ("--along", &options.along)] {
                if let Some(name) = repeated(list) {
                    return Err(twice(option, name.clone()));
                }
            }
        }
        Ok(())
    }

    pub(super) fn settings(self) -> Vec<Setting> {
        let set = self.set.iter().map(|(key, value)| Setting {
            origin: "--set".to_owned(),
            key: key.clone(),
            value: value.clone(),
        });
        set.collect()
    }

    /// Returns the name of the files of the study.
    pub(super) fn stem(self) -> String {
        let stems = self.scenarios.iter().map(|path| {
            let stem = path.file_stem();
            stem.map_or("scenario".into(), |stem| stem.to_string_lossy())
        });
        let stems: Vec<_> = stems.collect();
        if let [first, others @ ..] = &*stems
            && others.len() >= NAMED
        {
            return format!("{}-{first}-and-{}-more", self.name, others.len());
        }
        format!("{}-{}", self.name, stems.join("-"))
    }
}
