//! Tactile sensors that buses mount at loads of the plant, and calibrations of their filters.

use std::path::Path;

use twinrig_document::{DocumentError, Placed};
use twinrig_estimate::Calibration;
use twinrig_kernel::Port;
use twinrig_runtime::Plant;
use twinrig_scenario::{BusSpec, Scenario};
use twinrig_sensor::{SensedPlant, TactileParameters};

use crate::error::BuildError;
use crate::parts::bus_kind::SensorMount;
use crate::parts::tactile::CalibrationFile;
use crate::registry::Registry;

/// Sensors of a scenario, with the texts of their files.
#[derive(Clone, Default)]
pub(crate) struct Sensors {
    mounted: Vec<(String, TactileParameters)>,
    /// By the names in the scenario.
    calibrations: Vec<(String, Calibration)>,
    files: Vec<(String, Vec<u8>)>,
}

impl Sensors {
    /// Reads the sensors that the buses of a scenario mount; `kept` are the files of a recording.
    pub(crate) fn of(
        registry: &Registry,
        scenario: &Scenario,
        kept: Option<&[(String, Vec<u8>)]>,
    ) -> Result<Self, DocumentError> {
        let mut sensors = Self::default();
        let mount = |bus: &BusSpec| registry.bus(&bus.kind)?.mount(&bus.options);
        for mount in scenario.buses.iter().filter_map(mount) {
            if !sensors
                .mounted
                .iter()
                .any(|(signal, _)| *signal == mount.signal)
            {
                sensors.mount(mount, &scenario.folder, kept)?;
            }
        }
        for bus in &scenario.buses {
            let kind = registry.bus(&bus.kind);
            for name in kind.map_or_else(Vec::new, |kind| kind.calibrations(&bus.options)) {
                sensors.calibrate(&name, &scenario.folder, kept)?;
            }
        }
        Ok(sensors)
    }

    /// Reads a calibration that has not been read.
    fn calibrate(
        &mut self,
        name: &Placed<String>,
        folder: &Path,
        kept: Option<&[(String, Vec<u8>)]>,
    ) -> Result<(), DocumentError> {
        let mut known = self.calibrations.iter();
        if known.any(|(known, _)| *known == name.value) {
            return Ok(());
        }
        let file_name = format!("calibration-{}.toml", self.calibrations.len());
        let file = match kept {
            None => CalibrationFile::find(name, folder)?,
            Some(kept) => CalibrationFile::of_recording(name, &file_name, kept)?,
        };
        let calibration = file.calibration()?;
        self.calibrations.push((name.value.clone(), calibration));
        self.files
            .push((file_name, file.text().as_bytes().to_vec()));
        Ok(())
    }

    /// Calibrations by the names in the scenario.
    pub(crate) fn calibrations(&self) -> &[(String, Calibration)] {
        &self.calibrations
    }

    fn mount(
        &mut self,
        mount: SensorMount,
        folder: &Path,
        kept: Option<&[(String, Vec<u8>)]>,
    ) -> Result<(), DocumentError> {
        // The names of the files may be paths.
        let name = format!("sensor-{}.toml", self.files.len());
        let file = match kept {
            None => mount.find(folder)?,
            Some(kept) => mount.of_recording(&name, kept)?,
        };
        let cell = mount.cell();
        self.mounted.push((mount.signal, file.cell(cell.as_ref())?));
        self.files.push((name, file.text().as_bytes().to_vec()));
        Ok(())
    }

    /// Files that a recording keeps.
    pub(crate) fn files(&self) -> &[(String, Vec<u8>)] {
        &self.files
    }

    /// Outputs that the sensors add to a plant.
    pub(crate) fn ports(&self) -> Vec<Port> {
        let signals = self.mounted.iter().map(|(signal, _)| signal);
        signals
            .flat_map(|signal| SensedPlant::ports_at(signal))
            .collect()
    }

    /// Whether an output of the plant is the load of a sensor of which an output is `wanted`.
    pub(crate) fn need(&self, output: &str, wanted: &dyn Fn(&str) -> bool) -> bool {
        let mut signals = self.mounted.iter().map(|(signal, _)| signal);
        signals.any(|signal| signal == output && is_wanted(signal, wanted))
    }

    /// Returns the plant with the sensors of which outputs are `wanted`.
    pub(crate) fn around(
        &self,
        plant: Box<dyn Plant>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        let required = self.mounted.iter();
        let required = required.filter(|(signal, _)| is_wanted(signal, wanted));
        let required: Vec<_> = required.cloned().collect();
        if required.is_empty() {
            return Ok(plant);
        }
        Ok(Box::new(SensedPlant::new(plant, &required, wanted)?))
    }
}

fn is_wanted(signal: &str, wanted: &dyn Fn(&str) -> bool) -> bool {
    let mut ports = SensedPlant::ports_at(signal).into_iter();
    ports.any(|port| wanted(&port.name))
}
