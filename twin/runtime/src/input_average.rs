use serde::{Deserialize, Serialize};
use twinrig_kernel::{Layout, SimDuration, SimTime, Unit};

/// What was commanded since a step began, for its mean over that step.
///
/// A command is counted when it changes and when the step is over, never at looks between: they change no bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputAverage {
    begun: SimTime,
    step: SimDuration,
    inputs: Vec<Input>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Input {
    /// What it was as the step began; what it is, and since when.
    first: f64,
    value: f64,
    since: SimTime,
    /// Integral of what it was less what it was first, until then.
    more: f64,
    /// It has no mean.
    switch: bool,
}

impl Input {
    fn begin(&mut self, at: SimTime, value: f64) {
        (self.first, self.value, self.since, self.more) = (value, value, at, 0.0);
    }

    /// Counts what it has been until `at`.
    fn count(&mut self, at: SimTime) {
        // What never changed has its own value for a mean, to the bit.
        if self.value != self.first {
            self.more += (at - self.since).as_secs_f64() * (self.value - self.first);
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
                more: 0.0,
                switch: field.port.unit == Unit::One,
            };
            std::iter::repeat_n(input, field.port.size)
        });
        Self {
            begun: SimTime::ZERO,
            step,
            inputs: inputs.collect(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.inputs.len()
    }

    /// Whether it can be of a run: a snapshot may be of anything.
    pub(crate) fn is_sound(&self) -> bool {
        let mut since = self.inputs.iter().map(|input| input.since);
        since.all(|since| since >= self.begun)
    }

    /// A step begins, under `inputs`.
    pub(crate) fn begin(&mut self, at: SimTime, inputs: &[f64]) {
        self.begun = at;
        for (input, value) in self.inputs.iter_mut().zip(inputs) {
            input.begin(at, *value);
        }
    }

    /// A step will begin, nobody knows under what.
    pub(crate) fn reset(&mut self, at: SimTime) {
        self.begun = at;
        for input in &mut self.inputs {
            input.begin(at, 0.0);
        }
    }

    /// From `at` on they are `values`.
    pub(crate) fn change(&mut self, at: SimTime, values: &[f64]) {
        let into = at - self.begun;
        if into.is_zero() {
            return self.begin(at, values);
        }
        let in_first_half = into <= self.step - into;
        for (input, value) in self.inputs.iter_mut().zip(values) {
            if input.switch {
                if in_first_half {
                    input.first = *value;
                }
            } else if input.value != *value {
                input.count(at);
                input.value = *value;
            }
        }
    }

    /// Writes their means over the step, which is over at `end`.
    pub(crate) fn mean(&mut self, end: SimTime, means: &mut [f64]) {
        let step_s = self.step.as_secs_f64();
        for (input, mean) in self.inputs.iter_mut().zip(means) {
            if input.switch {
                *mean = input.first;
                continue;
            }
            input.count(end);
            // Not by adding nothing, which would make +0 of −0.
            *mean = if input.more == 0.0 {
                input.first
            } else {
                input.first + input.more / step_s
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

    fn given() -> InputAverage {
        let ports = [
            Port::input("voltage", Unit::Volt, 1),
            Port::input("bridge", Unit::One, 1),
        ];
        let layout = Layout::of(&ports, Direction::Input);
        InputAverage::new(&layout, SimDuration::from_micros(100))
    }

    #[test]
    fn commands_have_a_mean_and_switches_are_what_they_are_in_the_middle() {
        let mut given = given();
        given.begin(at(0), &[1.0, 0.0]);
        given.change(at(25), &[3.0, 0.0]);
        given.change(at(50), &[3.0, 1.0]);
        given.change(at(75), &[-1.0, 0.0]);
        let mut means = [0.0; 2];
        given.mean(at(100), &mut means);
        assert!((means[0] - 1.5).abs() < 1e-12, "{means:?}");
        assert_eq!(means[1], 1.0);
        given.begin(at(100), &[-1.0, 0.0]);
        given.change(at(151), &[-1.0, 1.0]);
        given.mean(at(200), &mut means);
        assert_eq!(means, [-1.0, 0.0]);
    }

    #[test]
    fn a_command_that_does_not_change_is_its_own_mean() {
        for value in [-0.0, 0.1, f64::MAX] {
            let mut given = given();
            given.begin(at(0), &[value, value]);
            for micros in [13, 29, 71] {
                given.change(at(micros), &[value, value]);
            }
            let mut means = [1.0; 2];
            given.mean(at(100), &mut means);
            assert_eq!(means.map(f64::to_bits), [value.to_bits(); 2]);
        }
    }

    #[test]
    fn what_is_no_number_stays_none() {
        let mut given = given();
        given.begin(at(0), &[1.0, 0.0]);
        given.change(at(10), &[f64::NAN, 0.0]);
        given.change(at(20), &[1.0, 0.0]);
        let mut means = [0.0; 2];
        given.mean(at(100), &mut means);
        assert!(means[0].is_nan());
    }
}
