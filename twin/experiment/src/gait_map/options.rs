//! Options of a study of a gait over frequency and step length, and its runs.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;
use twinrig_document::parse_quantity;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_rig::error::Error as RigError;

use super::results::{GaitMap, GaitMapInput};
use super::{GaitPoint, expectations};
use crate::error::{Error, StudyError, first_line};
use crate::gait::scene::GaitScene;
use crate::options::CommonOptions;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest, unique};
use crate::options::request::{left_out, plants};
use crate::options::values::any_duration;
use crate::runs::judged::{JudgedRuns, JudgedTask};
use crate::runs::rounds::{RoundShare, StudyEngine};

/// Process variables of the axes.
const FREQUENCY: &str = "frequency";
const STEP_LENGTH: &str = "step_length";
/// Values of an axis, as multiples of that of the scenario.
const MULTIPLES: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.2];

/// Measure speed, cost of transport and Froude number of a gait over its frequency and step length
///
/// Runs a scenario with each frequency and each step length, from its start, and measures from
/// --after on. A gait that falls has no values.
#[derive(Clone, Debug, Args)]
pub struct GaitMapOptions {
    /// Scenario file with a gait
    #[arg(value_name = "SCENARIO", default_value = "scenarios/trot.toml")]
    pub scenario: PathBuf,
    /// Frequencies, separated by commas: "3 Hz,3.5 Hz" [default: 0.8 to 1.2 times the scenario's]
    #[arg(long, value_name = "VALUES", value_delimiter = ',')]
    pub frequency: Vec<String>,
    /// Step lengths, separated by commas: "8 cm,10 cm" [default: 0.8 to 1.2 times the scenario's]
    #[arg(long, value_name = "VALUES", value_delimiter = ',')]
    pub step_length: Vec<String>,
    /// Time from which the gait is measured [default: half of the run]
    #[arg(long, value_name = "TIME", value_parser = any_duration)]
    pub after: Option<SimDuration>,
    /// Plants, settings, engine and folder.
    #[command(flatten)]
    pub common: CommonOptions,
}

impl StudyRequest for GaitMapOptions {
    fn frame(&self) -> StudyFrame<'_> {
        self.common
            .frame("gait", std::slice::from_ref(&self.scenario))
    }

    fn check(&self) -> Result<(), Error> {
        unique("--plant", &self.common.plant)
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let (mut scenes, mut omitted, mut refused) = (Vec::new(), Vec::new(), None);
        for plant in plants(&self.common.plant) {
            let path = &self.scenario;
            match GaitScene::new(context.registry, path, context.settings, plant) {
                Ok(scene) => scenes.push(scene),
                Err(error) => {
                    omitted.push(left_out(&path.display().to_string(), plant, &error));
                    refused.get_or_insert(error);
                }
            }
        }
        let file = self.scenario.display().to_string();
        let Some(first) = scenes.first() else {
            // There is a plant, or the scenario's own.
            let none = || Error::no_gait(&file, "there is no plant", "name one by --plant");
            return Err(refused.unwrap_or_else(none));
        };
        let input = self.input(first, omitted)?;
        let names: Vec<String> = scenes
            .iter()
            .map(|scene| scene.scenario().plant.model.clone())
            .collect();
        let runs = JudgedRuns {
            registry: context.registry,
            scenes: scenes.iter().map(|scene| scene.files().clone()).collect(),
        };
        let places = input.places(names.len());
        let tasks = places.iter().map(|&(scene, [frequency, length])| {
            let settings = [
                (FREQUENCY, format!("\"{frequency} Hz\"")),
                (STEP_LENGTH, format!("\"{length} m\"")),
            ];
            let settings = settings.map(|(key, value)| (format!("controller.{key}"), value));
            let judged = [
                ("expect", expectations(input.after_s)),
                ("record.signals", "[]".to_owned()),
            ];
            let judged = judged.map(|(key, value)| (key.to_owned(), value));
            JudgedTask {
                scene,
                settings: settings.into_iter().chain(judged).collect(),
            }
        });
        let tasks: Vec<JudgedTask> = tasks.collect();
        let mut engine = StudyEngine::new(context.registry, &self.common.runs, &self.frame())?;
        let rows = engine.round(&runs, &tasks, RoundShare::Partition, context.observer)?;
        let points = places.iter().zip(&rows);
        let points = points.map(|((scene, at), row)| GaitPoint::new(&names[*scene], *at, row));
        let points: Vec<GaitPoint> = points.collect();
        if let Some(why) = points
            .iter()
            .map(|it| it.why.as_ref())
            .collect::<Option<Vec<_>>>()
        {
            let why = why.first().map_or("there is no run", |why| why.as_str());
            return Err(Error::of_study(&file, StudyError::Run(first_line(why))));
        }
        let map = GaitMap { input, points };
        let mut summary = map.summary();
        engine.note(&mut summary);
        Ok(StudyReport::new(
            summary,
            map.page(context.machine, context.command),
            map.csv(),
            map.json(context.machine, context.command),
        ))
    }
}

