//! Studies of radii from the options of the command line.

use std::path::Path;

use twinrig_campaign::engine::EngineOptions;
use twinrig_scenario::Setting;

use super::chosen::KeyAxis;
use super::execute::RadiusRequest;
use crate::args::{DEFAULT_PRECISION, RadiusOptions, RobustnessOptions};
use crate::error::TwinError;
use twinrig_rig::error::Error;

impl RadiusOptions {
    /// Returns the study; its rows are in a folder of this name.
    pub(crate) fn request(
        &self,
        name: String,
        settings: &[Setting],
    ) -> Result<RadiusRequest, TwinError> {
        if self.along.len() != self.to.len() {
            return Err(TwinError::from(Error::InvalidOptions {
                why: format!("{} --along and {} --to", self.along.len(), self.to.len()),
                help: "give the value with the greatest disturbance after each --along".to_owned(),
            }));
        }
        let key_axis = |(along, to): (&String, &String)| {
            let (key, from) = match along.split_once('=') {
                Some((key, from)) => (key, Some(from.trim().to_owned())),
                None => (along.as_str(), None),
            };
            KeyAxis {
                key: key.trim().to_owned(),
                from,
                to: to.clone(),
            }
        };
        let plant = self.plant.iter().map(|name| Setting::plant(name));
        Ok(RadiusRequest {
            scenario: self.scenario.clone(),
            settings: settings.iter().cloned().chain(plant).collect(),
            axes: self.axis.clone(),
            along: self.along.iter().zip(&self.to).map(key_axis).collect(),
            precision: self.precision,
            options: EngineOptions {
                jobs: self.jobs,
                ..EngineOptions::default()
            },
            rows: self.out.join(name),
        })
    }
}

impl RobustnessOptions {
    /// Returns the name of the study of radii of a scenario on one of the plants, as
    /// `twin study radius` names it; with the plant if there are several.
    pub(crate) fn radius_name(&self, scenario: &Path, plant: Option<&str>) -> String {
        let stem = scenario.file_stem().unwrap_or_default().to_string_lossy();
        match plant.filter(|_| self.plant.len() > 1) {
            Some(plant) => format!("radius-{stem}-{plant}"),
            None => format!("radius-{stem}"),
        }
    }

    /// Returns the study of radii of a scenario along all axes; its rows are in a folder of this
    /// name.
    pub(crate) fn radius_request(
        &self,
        name: &str,
        scenario: &Path,
        plant: Option<&str>,
        settings: &[Setting],
    ) -> RadiusRequest {
        let plant = plant.map(Setting::plant);
        RadiusRequest {
            scenario: scenario.to_owned(),
            settings: settings.iter().cloned().chain(plant).collect(),
            axes: Vec::new(),
            along: Vec::new(),
            precision: DEFAULT_PRECISION,
            options: EngineOptions {
                jobs: self.jobs,
                ..EngineOptions::default()
            },
            rows: self.out.join(name),
        }
    }
}
