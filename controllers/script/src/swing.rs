//! The controller `swing`.

use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Process, ProcessVariable, restore_values};

use crate::Shape;

/// Greatest angle \[rad\] and frequency \[Hz\]: more than a turn, faster than any servo.
const ANGLE_MAX: f64 = 10.0;
const FREQUENCY_MAX: f64 = 100.0;

/// Commands the position of a servo on its bench by a shape, `servo/command` \[rad\], and whether
/// its torque is on, `servo/enable` \[1\].
///
/// # Process variables
///
/// | name | unit | range | default | meaning |
/// |---|---|---|---|---|
/// | `offset` | rad | −10 to 10 | 0 | middle of the motion |
/// | `amplitude` | rad | 0 to 10 | 0.5 | of the shape |
/// | `frequency` | Hz | 0 to 100 | 0.5 | cycles per second |
/// | `enable` | 1 | 0 to 1 | 1 | torque on; 0: the arm swings freely |
#[derive(Debug, Clone)]
pub struct Swing {
    shape: Shape,
    variables: [ProcessVariable; 4],
    /// Cycles since the start.
    cycles: f64,
}

impl Swing {
    /// Name in scenarios.
    pub const NAME: &'static str = "swing";

    /// Creates a controller with a shape.
    pub fn new(shape: Shape) -> Self {
        Self {
            shape,
            variables: Self::variables_of(),
            cycles: 0.0,
        }
    }

    /// Returns the process variables with their defaults.
    pub fn variables_of() -> [ProcessVariable; 4] {
        [
            ProcessVariable::new("offset", Unit::Radian, -ANGLE_MAX..=ANGLE_MAX, 0.0),
            ProcessVariable::new("amplitude", Unit::Radian, 0.0..=ANGLE_MAX, 0.5),
            ProcessVariable::new("frequency", Unit::Hertz, 0.0..=FREQUENCY_MAX, 0.5),
            ProcessVariable::new("enable", Unit::One, 0.0..=1.0, 1.0),
        ]
    }
}

impl Process for Swing {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::output("servo/command", Unit::Radian, 1),
            Port::output("servo/enable", Unit::One, 1),
        ]
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.variables
    }

    fn step(&mut self, elapsed: SimDuration, _: &[f64], outputs: &mut [f64]) {
        let [offset, amplitude, frequency, enable] =
            self.variables.each_ref().map(ProcessVariable::value);
        self.cycles += frequency * elapsed.as_secs_f64();
        outputs[0] = offset + amplitude * self.shape.at(self.cycles);
        outputs[1] = enable;
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(
            self.cycles,
            self.variables.each_ref().map(ProcessVariable::value),
        ))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (cycles, values): (f64, [f64; 4]) = snapshot.read()?;
        restore_values(&mut self.variables, &values)?;
        self.cycles = cycles;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_follows_the_shape_and_continues_after_restoring() {
        let mut swing = Swing::new(Shape::Sine);
        swing.variables_mut()[0].set(0.2).unwrap();
        let mut outputs = [0.0; 2];
        swing.step(SimDuration::ZERO, &[], &mut outputs);
        assert_eq!(outputs, [0.2, 1.0]);
        swing.step(SimDuration::from_millis(500), &[], &mut outputs);
        assert!((outputs[0] - 0.7).abs() < 1e-12, "{outputs:?}");
        swing.variables_mut()[3].set(0.0).unwrap();
        let mut restored = Swing::new(Shape::Sine);
        restored.restore(&swing.save()).unwrap();
        for process in [&mut swing, &mut restored] {
            process.step(SimDuration::from_millis(500), &[], &mut outputs);
            assert!((outputs[0] - 0.2).abs() < 1e-12 && outputs[1] == 0.0);
        }
    }
}
