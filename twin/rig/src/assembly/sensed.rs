//! Sensors of the inputs of the controller: `[[sensor]]`.

use twinrig_runtime::{Rig, SensorModel};

use super::Assembly;
use crate::error::Error;

impl Assembly<'_> {
    /// Returns the sensors of the controller's inputs: their names, signals and parameters.
    pub fn sensors(&self) -> impl Iterator<Item = (&str, &str, &SensorModel)> {
        self.scene().sensed.iter().map(|sensed| {
            let spec = &self.scenario().sensors[sensed.sensor];
            let name = spec.name.as_deref().unwrap_or(&sensed.signal);
            (name, sensed.signal.as_str(), &spec.model)
        })
    }

    /// Adds the sensors to a rig.
    pub(super) fn add_sensors(&self, rig: &mut Rig) -> Result<(), Error> {
        let seed = self.scenario().seed;
        self.sensors()
            .try_for_each(|(name, signal, model)| rig.add_sensor(name, signal, model.clone(), seed))
            .map_err(|error| self.rig_error(error))
    }
}
