//! A part that is broken on purpose.

use twinrig::kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig::runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};
use twinrig::{PlantKind, Registry, massless};

/// A plant that is looked at wrongly once: from one instant to the next look, the last bit of its first output is flipped.
pub struct Broken<P> {
    plant: P,
    now: SimTime,
    breaks_at: SimTime,
    done: bool,
}

/// The standard registry, its mass-less plant replaced by one that is broken at `breaks_at`.
pub fn with_broken_plant(breaks_at: SimTime) -> Registry {
    let build = move |context: &twinrig::PlantContext<'_>| {
        Ok(Broken {
            plant: massless(context)?,
            now: SimTime::ZERO,
            breaks_at,
            done: false,
        })
    };
    Registry::standard().with_plant(PlantKind::new("massless", "broken on purpose", build))
}

impl<P: Plant> Plant for Broken<P> {
    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.plant.ports()
    }

    fn first_inputs(&self, inputs: &mut [f64]) {
        self.plant.first_inputs(inputs);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.now = to;
        self.plant.advance(to, inputs)
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        self.plant.observe(outputs);
        if self.now >= self.breaks_at && !self.done {
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
