use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError};

use crate::{LimitViolation, ProcessVariable, VariableError};

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

    /// Returns whether the output of this name is a monitor: recorded and judged, and received by a
    /// part only if there is one that takes it. Any other output without a receiver is a wiring
    /// error.
    fn is_monitor(&self, output: &str) -> bool {
        let _ = output;
        false
    }

    /// Returns the limits that commands have exceeded since the first iteration, with times since
    /// then.
    fn limit_violations(&self) -> Vec<LimitViolation> {
        Vec::new()
    }

    /// Returns the variables that may be set during a run. Their count, names, units and ranges are
    /// constant.
    fn variables(&self) -> &[ProcessVariable] {
        &[]
    }

    /// Returns the same variables, for [`Process::set_variable`] and [`Process::restore`].
    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut []
    }

    /// Sets the variable at `index` of [`Process::variables`], in its unit.
    ///
    /// # Errors
    /// [`VariableError`] if there is no such variable or the value is refused; the variable is then
    /// unchanged.
    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let variables = self.variables_mut();
        let count = variables.len();
        let variable = variables.get_mut(index);
        let variable = variable.ok_or(VariableError::NoSuchIndex { index, count })?;
        variable.set(value)
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

    /// Returns the reason why the last iteration failed, after which the run ends. By default no
    /// iteration fails: one that runs in another language or reads a file may.
    fn fault(&self) -> Option<String> {
        None
    }

    /// Saves all state that affects later iterations, variables included. By default the values of
    /// the variables are the state.
    fn save(&self) -> Snapshot {
        let values = self.variables().iter().map(ProcessVariable::value);
        Snapshot::of(&values.collect::<Vec<f64>>())
    }

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot belongs to another kind of process.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let values: Vec<f64> = snapshot.read()?;
        restore_values(self.variables_mut(), &values)
    }
}

/// Restores the values of the variables of a process.
///
/// # Errors
/// [`SnapshotError`] if there is not one for each variable, or a variable refuses its value.
pub fn restore_values(
    variables: &mut [ProcessVariable],
    values: &[f64],
) -> Result<(), SnapshotError> {
    let count = variables.len();
    if values.len() != count {
        return Err(SnapshotError::Mismatch {
            expected: format!("a process of {count} variables"),
            found: format!("one of {} variables", values.len()),
        });
    }
    for (variable, value) in variables.iter_mut().zip(values) {
        variable
            .set(*value)
            .map_err(|error| SnapshotError::Mismatch {
                expected: format!("a process with the variable `{}`", variable.name()),
                found: error.to_string(),
            })?;
    }
    Ok(())
}

/// Sets variables in this order, restores the process, and returns the first refusal.
///
/// # Errors
/// The outer error is that of a process that cannot be restored.
pub fn check_values(
    process: &mut dyn Process,
    values: &[(usize, f64)],
    period: SimDuration,
) -> Result<Result<(), VariableError>, SnapshotError> {
    let saved = process.save();
    let mut values = values.iter();
    let checked = values.try_for_each(|&(index, value)| {
        process.set_variable(index, value)?;
        let variable = process.variables().get(index);
        variable.map_or(Ok(()), |variable| variable.check_sampled(value, period))
    });
    process.restore(&saved)?;
    Ok(checked)
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::Unit;

    use super::*;

    /// Process whose state is its variables.
    struct Gain([ProcessVariable; 1]);

    impl Process for Gain {
        fn name(&self) -> &'static str {
            "gain"
        }
        fn ports(&self) -> Vec<Port> {
            Vec::new()
        }
        fn variables(&self) -> &[ProcessVariable] {
            &self.0
        }
        fn variables_mut(&mut self) -> &mut [ProcessVariable] {
            &mut self.0
        }
        fn step(&mut self, _: SimDuration, _: &[f64], _: &mut [f64]) {}
    }

    #[test]
    fn variables_are_the_default_state() {
        let new = || Gain([ProcessVariable::new("gain", Unit::One, 0.0..=1.0, 0.5)]);
        let mut process = new();
        process.set_variable(0, 0.25).unwrap();
        assert!(process.set_variable(0, 2.0).is_err() && process.set_variable(1, 0.0).is_err());
        let mut restored = new();
        restored.restore(&process.save()).unwrap();
        assert_eq!(restored.variables()[0].value(), 0.25);
        let foreign = [
            Snapshot::of(&vec![0.5, 0.5]),
            Snapshot::of(&vec![2.0]),
            Snapshot::of(&()),
        ];
        assert!(
            foreign
                .iter()
                .all(|snapshot| restored.restore(snapshot).is_err())
        );
    }
}
