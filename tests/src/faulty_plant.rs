//! A plant with an injected fault.

use twinrig::kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig::runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};
use twinrig::{PlantKind, Registry, massless};

/// Plant with a single wrong observation: in the first observation at or after `fault_at`, the
/// last bit of the first output is flipped.
pub struct FaultyPlant<P> {
    plant: P,
    now: SimTime,
    fault_at: SimTime,
    done: bool,
}

/// Returns the standard registry with the mass-less plant replaced by one that is faulty from
/// `fault_at`.
pub fn with_faulty_plant(fault_at: SimTime) -> Registry {
    let build = move |context: &twinrig::PlantContext<'_>| {
        Ok(FaultyPlant {
            plant: massless(context)?,
            now: SimTime::ZERO,
            fault_at,
            done: false,
        })
    };
    Registry::standard().with_plant(PlantKind::new("massless", "with an injected fault", build))
}

impl<P: Plant> Plant for FaultyPlant<P> {
    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.plant.ports()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        self.plant.initial_inputs(inputs);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.now = to;
        self.plant.advance(to, inputs)
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        self.plant.observe(outputs);
        if self.now >= self.fault_at && !self.done {
            self.done = true;
            outputs[0] = f64::from_bits(outputs[0].to_bits() ^ 1);
        }
    }

    fn begin_window(&mut self) {
        self.plant.begin_window();
    }

    fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }

    fn work(&self) -> WorkCounts {
        self.plant.work()
    }

    fn save(&self) -> Snapshot {
        self.plant.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.plant.restore(snapshot)
    }
}
