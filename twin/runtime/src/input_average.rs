use serde::{Deserialize, Serialize};
use twinrig_kernel::{Layout, SimDuration, SimTime, Unit};

/// Mean of the commands over a grid step.
///
/// Values are accumulated at changes and at the end of the step only, never at observations: those
/// change no bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputAverage {
    start: SimTime,
    step: SimDuration,
    inputs: Vec<Input>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Input {
    /// Value at the beginning of the step, present value, and time of the last accumulation.
    first: f64,
    value: f64,
    since: SimTime,
    /// Integral of `value − first` until `since`.
    excess: f64,
    /// A dimensionless switch, which has no mean.
    switch: bool,
}

impl Input {
    fn begin(&mut self, at: SimTime, value: f64) {
        (self.first, self.value, self.since, self.excess) = (value, value, at, 0.0);
    }

    /// Accumulates the integral until `at`.
    fn accumulate(&mut self, at: SimTime) {
        // A constant command is its own mean, bit for bit.
        if self.value != self.first {
            self.excess += (at - self.since).as_secs_f64() * (self.value - self.first);
        }
        self.since = at;
    }
}

impl InputAverage {
    pub(crate) fn new(inputs: &Layout, step: SimDuration) -> Self {
        let inputs = inputs.fields().flat_map(|field| {
            let input = Input {
                first: 0.0,
                value: 0.0,
                since: SimTime::ZERO,
                excess: 0.0,
                switch: field.port.unit == Unit::One,
            };
            std::iter::repeat_n(input, field.port.size)
        });
        Self {
            start: SimTime::ZERO,
            step,
            inputs: inputs.collect(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.inputs.len()
    }

    /// Returns whether the times are consistent: a snapshot may contain arbitrary values.
    pub(crate) fn is_consistent(&self) -> bool {
        let mut since = self.inputs.iter().map(|input| input.since);
        since.all(|since| since >= self.start)
    }

    /// Begins a step with the commands `inputs`.
    pub(crate) fn begin(&mut self, at: SimTime, inputs: &[f64]) {
        self.start = at;
        for (input, value) in self.inputs.iter_mut().zip(inputs) {
            input.begin(at, *value);
        }
    }

    /// Resets the beginning of the step; its commands are not known yet.
    pub(crate) fn reset(&mut self, at: SimTime) {
        self.start = at;
        for input in &mut self.inputs {
            input.begin(at, 0.0);
        }
    }

    /// Changes the commands to `values` at time `at`.
    pub(crate) fn change(&mut self, at: SimTime, values: &[f64]) {
        let offset = at - self.start;
        if offset.is_zero() {
            return self.begin(at, values);
        }
        let in_first_half = offset <= self.step - offset;
        for (input, value) in self.inputs.iter_mut().zip(values) {
            if input.switch {
                if in_first_half {
                    input.first = *value;
                }
            } else if input.value != *value {
                input.accumulate(at);
                input.value = *value;
            }
        }
    }

    /// Writes the means over the step, which ends at `end`.
    pub(crate) fn mean(&mut self, end: SimTime, means: &mut [f64]) {
        let step_s = self.step.as_secs_f64();
        for (input, mean) in self.inputs.iter_mut().zip(means) {
            if input.switch {
                *mean = input.first;
                continue;
            }
            input.accumulate(end);
            // Adding zero would turn −0 into +0.
            *mean = if input.excess == 0.0 {
                input.first
            } else {
                input.first + input.excess / step_s
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{Direction, Port};

    use super::*;

    fn at(micros: u64) -> SimTime {
        SimTime::ZERO + SimDuration::from_micros(micros)
    }

    fn average() -> InputAverage {
        let ports = [
            Port::input("voltage", Unit::Volt, 1),
            Port::input("bridge", Unit::One, 1),
        ];
        let layout = Layout::of(&ports, Direction::Input);
        InputAverage::new(&layout, SimDuration::from_micros(100))
    }

    #[test]
    fn commands_are_averaged_and_switches_take_their_midstep_value() {
        let mut average = average();
        average.begin(at(0), &[1.0, 0.0]);
        average.change(at(25), &[3.0, 0.0]);
        average.change(at(50), &[3.0, 1.0]);
        average.change(at(75), &[-1.0, 0.0]);
        let mut means = [0.0; 2];
        average.mean(at(100), &mut means);
        assert!((means[0] - 1.5).abs() < 1e-12, "{means:?}");
        assert_eq!(means[1], 1.0);
        average.begin(at(100), &[-1.0, 0.0]);
        average.change(at(151), &[-1.0, 1.0]);
        average.mean(at(200), &mut means);
        assert_eq!(means, [-1.0, 0.0]);
    }

    #[test]
    fn constant_command_is_its_own_mean() {
        for value in [-0.0, 0.1, f64::MAX] {
            let mut average = average();
            average.begin(at(0), &[value, value]);
            for micros in [13, 29, 71] {
                average.change(at(micros), &[value, value]);
            }
            let mut means = [1.0; 2];
            average.mean(at(100), &mut means);
            assert_eq!(means.map(f64::to_bits), [value.to_bits(); 2]);
        }
    }

    #[test]
    fn nan_command_has_a_nan_mean() {
        let mut average = average();
        average.begin(at(0), &[1.0, 0.0]);
        average.change(at(10), &[f64::NAN, 0.0]);
        average.change(at(20), &[1.0, 0.0]);
        let mut means = [0.0; 2];
        average.mean(at(100), &mut means);
        assert!(means[0].is_nan());
    }
}
