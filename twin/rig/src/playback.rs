//! Recorded commands, played on a plant at their own times.

use twinrig_document::suggestion;
use twinrig_kernel::{Direction, Port, SimTime};
use twinrig_runtime::{Plant, PlantFault};

/// Values of a scalar signal over time, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimedValues {
    /// Times.
    pub times: Vec<SimTime>,
    /// Values.
    pub values: Vec<f64>,
}

/// Places of signals in the inputs and outputs of a plant.
#[derive(Clone, Debug)]
pub struct Playback {
    inputs: Vec<usize>,
    outputs: Vec<usize>,
    widths: [usize; 2],
}

/// Reason why a playback is impossible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaybackError {
    /// The plant has no such port.
    #[error("the plant has no {direction} `{name}`: {help}")]
    NoPort {
        /// `input` or `output`.
        direction: &'static str,
        /// Name of the signal.
        name: String,
        /// Its ports.
        help: String,
    },
    /// A signal has not the component, or more than one and none is named.
    #[error("`{name}` of the plant has {size} component(s): {help}")]
    Component {
        /// Name of the signal.
        name: String,
        /// Its components.
        size: usize,
        /// Remedy.
        help: &'static str,
    },
}

impl Playback {
    /// Finds the signals of a plant: `commands` are inputs of one component, `outputs` are to be
    /// observed, of which one with several components needs one to be named.
    ///
    /// # Errors
    /// [`PlaybackError`] for a name that the plant does not have.
    pub fn new<'n>(
        plant: &dyn Plant,
        commands: impl IntoIterator<Item = &'n str>,
        outputs: impl IntoIterator<Item = (&'n str, Option<usize>)>,
    ) -> Result<Self, PlaybackError> {
        let ports = plant.ports();
        let inputs = commands
            .into_iter()
            .map(|name| place(&ports, Direction::Input, name, None));
        let inputs = inputs.collect::<Result<_, _>>()?;
        let outputs = outputs
            .into_iter()
            .map(|(name, component)| place(&ports, Direction::Output, name, component));
        Ok(Self {
            inputs,
            outputs: outputs.collect::<Result<_, _>>()?,
            widths: [Direction::Input, Direction::Output].map(|direction| width(&ports, direction)),
        })
    }

    /// Plays commands from the present state of a plant at `from`, until the last sample, and
    /// returns the outputs at the times of the samples: those of a signal are before commands of
    /// the same instant. Inputs without a command keep their initial value.
    ///
    /// # Errors
    /// [`PlantFault`] of the plant.
    pub fn play(
        &self,
        plant: &mut dyn Plant,
        from: SimTime,
        commands: &[&TimedValues],
        samples: &[&[SimTime]],
    ) -> Result<Vec<Vec<f64>>, PlantFault> {
        let [mut inputs, mut outputs] = self.widths.map(|width| vec![0.0; width]);
        plant.initial_inputs(&mut inputs);
        let mut taken = vec![0; commands.len()];
        let mut played: Vec<Vec<f64>> = samples
            .iter()
            .map(|times| Vec::with_capacity(times.len()))
            .collect();
        let mut now = from;
        loop {
            for ((command, taken), input) in commands.iter().zip(&mut taken).zip(&self.inputs) {
                while command.times.get(*taken).is_some_and(|due| *due <= now) {
                    inputs[*input] = command.values[*taken];
                    *taken += 1;
                }
            }
            let sampled = samples.iter().zip(&played);
            let sampled = sampled.filter_map(|(times, values)| times.get(values.len()));
            let Some(sample) = sampled.min() else {
                return Ok(played);
            };
            let due = commands.iter().zip(&taken);
            let due = due.filter_map(|(command, taken)| command.times.get(*taken));
            let next = *due.chain([sample]).min().unwrap_or(sample);
            if next > now {
                plant.advance(next, &inputs)?;
                now = next;
            }
            if *sample <= now {
                plant.observe(&mut outputs);
                for ((times, values), output) in samples.iter().zip(&mut played).zip(&self.outputs)
                {
                    while times.get(values.len()).is_some_and(|time| *time <= now) {
                        values.push(outputs[*output]);
                    }
                }
            }
        }
    }
}

