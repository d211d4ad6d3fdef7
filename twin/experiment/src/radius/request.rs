//! Studies of radii from the options of the command line.

use twinrig_rig::error::Error as RigError;
use twinrig_scenario::Setting;

use super::chosen::KeyAxis;
use super::execute::RadiusRequest;
use super::options::RadiusOptions;
use crate::error::Error;

impl RadiusOptions {
    /// Returns the study; its rows are in a folder of this name.
    pub(crate) fn request(
        &self,
        name: String,
        settings: &[Setting],
    ) -> Result<RadiusRequest, Error> {
        if self.along.len() != self.to.len() {
            return Err(Error::from(RigError::InvalidOptions {
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
            engine: self.engine.clone(),
            rows: self.out.join(name),
        })
    }
}