impl GaitMapOptions {
    /// Returns the subject of the study, with the values of both axes.
    fn input(&self, scene: &GaitScene<'_>, left_out: Vec<String>) -> Result<GaitMapInput, Error> {
        let scenario = scene.scenario();
        let end_s = scenario.duration.as_secs_f64();
        let after_s = self.after.map_or(0.5 * end_s, SimDuration::as_secs_f64);
        if after_s >= end_s {
            return Err(Error::from(RigError::InvalidOptions {
                why: format!("--after is {after_s} s, and the run ends at {end_s} s"),
                help: "choose an earlier time, or a longer run by --set duration".to_owned(),
            }));
        }
        Ok(GaitMapInput {
            name: scenario.name.clone(),
            file: scenario.file.clone(),
            frequencies_hz: axis(scene, FREQUENCY, &self.frequency, Unit::Hertz)?,
            step_lengths_m: axis(scene, STEP_LENGTH, &self.step_length, Unit::Meter)?,
            after_s,
            end_s,
            left_out,
        })
    }
}

/// Returns the values of an axis: those given, or multiples of the scenario's.
fn axis(
    scene: &GaitScene<'_>,
    name: &str,
    given: &[String],
    unit: Unit,
) -> Result<Vec<f64>, Error> {
    let file = &scene.scenario().file;
    let variables = scene.variables_called(name);
    if variables.is_empty() {
        let why = format!("its controller has no variable `{name}`");
        let help = "choose a controller with both, such as `cpg`; `twin list` has them";
        return Err(Error::no_gait(file, why, help));
    }
    let option = format!("--{}", name.replace('_', "-"));
    let values: Vec<f64> = if given.is_empty() {
        let sum: f64 = variables.iter().map(|variable| variable.value()).sum();
        let own = sum / variables.len() as f64;
        MULTIPLES.map(|multiple| rounded(multiple * own)).into()
    } else {
        let parsed = given.iter().map(|text| {
            let value = parse_quantity(text, unit).map_err(|error| error.to_string());
            let above_0 = |value| match value {
                value if value > 0.0 => Ok(value),
                _ => Err("it must be above 0".to_owned()),
            };
            value.and_then(above_0).map_err(|error| {
                let why = format!("{option} {text}: {error}");
                let help = format!(
                    "give quantities with units: {option}=\"1 {}\"",
                    unit.symbol()
                );
                Error::from(RigError::InvalidOptions { why, help })
            })
        });
        parsed.collect::<Result<_, _>>()?
    };
    unique(&option, &values)?;
    Ok(values)
}

/// Rounds to four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use twinrig_rig::registry::Registry;
    use twinrig_scenario::Setting;

    use super::*;
    use crate::machine::Machine;

    fn setting(key: &str, value: &str) -> Setting {
        Setting {
            origin: "--set".to_owned(),
            key: key.to_owned(),
            value: value.to_owned(),
        }
    }

    #[test]
    fn points_are_around_the_value_of_the_scenario_on_each_plant() {
        let scenario = "/../../scenarios/trot.toml";
        let folder = std::env::temp_dir().join(format!("twinrig-map-{}", std::process::id()));
        let options = GaitMapOptions {
            scenario: (env!("CARGO_MANIFEST_DIR").to_owned() + scenario).into(),
            frequency: vec!["3 Hz".to_owned()],
            step_length: Vec::new(),
            after: None,
            common: CommonOptions {
                plant: ["massless", "lcp"].map(str::to_owned).into(),
                out: folder.clone(),
                ..CommonOptions::default()
            },
        };
        let settings = [
            setting("duration", "'40 ms'"),
            setting("expect", "[{ body = { fall = false } }]"),
            setting("controller.step_length", "'10 cm'"),
        ];
        let context = StudyContext {
            registry: &Registry::standard(),
            settings: &settings,
            machine: &Machine::here("test", "release"),
            command: "twin study gait",
            observer: &mut (),
        };
        let json = options.run(context).unwrap().json;
        std::fs::remove_dir_all(folder).unwrap();
        assert_eq!(json["after_s"], 0.02);
        let points = json["points"].as_array().unwrap().iter();
        let found = points.map(|it| (it["plant"].as_str(), it["step_length_m"].as_f64()));
        let lengths = [0.08, 0.09, 0.1, 0.11, 0.12];
        let of = |plant| lengths.map(|length| (Some(plant), Some(length)));
        let expected = [of("massless"), of("lcp")].concat();
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }
}
