//! Replacement of the plant in the middle of a run.

use twinrig_kernel::SimTime;

use super::Rig;
use crate::{PartKind, Plant, RigError, in_part};

impl Rig {
    /// Replaces the plant by another one, which continues from the present state: process, tasks,
    /// boards, and the commands applied to the plant are unchanged. Two rigs that are restored from
    /// one snapshot, one of them with another plant, therefore differ by their plants alone and not
    /// by their history. Returns a line for each part of the state that the new plant could not
    /// represent ([`Plant::resume_from`]).
    ///
    /// Outputs that are means over an observation window begin their window now.
    ///
    /// # Errors
    /// [`RigError::PortMismatch`] if the plants do not have the same ports in the same order,
    /// [`RigError::NoSharedState`] if the present plant has no plant-independent state,
    /// [`RigError::Plant`] if the other plant cannot represent the state, and any error that has
    /// ended the run before. The rig is then unchanged.
    pub fn replace_plant(&mut self, mut plant: Box<dyn Plant>) -> Result<Vec<String>, RigError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        let plant_host = &mut self.events.plant_host;
        let (present_ports, new_ports) = (plant_host.plant.ports(), plant.ports());
        if present_ports != new_ports {
            let differs = (0..present_ports.len().max(new_ports.len()))
                .find(|&i| present_ports.get(i) != new_ports.get(i));
            let port_text = |ports: &[twinrig_kernel::Port]| {
                let port = differs.and_then(|i| ports.get(i));
                port.map_or_else(|| "nothing".to_owned(), ToString::to_string)
            };
            return Err(RigError::PortMismatch {
                present: plant_host.plant.name().to_owned(),
                other: plant.name().to_owned(),
                has: port_text(&present_ports),
                instead: port_text(&new_ports),
            });
        }
        let state = in_part(PartKind::Plant, plant_host.plant.name(), || {
            plant_host.plant.state()
        });
        let state = state.ok_or_else(|| RigError::NoSharedState {
            plant: plant_host.plant.name().to_owned(),
        })?;
        let name = plant.name().to_owned();
        let omitted = in_part(PartKind::Plant, &name, || plant.resume_from(&state))
            .map_err(|fault| plant_host.in_rig_time(fault))?;
        plant_host.replace(plant);
        plant_host.state.exchanged = Some(plant_host.state.now);
        plant_host.invalidate_observation();
        Ok(omitted)
    }

    /// Returns the time of the last replacement of the plant, if any: the present plant has no
    /// history before it.
    pub fn exchanged(&self) -> Option<SimTime> {
        self.events.plant_host.state.exchanged
    }
}