/// Returns the place of a component of a signal among the values of a direction.
fn place(
    ports: &[Port],
    direction: Direction,
    name: &str,
    component: Option<usize>,
) -> Result<usize, PlaybackError> {
    let own = || ports.iter().filter(|port| port.direction == direction);
    let mut start = 0;
    for port in own() {
        if port.name == name {
            let help = match component {
                Some(component) if component < port.size => return Ok(start + component),
                Some(_) => "name one of them, counted from 0",
                None if port.size == 1 => return Ok(start),
                None => "commands have one, a residual names one by `component`",
            };
            return Err(PlaybackError::Component {
                name: name.to_owned(),
                size: port.size,
                help,
            });
        }
        start += port.size;
    }
    Err(PlaybackError::NoPort {
        direction: if direction == Direction::Input {
            "input"
        } else {
            "output"
        },
        name: name.to_owned(),
        help: suggestion(name, "ports", own().map(|port| port.name.as_str())),
    })
}

fn width(ports: &[Port], direction: Direction) -> usize {
    let own = ports.iter().filter(|port| port.direction == direction);
    own.map(|port| port.size).sum()
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::Unit;

    use super::*;

    /// A plant whose output is the integral of its input.
    #[derive(Default)]
    struct Integrator {
        now: SimTime,
        sum: f64,
    }

    impl Plant for Integrator {
        fn name(&self) -> &'static str {
            "integrator"
        }

        fn ports(&self) -> Vec<Port> {
            vec![
                Port::input("other", Unit::One, 2),
                Port::input("rate", Unit::One, 1),
                Port::output("sum", Unit::One, 1),
                Port::output("pair", Unit::One, 2),
            ]
        }

        fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
            self.sum += inputs[2] * (to - self.now).as_secs_f64();
            self.now = to;
            Ok(())
        }

        fn observe(&mut self, outputs: &mut [f64]) {
            outputs.copy_from_slice(&[self.sum, -self.sum, self.sum + 2.0]);
        }
    }

    fn at(milliseconds: &[u64]) -> Vec<SimTime> {
        let nanos = milliseconds.iter().map(|it| it * 1_000_000);
        nanos.map(SimTime::from_nanos).collect()
    }

    #[test]
    fn commands_act_from_their_own_times_and_samples_are_before_them() {
        let mut plant = Integrator::default();
        let playback = Playback::new(&plant, ["rate"], [("sum", None), ("pair", Some(1))]).unwrap();
        let command = TimedValues {
            times: at(&[0, 100, 300]),
            values: vec![1.0, 10.0, 0.0],
        };
        let samples = [at(&[0, 100, 200, 1000]), at(&[250])];
        let samples: Vec<&[SimTime]> = samples.iter().map(Vec::as_slice).collect();
        let played = playback.play(&mut plant, SimTime::ZERO, &[&command], &samples);
        let played = played.unwrap();
        let expected = [vec![0.0, 0.1, 1.1, 2.1], vec![3.6]];
        for (played, expected) in played.iter().flatten().zip(expected.iter().flatten()) {
            assert!((played - expected).abs() < 1e-12, "{played} {expected}");
        }
        assert_eq!(played.iter().map(Vec::len).collect::<Vec<_>>(), [4, 1]);
    }

    #[test]
    fn unknown_signals_are_reported() {
        let plant = Integrator::default();
        let why = |command, output, component| {
            let error = Playback::new(&plant, [command], [(output, component)]).unwrap_err();
            error.to_string()
        };
        assert!(why("rat", "sum", None).contains("`rate`"));
        assert!(why("rate", "rate", None).contains("no output `rate`"));
        assert!(why("other", "sum", None).contains("has 2 component(s)"));
        assert!(why("rate", "sum", Some(1)).contains("counted from 0"));
    }
}
