use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};

use crate::{BusHealth, DriverPhase, PlantSignals, WiringError};

/// Work of an emulated bus, for tests of its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusWork {
    /// Instants processed.
    pub instants: u64,
    /// Transmissions of the nodes.
    pub transmissions: u64,
    /// Transmissions computed as a whole, among them.
    pub packets: u64,
    /// Pieces received by the nodes.
    pub received: u64,
}

/// Common interface of the parts between a process and a plant (tasks, wires, lines, nodes):
/// signals of the plant, diagnostics, traffic, state.
///
/// A wrapper returns its inner part from [`Part::inner`] and [`Part::inner_mut`] and implements the
/// methods in which it differs; the others are those of the inner part. A part without inner part
/// and state implements nothing.
pub trait Part: Send {
    /// Returns the wrapped part.
    fn inner(&self) -> Option<&dyn Part> {
        None
    }

    /// Returns the wrapped part, for changes.
    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        None
    }

    /// Resolves the plant signals that the part samples and actuates. `owner` is the name of the
    /// task in messages. Not called on hardware.
    ///
    /// # Errors
    /// [`WiringError`] if the plant lacks a required signal.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        match self.inner_mut() {
            Some(inner) => inner.connect(owner, plant),
            None => Ok(()),
        }
    }

    /// Returns the diagnostics: output ports, constant over the life of the part.
    fn diagnostics(&self) -> Vec<Port> {
        self.inner().map_or_else(Vec::new, Part::diagnostics)
    }

    /// Writes the diagnostics at `now`, concatenated in order. Reading does not change the state.
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some(inner) = self.inner() {
            inner.read_diagnostics(now, values);
        }
    }

    /// Handles the beginning of a phase of the driver, before it transmits: for faults, which may
    /// be restricted to a phase.
    fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        if let Some(inner) = self.inner_mut() {
            inner.begin_phase(now, phase);
        }
    }

    /// Adds the errors that emulated boards count themselves, as their firmware does, and
    /// the effects of faults.
    fn report_health(&self, health: &mut BusHealth) {
        if let Some(inner) = self.inner() {
            inner.report_health(health);
        }
    }

    /// Reads the counts of the work done by an emulated bus, which neither results nor snapshots
    /// contain.
    fn count_work(&self, work: &mut BusWork) {
        if let Some(inner) = self.inner() {
            inner.count_work(work);
        }
    }

    /// Returns the names of the traces of bytes, each of one direction: `sbcp/out`, `sbcp/in`.
    fn traces(&self) -> Vec<String> {
        self.inner().map_or_else(Vec::new, Part::traces)
    }

    /// Passes the bytes since the last call, in order, with the number of their trace.
    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        if let Some(inner) = self.inner_mut() {
            inner.drain_traffic(passed);
        }
    }

    /// Saves all state that affects the further course, bytes in transit included.
    fn save(&self) -> Snapshot {
        self.inner().map_or_else(|| Snapshot::of(&()), Part::save)
    }

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot belongs to another part.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        match self.inner_mut() {
            Some(inner) => inner.restore(snapshot),
            None => snapshot.read(),
        }
    }
}

impl<T: Part + ?Sized> Part for Box<T> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        (**self).connect(owner, plant)
    }
    fn diagnostics(&self) -> Vec<Port> {
        (**self).diagnostics()
    }
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        (**self).read_diagnostics(now, values);
    }
    fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        (**self).begin_phase(now, phase);
    }
    fn report_health(&self, health: &mut BusHealth) {
        (**self).report_health(health);
    }
    fn count_work(&self, work: &mut BusWork) {
        (**self).count_work(work);
    }
    fn traces(&self) -> Vec<String> {
        (**self).traces()
    }
    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        (**self).drain_traffic(passed);
    }
    fn save(&self) -> Snapshot {
        (**self).save()
    }
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (**self).restore(snapshot)
    }
}
