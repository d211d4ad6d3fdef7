use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError};

use crate::{ProcessVariable, VariableError};

/// A controller: signals in, signals out, once a control period. It cannot tell a twin from hardware.
///
/// The rig calls [`Process::ports`] and [`Process::variables`] once while it is wired, then
/// [`Process::step`] at every control step at which the process is not still busy.
pub trait Process: Send {
    /// Name, for messages and recordings.
    fn name(&self) -> &str;

    /// Its inputs and outputs. The same at every call.
    fn ports(&self) -> Vec<Port>;

    /// The numbers that may be set while it runs. Their count, names, units and ranges never change.
    fn variables(&self) -> &[ProcessVariable] {
        &[]
    }

    /// Sets the variable at `index` of [`Process::variables`], in its unit.
    ///
    /// # Errors
    /// [`VariableError`] if there is no such variable or the value is refused; the variable then keeps
    /// its value.
    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let _ = value;
        Err(VariableError::NoSuchIndex {
            index,
            count: self.variables().len(),
        })
    }

    /// One iteration.
    ///
    /// `elapsed` is the physical time since the previous iteration began; it is zero at the first one
    /// and at no other, and it is more than a period after an iteration that came too late. `inputs` and
    /// `outputs` hold the input and output ports of [`Process::ports`], end to end, in order
    /// ([`twinrig_kernel::Layout`]). An input whose task has not finished a transfer yet reads what the
    /// task held at the start: zero, unless the task says otherwise. `outputs` holds what the last
    /// iteration left there, zeros at first.
    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]);

    /// Saves everything that later iterations depend on, variables included.
    fn save(&self) -> Snapshot;

    /// Goes back to a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is not of such a process.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
