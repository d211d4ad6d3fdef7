//! A plant with an injected fault.

use twinrig::kernel::{Port, SimTime};
use twinrig::runtime::{Plant, PlantFault};
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
    fn inner(&self) -> Option<&dyn Plant> {
        Some(&self.plant)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Plant> {
        Some(&mut self.plant)
    }

    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.plant.ports()
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
}
