//! Sensors between the tasks and the process.

use twinrig_kernel::{SignalKind, near_misses};

use super::Rig;
use crate::sensor::{ChainSite, QUATERNION, SignalChain, of_task};
use crate::{RigError, SensorModel, SensorModelError};

impl Rig {
    /// Puts a sensor between the process and the task that carries its input `signal`: from now on
    /// the process reads the samples of the sensor in place of the results of the task. The plant,
    /// its observations and the other signals are unchanged.
    ///
    /// Random numbers are drawn from the streams `sensor/NAME/SIGNAL/…` of `seed`, so that a sensor
    /// more changes no number of another one. A signal is a rotation if the process or the plant
    /// declares it to be one.
    ///
    /// # Errors
    /// [`RigError::Sensor`] if the process does not read the signal, if the signal has a sensor
    /// already, or if a parameter is invalid.
    pub fn add_sensor(
        &mut self,
        name: &str,
        signal: &str,
        model: SensorModel,
        seed: u64,
    ) -> Result<(), RigError> {
        let chain = self.chain(name, signal, model, seed);
        let chain = chain.map_err(|source| RigError::Sensor {
            name: name.to_owned(),
            signal: signal.to_owned(),
            source,
        })?;
        self.sensors.push(chain);
        Ok(())
    }

    fn chain(
        &self,
        name: &str,
        signal: &str,
        model: SensorModel,
        seed: u64,
    ) -> Result<SignalChain, SensorModelError> {
        let inputs = &self.process.inputs;
        let source = inputs.field(signal).and_then(|field| {
            let (task, from) = self.process.source_of(&field.range())?;
            Some((field, task, from))
        });
        let Some((field, task, from)) = source else {
            let known = inputs.fields().map(|field| field.port.name.as_str());
            let near = near_misses(signal, known);
            return Err(SensorModelError::NotRead {
                process: self.process.process.name().to_owned(),
                near: near.into_iter().map(String::from).collect(),
            });
        };
        let mut others = self.sensors.iter();
        if let Some(other) = others.find(|chain| chain.site.signal == signal) {
            return Err(SensorModelError::TwoSensors {
                other: other.name.clone(),
            });
        }
        let output = self.events.plant_host.signals.outputs.field(signal);
        let mut ports = [Some(field), output].into_iter().flatten();
        let site = ChainSite {
            signal: signal.to_owned(),
            task,
            from,
            to: field.range(),
            is_rotation: field.port.size == QUATERNION
                && ports.any(|field| field.port.kind == SignalKind::Rotation),
        };
        SignalChain::new(name, site, model, (seed, self.period))
    }

    /// Shows the results of an idle task to its sensors.
    pub(super) fn sense(&mut self, task: usize, ended: bool) {
        if self.sensors.is_empty() {
            return;
        }
        let now = self.now();
        let results = self.events.parts[task].part.to_process();
        for chain in of_task(&mut self.sensors, task) {
            chain.handle_results(now, results, ended);
        }
    }

    /// Returns the names of the sensors and their signals, as a part of the configuration.
    pub(super) fn describe_sensors(&self) -> String {
        let sensors = self.sensors.iter();
        let sensors =
            sensors.map(|chain| format!(", with {} at {}", chain.name, chain.site.signal));
        sensors.collect()
    }
}
