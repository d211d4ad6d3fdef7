use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Agenda, Snapshot, SnapshotError};

use super::Rig;
use crate::plant_host::PlantHostState;
use crate::process_slot::ProcessSlotState;
use crate::sensor::ChainState;
use crate::{Group, Manager, RigError, TimeSource};

/// Key of the hash of saved rigs.
const KEY: &[u8; 32] = b"twinrig: state of a lockstep rig";

/// State of a rig between two events.
#[derive(Serialize, Deserialize)]
struct SavedRig {
    configuration: String,
    manager: Manager,
    agenda: Agenda,
    compute: TimeSource,
    sensors: Vec<ChainState>,
    diagnostics: Vec<f64>,
    slot: ProcessSlotState,
    plant_host: PlantHostState,
    process: Snapshot,
    tasks: Vec<Snapshot>,
    plant: Snapshot,
}

impl Rig {
    /// Saves the rig, including transfers and iterations in progress. Another rig of the same
    /// configuration that is restored from it continues bit for bit as this one does. The snapshot
    /// begins with a hash, by which [`Rig::restore`] recognises any change of it.
    pub fn save(&self) -> Snapshot {
        let saved = Snapshot::of(&SavedRig {
            configuration: self.configuration(),
            manager: self.manager.clone(),
            agenda: self.events.agenda.clone(),
            compute: self.compute.clone(),
            sensors: self
                .sensors
                .iter()
                .map(|chain| chain.state.clone())
                .collect(),
            diagnostics: self.events.values.clone(),
            slot: self.process.state.clone(),
            plant_host: self.events.plant_host.state.clone(),
            process: self.process.save(),
            tasks: self.events.save_parts(),
            plant: self.events.plant_host.save(),
        });
        Snapshot(saved.checked(KEY))
    }

    /// Restores a saved state, also after an error.
    ///
    /// # Errors
    /// [`RigError::Snapshot`] if the snapshot was changed, or belongs to a rig of another
    /// configuration; the rig is then unchanged. If a part refuses its snapshot, some parts have
    /// been restored and some not, and the rig returns that error from every further call.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), RigError> {
        let saved: SavedRig = Snapshot::verified(&snapshot.0, KEY)?.read()?;
        if saved.configuration != self.configuration() {
            return Err(SnapshotError::Mismatch {
                expected: self.configuration(),
                found: saved.configuration,
            }
            .into());
        }
        let restored = self.restore_parts(&saved).map_err(RigError::from);
        self.manager = saved.manager;
        self.events.agenda = saved.agenda;
        self.compute = saved.compute;
        for (chain, state) in self.sensors.iter_mut().zip(saved.sensors) {
            chain.state = state;
        }
        self.events.values = saved.diagnostics;
        self.process.state = saved.slot;
        self.events.plant_host.state = saved.plant_host;
        self.failed = restored.clone().err();
        restored
    }

    fn restore_parts(&mut self, saved: &SavedRig) -> Result<(), SnapshotError> {
        self.process.process.restore(&saved.process)?;
        self.events.restore_parts(&saved.tasks)?;
        self.events.plant_host.plant.restore(&saved.plant)
    }

    /// Returns the configuration: rigs of equal configuration restore each other's snapshots.
    fn configuration(&self) -> String {
        let len = |group| self.layout(group).len();
        format!(
            "a rig of process {} ({} in, {} out), plant {} ({} in, {} out) and the tasks {:?}, \
             with a control period of {}, observed every {}{}",
            self.process.process.name(),
            len(Group::ProcessInputs),
            len(Group::ProcessOutputs),
            self.events.plant_host.plant.name(),
            self.events.plant_host.state.inputs.len(),
            len(Group::Plant),
            self.task_names().collect::<Vec<_>>(),
            self.period,
            self.events.observe,
            self.describe_sensors(),
        )
    }
}

/// Formats configuration and time.
impl fmt::Debug for Rig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, at {}", self.configuration(), self.now())
    }
}
