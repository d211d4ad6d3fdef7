//! Options that all studies have.

use std::path::{Path, PathBuf};

use twinrig_scenario::Setting;

use crate::args::{
    FeedbackOptions, PrecisionOptions, RadiusOptions, StabilityOptions, StudyCommand, StudyOptions,
};
use crate::error::TwinError;

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
        let twice = |option: &str, element: String| TwinError::Together {
            why: format!("{option} has `{element}` twice"),
            help: "give it once".to_owned(),
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

    /// Returns the command that repeats the study.
    pub(super) fn command(self, study: &StudyCommand) -> String {
        let mut words = vec!["twin study".to_owned(), self.name.to_owned()];
        words.extend(self.scenarios.iter().map(|path| path.display().to_string()));
        words.extend(self.plants.iter().map(|plant| format!("--plant {plant}")));
        let set = self.set.iter();
        words.extend(set.map(|(key, value)| format!("--set {key}={value:?}")));
        match study {
            StudyCommand::Precision(PrecisionOptions { study, ensemble }) => {
                words.extend(duration(study));
                words.push(format!("--ensemble {ensemble}"));
                words.push(format!("--budget {}", study.budget));
            }
            StudyCommand::Stability(StabilityOptions { study, factor }) => {
                words.extend(duration(study));
                words.extend(factor.iter().map(|factor| {
                    let values: Vec<String> =
                        factor.values.iter().map(ToString::to_string).collect();
                    format!("--factor {}={}", factor.factor.word(), values.join(","))
                }));
                words.push(format!("--budget {}", study.budget));
            }
            StudyCommand::Coupling(study) => {
                words.extend(duration(study));
                words.push(format!("--budget {}", study.budget));
            }
            StudyCommand::Estimate(options) => {
                words.extend(duration(&options.study));
                words.push(format!("--particles {}", options.particles));
                words.push(format!("--iterations {}", options.iterations));
                words.push(format!("--budget {}", options.study.budget));
            }
            StudyCommand::Modulation(options) => {
                let variable = options.variable.iter();
                words.extend(variable.map(|name| format!("--variable {name}")));
                if !options.by.is_empty() {
                    words.push(format!("--by={:?}", options.by.join(",")));
                }
                let after = options.after.iter();
                words.extend(after.map(|after| format!("--after \"{after}\"")));
                words.push(format!("--points {}", options.points));
                words.push(format!("--steps {}", options.steps));
                if options.factors {
                    words.push("--factors".to_owned());
                }
            }
            StudyCommand::Loads(options) => words.extend(loads(options)),
            StudyCommand::Radius(options) => words.extend(radius(options)),
            StudyCommand::Robustness(options) => {
                words.push(format!("--ensemble {}", options.ensemble));
                words.push(format!("--tolerance \"{} m\"", options.tolerance));
                words.extend(options.radius.then(|| "--radius".to_owned()));
            }
            StudyCommand::Transition(options) => {
                let variable = options.variable.iter();
                words.extend(variable.map(|name| format!("--variable {name}")));
                let plateaus: Vec<String> =
                    options.plateau.iter().map(ToString::to_string).collect();
                if !plateaus.is_empty() {
                    words.push(format!("--plateau {:?}", plateaus.join(",")));
                }
                words.push(format!("--tolerance {}", options.tolerance));
                words.push(format!("--cycles {}", options.cycles));
            }
        }
        words.join(" ")
    }
}

fn duration(options: &StudyOptions) -> Option<String> {
    let duration = options.duration?;
    Some(format!("--duration \"{duration}\""))
}

fn radius(options: &RadiusOptions) -> Vec<String> {
    let axes = options.axis.iter().map(|name| format!("--axis {name}"));
    let along = options.along.iter().zip(&options.to);
    let along = along.map(|(key, to)| format!("--along {key:?} --to={to:?}"));
    let precision = format!("--precision {}", options.precision);
    axes.chain(along)
        .chain(std::iter::once(precision))
        .collect()
}

fn loads(options: &FeedbackOptions) -> Vec<String> {
    let mut words = Vec::new();
    let lags: Vec<String> = options.lag.iter().map(ToString::to_string).collect();
    if !lags.is_empty() {
        words.push(format!("--lag {:?}", lags.join(",")));
    }
    words.push(format!("--after {:?}", options.after.to_string()));
    words.push(format!("--phases {:?}", options.phases.to_string()));
    words.push(format!("--by={:?}", options.by.join(",")));
    words.push(format!("--points {}", options.points));
    words.push(format!("--steps {}", options.steps));
    words
}
