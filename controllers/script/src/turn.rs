//! The controller `turn`.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit, signal};
use twinrig_runtime::{Process, ProcessVariable, restore_values};

use crate::ScriptError;

/// Greatest frequency \[Hz\]: that of the motors of Oncilla at the output of their gear.
const FREQUENCY_MAX: f64 = 20.0;

/// Turns the free shafts of a plant at an even rate.
///
/// Outputs `motor/X/rate/command` \[rad/s\] for every motor. Where the frequency is measured
/// ([`Turn::with_measurement`]), the input `motor/X/rate` \[rad/s\], as measured by its encoder, is
/// passed on as the output `motor/X/frequency` \[Hz\], for a filter that requires it.
///
/// # Process variables
///
/// | name | unit | range | default | meaning |
/// |---|---|---|---|---|
/// | `frequency` | Hz | 0 to 20 | 2 | turns per second |
/// | `acceleration` | rad/s² | 0 to 10000 | 12.5 | greatest angular acceleration |
#[derive(Debug, Clone)]
pub struct Turn {
    motors: Vec<String>,
    measures: bool,
    variables: [ProcessVariable; 2],
    state: State,
}

/// State of the controller without its variables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct State {
    /// Commanded frequency \[Hz\].
    frequency: f64,
}

impl Turn {
    /// Name in scenarios.
    pub const NAME: &'static str = "turn";

    /// Creates a controller for motors with these names.
    ///
    /// # Errors
    /// If there are none.
    pub fn new(motors: &[&str]) -> Result<Self, ScriptError> {
        if motors.is_empty() {
            return Err(ScriptError::NoMotors);
        }
        Ok(Self {
            motors: motors.iter().map(|&motor| motor.to_owned()).collect(),
            measures: false,
            variables: Self::variables_of(),
            state: State::default(),
        })
    }

    /// Also passes on the measured frequency of every motor.
    #[must_use]
    pub fn with_measurement(self, measures: bool) -> Self {
        Self { measures, ..self }
    }

    /// Returns the process variables with their defaults.
    pub fn variables_of() -> [ProcessVariable; 2] {
        [
            ProcessVariable::new("frequency", Unit::Hertz, 0.0..=FREQUENCY_MAX, 2.0),
            ProcessVariable::new(
                "acceleration",
                Unit::RadianPerSecondSquared,
                0.0..=1e4,
                12.5,
            ),
        ]
    }
}

impl Process for Turn {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        let of = |name: &'static str| move |motor: &String| signal::of_motor(motor, name);
        let motors = || self.motors.iter();
        let commands = motors().map(of("rate/command"));
        let mut ports: Vec<Port> = commands
            .map(|name| Port::output(name, Unit::RadianPerSecond, 1))
            .collect();
        if self.measures {
            let rates = motors().map(of("rate"));
            ports.extend(rates.map(|name| Port::input(name, Unit::RadianPerSecond, 1)));
            let frequencies = motors().map(of("frequency"));
            ports.extend(frequencies.map(|name| Port::output(name, Unit::Hertz, 1)));
        }
        ports
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.variables
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        let [target, acceleration] = [0, 1].map(|n: usize| self.variables[n].value());
        let most = acceleration / TAU * elapsed.as_secs_f64();
        let change = target - self.state.frequency;
        self.state.frequency += change.clamp(-most, most);
        let (commands, frequencies) = outputs.split_at_mut(self.motors.len());
        commands.fill(TAU * self.state.frequency);
        for (frequency, rate) in frequencies.iter_mut().zip(inputs) {
            *frequency = rate / TAU;
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(
            self.state,
            self.variables.each_ref().map(ProcessVariable::value),
        ))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, values): (State, [f64; 2]) = snapshot.read()?;
        restore_values(&mut self.variables, &values)?;
        self.state = state;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequency_is_reached_at_the_acceleration_and_kept() {
        let mut turn = Turn::new(&["cam"]).unwrap().with_measurement(true);
        turn.set_variable(0, 3.0).unwrap();
        let mut outputs = [0.0; 2];
        for n in 1..=200 {
            turn.step(SimDuration::from_millis(10), &[TAU * 2.5], &mut outputs);
            let expected = (0.125 / TAU * f64::from(n)).min(3.0);
            assert!((outputs[0] - TAU * expected).abs() < 1e-12);
            assert_eq!(outputs[1], 2.5);
        }
    }

    #[test]
    fn restored_controller_continues_bit_for_bit() {
        let mut turn = Turn::new(&["cam"]).unwrap();
        turn.step(SimDuration::from_millis(10), &[], &mut [0.0]);
        let mut other = Turn::new(&["cam"]).unwrap();
        other.restore(&turn.save()).unwrap();
        let (mut first, mut second) = ([0.0], [0.0]);
        turn.step(SimDuration::from_millis(10), &[], &mut first);
        other.step(SimDuration::from_millis(10), &[], &mut second);
        assert_eq!(first, second);
    }
}
