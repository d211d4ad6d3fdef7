//! Another plant in the place of the one that is there, in the middle of a run.

use twinrig_kernel::SimTime;

use super::Rig;
use crate::{PartKind, Plant, RigError, in_part};

impl Rig {
    /// Puts another plant where the present one is, which goes on from there: process, tasks, boards, and the commands that
    /// the plant is held to stay as they are. So two rigs that were restored from one snapshot, one of them with another
    /// plant, differ by their plants alone and not by what came before. Returns a line on everything that the new plant could
    /// not take over ([`Plant::resume_from`]).
    ///
    /// What the new plant shows as a mean over a window of observation begins its window now.
    ///
    /// # Errors
    /// [`RigError::OtherPorts`] if the plants do not have the same ports in the same order, [`RigError::NamelessState`] if the
    /// present plant cannot say where it is, [`RigError::Plant`] if the other cannot be there, and whatever has ended the run
    /// before. Then nothing has changed.
    pub fn exchange_plant(&mut self, mut plant: Box<dyn Plant>) -> Result<Vec<String>, RigError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        let plant_host = &mut self.plant_host;
        let (here, there) = (plant_host.plant.ports(), plant.ports());
        if here != there {
            let differs = (0..here.len().max(there.len())).find(|&i| here.get(i) != there.get(i));
            let named = |ports: &[twinrig_kernel::Port]| {
                let port = differs.and_then(|i| ports.get(i));
                port.map_or_else(|| "nothing".to_owned(), ToString::to_string)
            };
            return Err(RigError::OtherPorts {
                present: plant_host.plant.name().to_owned(),
                other: plant.name().to_owned(),
                has: named(&here),
                instead: named(&there),
            });
        }
        let state = in_part(PartKind::Plant, plant_host.plant.name(), || {
            plant_host.plant.state()
        });
        let state = state.ok_or_else(|| RigError::NamelessState {
            plant: plant_host.plant.name().to_owned(),
        })?;
        let name = plant.name().to_owned();
        let lines = in_part(PartKind::Plant, &name, || plant.resume_from(&state))
            .map_err(|fault| plant_host.late(fault))?;
        plant_host.replace(plant);
        plant_host.state.exchanged = Some(plant_host.state.now);
        plant_host.forget_look();
        Ok(lines)
    }

    /// When its plant was last exchanged for another, if it was: what came before is then not in the present one.
    pub fn exchanged(&self) -> Option<SimTime> {
        self.plant_host.state.exchanged
    }
}
