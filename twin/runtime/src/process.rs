use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError};

use crate::{ProcessVariable, VariableError};

/// A controller: signals in, signals out, once per control period. It cannot distinguish a twin
/// from hardware.
///
/// The rig calls [`Process::ports`] and [`Process::variables`] once while it is wired, then
/// [`Process::step`] at every control step at which the process is not busy.
pub trait Process: Send {
    /// Returns the name, used in messages and recordings.
    fn name(&self) -> &str;

    /// Returns inputs and outputs. Constant over the life of the process.
    fn ports(&self) -> Vec<Port>;

    /// Returns the variables that may be set during a run. Their count, names, units and ranges are
    /// constant.
    fn variables(&self) -> &[ProcessVariable] {
        &[]
    }

    /// Sets the variable at `index` of [`Process::variables`], in its unit.
    ///
    /// # Errors
    /// [`VariableError`] if there is no such variable or the value is refused; the variable is then
    /// unchanged.
    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let _ = value;
        Err(VariableError::NoSuchIndex {
            index,
            count: self.variables().len(),
        })
    }

    /// Runs one iteration.
    ///
    /// `elapsed` is the physical time since the previous iteration began; it is zero at the first
    /// one only, and longer than a period after an overrun. `inputs` and `outputs` contain the
    /// input and output ports of [`Process::ports`], concatenated in order
    /// ([`twinrig_kernel::Layout`]). An input whose task has not finished a transfer yet has the
    /// task's initial value: zero, unless the task specifies another. `outputs` contains the
    /// outputs of the last iteration, zeros at first.
    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]);

    /// Saves all state that affects later iterations, variables included.
    fn save(&self) -> Snapshot;

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot belongs to another kind of process.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
