use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimTime, Snapshot};

use crate::{PartKind, Plant, PlantAccess, PlantFault, PlantSignals, in_part};

/// The plant with the commands it is held to and the last look at it: moved only when somebody acts on
/// it or looks at it, then to exactly that instant, and looked at once an instant however many ask.
pub(crate) struct PlantHost {
    pub(crate) plant: Box<dyn Plant>,
    /// What the plant calls itself.
    name: String,
    pub(crate) signals: PlantSignals,
    pub(crate) state: PlantHostState,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PlantHostState {
    pub(crate) now: SimTime,
    /// Where the plant is: at now or before.
    moved_to: SimTime,
    /// Until when the plant was held before the run began: its own time starts there.
    held: SimTime,
    holding: bool,
    observed: Option<SimTime>,
    /// When another plant was put in the place of the one before.
    pub(crate) exchanged: Option<SimTime>,
    pub(crate) inputs: Vec<f64>,
    pub(crate) outputs: Vec<f64>,
}

impl PlantHost {
    pub(crate) fn new(plant: Box<dyn Plant>) -> Self {
        let name = plant.name().to_owned();
        let (signals, inputs) = in_part(PartKind::Plant, &name, || {
            let signals = PlantSignals::of(&plant.ports());
            let mut inputs = vec![0.0; signals.inputs.len()];
            plant.first_inputs(&mut inputs);
            (signals, inputs)
        });
        let state = PlantHostState {
            now: SimTime::ZERO,
            moved_to: SimTime::ZERO,
            held: SimTime::ZERO,
            holding: true,
            observed: None,
            exchanged: None,
            inputs,
            outputs: vec![0.0; signals.outputs.len()],
        };
        Self {
            plant,
            name,
            signals,
            state,
        }
    }

    /// Lets go of the plant, which was held in its start until now: boards wake up, calibrate and report while
    /// the robot still hangs on its stand.
    pub(crate) fn release(&mut self) {
        self.hold();
        self.state.holding = false;
    }

    /// Whether the plant is still held.
    pub(crate) fn is_held(&self) -> bool {
        self.state.holding
    }

    fn hold(&mut self) {
        self.state.held = self.state.now;
        self.state.moved_to = self.state.now;
    }

    /// Moves the plant to now.
    fn catch_up(&mut self) -> Result<(), PlantFault> {
        if self.state.holding {
            self.hold();
        }
        let state = &mut self.state;
        if state.moved_to < state.now {
            let to = SimTime::ZERO + (state.now - state.held);
            let advanced = in_part(PartKind::Plant, &self.name, || {
                self.plant.advance(to, &state.inputs)
            });
            advanced.map_err(|fault| self.late(fault))?;
            self.state.moved_to = self.state.now;
        }
        Ok(())
    }

    /// A fault of the plant in the time of the rig: the plant's own begins when it is let go.
    pub(crate) fn late(&self, fault: PlantFault) -> PlantFault {
        PlantFault {
            time: self.state.held + (fault.time - SimTime::ZERO),
            ..fault
        }
    }

    /// Looks anew when it is asked next, though it be at the same instant.
    pub(crate) fn forget_look(&mut self) {
        self.state.observed = None;
    }

    /// All outputs at now.
    pub(crate) fn look(&mut self) -> Result<&[f64], PlantFault> {
        self.catch_up()?;
        if self.state.observed != Some(self.state.now) {
            let outputs = &mut self.state.outputs;
            in_part(PartKind::Plant, &self.name, || self.plant.observe(outputs));
            self.state.observed = Some(self.state.now);
        }
        Ok(&self.state.outputs)
    }

    /// Begins the window over which outputs that are means are taken.
    pub(crate) fn begin_window(&mut self) {
        in_part(PartKind::Plant, &self.name, || self.plant.begin_window());
    }

    /// The state of the plant.
    pub(crate) fn save(&self) -> Snapshot {
        in_part(PartKind::Plant, &self.name, || self.plant.save())
    }

    /// Puts `plant` in the place of the one that is there.
    pub(crate) fn replace(&mut self, plant: Box<dyn Plant>) {
        plant.name().clone_into(&mut self.name);
        self.plant = plant;
    }
}

impl PlantAccess for PlantHost {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        self.look().map(|outputs| &outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        self.catch_up()?;
        Ok(&mut self.state.inputs[signals])
    }
}
