use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

use crate::{Plant, PlantFault, PlantSignals, World};

/// The plant with the commands it is held to and the last look at it: moved only when somebody acts on
/// it or looks at it, then to exactly that instant, and looked at once an instant however many ask.
pub(crate) struct FarEnd {
    pub(crate) plant: Box<dyn Plant>,
    pub(crate) signals: PlantSignals,
    pub(crate) state: FarEndState,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FarEndState {
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

impl FarEnd {
    pub(crate) fn new(plant: Box<dyn Plant>) -> Self {
        let signals = PlantSignals::of(&plant.ports());
        let mut inputs = vec![0.0; signals.inputs.len()];
        plant.first_inputs(&mut inputs);
        let state = FarEndState {
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
            let advanced = self.plant.advance(to, &state.inputs);
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
            self.plant.observe(&mut self.state.outputs);
            self.state.observed = Some(self.state.now);
        }
        Ok(&self.state.outputs)
    }
}

impl World for FarEnd {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        self.look().map(|outputs| &outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        self.catch_up()?;
        Ok(&mut self.state.inputs[signals])
    }
}
