use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimTime, Snapshot};

use crate::{PartKind, Plant, PlantAccess, PlantFault, PlantSignals, in_part};

/// The plant with its applied commands and the last observation. Advanced only when it is sampled,
/// actuated or observed, to exactly that instant, and observed at most once per instant.
pub(crate) struct PlantHost {
    pub(crate) plant: Box<dyn Plant>,
    /// Time until which, inclusive, only the part that is being called has events.
    pub(crate) horizon: SimTime,
    /// Name of the plant.
    name: String,
    pub(crate) signals: PlantSignals,
    pub(crate) state: PlantHostState,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PlantHostState {
    pub(crate) now: SimTime,
    /// Time of the plant in the time of the rig, at or before `now`.
    advanced_to: SimTime,
    /// End of the time in which the plant is held at its start; the plant's own time begins there.
    held_until: SimTime,
    holding: bool,
    observed: Option<SimTime>,
    /// Time of the last replacement of the plant.
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
            plant.initial_inputs(&mut inputs);
            (signals, inputs)
        });
        let state = PlantHostState {
            now: SimTime::ZERO,
            advanced_to: SimTime::ZERO,
            held_until: SimTime::ZERO,
            holding: true,
            observed: None,
            exchanged: None,
            inputs,
            outputs: vec![0.0; signals.outputs.len()],
        };
        Self {
            plant,
            horizon: SimTime::ZERO,
            name,
            signals,
            state,
        }
    }

    /// Releases the plant, which is held at its start until then: boards boot, calibrate and report
    /// while the robot hangs on its stand.
    pub(crate) fn release(&mut self) {
        self.hold();
        self.state.holding = false;
    }

    /// Returns whether the plant is still held.
    pub(crate) fn is_held(&self) -> bool {
        self.state.holding
    }

    fn hold(&mut self) {
        self.state.held_until = self.state.now;
        self.state.advanced_to = self.state.now;
    }

    /// Advances the plant to now.
    fn advance_to_now(&mut self) -> Result<(), PlantFault> {
        if self.state.holding {
            self.hold();
        }
        let state = &mut self.state;
        if state.advanced_to < state.now {
            let to = SimTime::ZERO + (state.now - state.held_until);
            let advanced = in_part(PartKind::Plant, &self.name, || {
                self.plant.advance(to, &state.inputs)
            });
            advanced.map_err(|fault| self.in_rig_time(fault))?;
            self.state.advanced_to = self.state.now;
        }
        Ok(())
    }

    /// Converts the time of a fault to the time of the rig: the plant's own time begins at its
    /// release.
    pub(crate) fn in_rig_time(&self, fault: PlantFault) -> PlantFault {
        PlantFault {
            time: self.state.held_until + (fault.time - SimTime::ZERO),
            ..fault
        }
    }

    /// Discards the stored observation: the next request observes the plant again, even at the same
    /// instant.
    pub(crate) fn invalidate_observation(&mut self) {
        self.state.observed = None;
    }

    /// Returns all outputs at now.
    pub(crate) fn observe(&mut self) -> Result<&[f64], PlantFault> {
        self.advance_to_now()?;
        if self.state.observed != Some(self.state.now) {
            let outputs = &mut self.state.outputs;
            in_part(PartKind::Plant, &self.name, || self.plant.observe(outputs));
            self.state.observed = Some(self.state.now);
        }
        Ok(&self.state.outputs)
    }

    /// Begins a new window for outputs that are means.
    pub(crate) fn begin_window(&mut self) {
        in_part(PartKind::Plant, &self.name, || self.plant.begin_window());
    }

    /// Saves the state of the plant.
    pub(crate) fn save(&self) -> Snapshot {
        in_part(PartKind::Plant, &self.name, || self.plant.save())
    }

    /// Replaces the plant.
    pub(crate) fn replace(&mut self, plant: Box<dyn Plant>) {
        plant.name().clone_into(&mut self.name);
        self.plant = plant;
    }
}

impl PlantAccess for PlantHost {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        self.advance_to_now()?;
        if self.state.observed != Some(self.state.now) {
            let outputs = &mut self.state.outputs;
            let all = in_part(PartKind::Plant, &self.name, || {
                self.plant.observe_signals(signals.clone(), outputs)
            });
            self.state.observed = all.then_some(self.state.now);
        }
        Ok(&self.state.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        self.advance_to_now()?;
        Ok(&mut self.state.inputs[signals])
    }

    fn run_ahead(&mut self, to: SimTime) -> bool {
        let alone = self.state.now < to && to <= self.horizon;
        if alone {
            self.state.now = to;
        }
        alone
    }
}
