//! Commands, recorded once and replayed to every plant.

use std::sync::mpsc::{Receiver, Sender, channel};

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime};
use twinrig_runtime::{Plant, PlantFault};

/// Commands of a run: piecewise constant input values.
///
/// Every plant of a study receives the same commands, so that the comparison excludes the response
/// of a controller.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Commands {
    layout: Layout,
    changes: Vec<HeldValues>,
}

/// Input values, constant from an instant on.
#[derive(Clone, Debug, PartialEq)]
struct HeldValues {
    from: SimTime,
    values: Vec<f64>,
}

impl HeldValues {
    fn start_s(&self) -> f64 {
        self.from.as_secs_f64()
    }
}

impl Commands {
    /// No commands: every plant keeps its initial inputs.
    pub fn none() -> Self {
        Self::default()
    }

    /// Commands for the input signals in `ports`, initially without values.
    pub fn of<'a>(ports: impl IntoIterator<Item = &'a Port>) -> Self {
        Self {
            layout: Layout::of(ports, Direction::Input),
            changes: Vec::new(),
        }
    }

    /// Appends `values`, in the order of the signals, constant from `from` on, which must be later
    /// than all instants before. Values equal to the present ones are not stored again.
    pub fn hold(&mut self, from: SimTime, values: &[f64]) {
        if self.changes.last().is_none_or(|last| last.values != values) {
            self.changes.push(HeldValues {
                from,
                values: values.to_vec(),
            });
        }
    }

    /// Returns these commands played at `speed` times their speed, with changes at the same
    /// instants and values interpolated linearly. The last ones hold from the end on.
    #[must_use]
    pub(crate) fn at_speed(&self, speed: f64) -> Self {
        let mut played = Self {
            layout: self.layout.clone(),
            changes: Vec::new(),
        };
        let instants: Vec<f64> = self.changes.iter().map(HeldValues::start_s).collect();
        for (change, own_s) in self.changes.iter().zip(&instants) {
            let at_s = own_s * speed;
            let after = instants.partition_point(|&from_s| from_s <= at_s);
            let (Some(before), next) = (after.checked_sub(1), self.changes.get(after)) else {
                continue;
            };
            let values = &self.changes[before].values;
            let mixed: Vec<f64> = match next {
                None => values.clone(),
                Some(next) => {
                    let share = (at_s - instants[before]) / (instants[after] - instants[before]);
                    let pairs = values.iter().zip(&next.values);
                    pairs.map(|(a, b)| a + share * (b - a)).collect()
                }
            };
            played.hold(change.from, &mixed);
        }
        played
    }

    /// Returns whether the commands change during the run. A plant step ends at each change.
    pub fn change(&self) -> bool {
        self.changes.len() > 1
    }

    /// Returns the shortest time between two changes.
    pub fn period(&self) -> Option<SimDuration> {
        let pairs = self.changes.windows(2);
        pairs.map(|pair| pair[1].from - pair[0].from).min()
    }

    /// Returns a player for a plant with these ports and `first` as initial inputs.
    pub(crate) fn player(&self, ports: &[Port], first: Vec<f64>) -> Player<'_> {
        let layout = Layout::of(ports, Direction::Input);
        let mut map = Vec::new();
        for field in layout.fields() {
            if let Some(from) = self.layout.find(&field.port.name) {
                map.extend(from.zip(field.range()));
            }
        }
        Player {
            commands: self,
            next: 0,
            map,
            inputs: first,
        }
    }
}

/// Replay of commands to one plant.
pub(crate) struct Player<'a> {
    commands: &'a Commands,
    next: usize,
    /// Pairs (index in the command values, index in the plant inputs).
    map: Vec<(usize, usize)>,
    inputs: Vec<f64>,
}

impl Player<'_> {
    /// Applies the changes due at `now`.
    pub(crate) fn apply_due(&mut self, now: SimTime) {
        while let Some(change) = self.commands.changes.get(self.next) {
            if change.from > now {
                break;
            }
            for &(from, to) in &self.map {
                self.inputs[to] = change.values[from];
            }
            self.next += 1;
        }
    }

    /// Returns the time of the next change.
    pub(crate) fn next(&self) -> Option<SimTime> {
        self.commands
            .changes
            .get(self.next)
            .map(|change| change.from)
    }

    /// Returns the present inputs.
    pub(crate) fn inputs(&self) -> &[f64] {
        &self.inputs
    }
}

/// Plant wrapper that records the commands the plant receives: put it into a rig, run the rig, and
/// read the [`CommandTape`].
pub struct CommandRecorder {
    plant: Box<dyn Plant>,
    now: SimTime,
    commands: Sender<(SimTime, Vec<f64>)>,
    last: Vec<f64>,
}

/// Receiver of the commands recorded by a [`CommandRecorder`].
pub struct CommandTape {
    ports: Vec<Port>,
    commands: Receiver<(SimTime, Vec<f64>)>,
}

impl CommandRecorder {
    /// Wraps `plant`, which must be at time zero.
    pub fn new(plant: Box<dyn Plant>) -> (Self, CommandTape) {
        let (commands, tape) = channel();
        let tape = CommandTape {
            ports: plant.ports(),
            commands: tape,
        };
        let tapped = Self {
            plant,
            now: SimTime::ZERO,
            commands,
            last: Vec::new(),
        };
        (tapped, tape)
    }
}

impl CommandTape {
    /// Returns the commands recorded since the last call.
    pub fn commands(&self) -> Commands {
        let mut commands = Commands::of(&self.ports);
        for (from, values) in self.commands.try_iter() {
            commands.hold(from, &values);
        }
        commands
    }
}

impl Plant for CommandRecorder {
    fn inner(&self) -> Option<&dyn Plant> {
        Some(&*self.plant)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Plant> {
        Some(&mut *self.plant)
    }

    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.plant.ports()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if self.last != inputs {
            self.last = inputs.to_vec();
            // A dropped receiver ends the recording; the run continues.
            let _ = self.commands.send((self.now, inputs.to_vec()));
        }
        self.plant.advance(to, inputs)?;
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        self.plant.observe(outputs);
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::Unit;

    use super::*;

    #[test]
    fn commands_are_played_faster_at_their_own_instants() {
        let mut commands = Commands::of(&[Port::input("a", Unit::Radian, 1)]);
        for ms in 0..10_u32 {
            commands.hold(
                SimTime::from_nanos(u64::from(ms) * 1_000_000),
                &[f64::from(ms)],
            );
        }
        assert_eq!(commands.at_speed(1.0), commands);
        for (speed, expected) in [(2.0, [0.0, 2.0, 4.0, 6.0]), (0.5, [0.0, 0.5, 1.0, 1.5])] {
            let played = commands.at_speed(speed);
            let found = played.changes.iter().map(|change| change.values[0]);
            let found: Vec<f64> = found.take(4).collect();
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-12)
            );
            assert_eq!(played.period(), commands.period());
        }
        // From its end on the last command holds.
        let last = commands.at_speed(2.0).changes.pop().unwrap();
        assert_eq!((last.from.as_nanos(), last.values[0]), (5_000_000, 9.0));
    }

    #[test]
    fn commands_are_matched_by_name_and_other_inputs_are_kept() {
        let port = |name| Port::input(name, Unit::Radian, 1);
        let mut commands = Commands::of(&[port("a"), port("b")]);
        commands.hold(SimTime::ZERO, &[1.0, 2.0]);
        commands.hold(SimTime::from_nanos(5), &[1.0, 2.0]);
        commands.hold(SimTime::from_nanos(10), &[3.0, 4.0]);
        assert!(commands.change());
        assert_eq!(commands.period(), Some(SimDuration::from_nanos(10)));
        let ports = [port("b"), port("c"), port("a")];
        let mut player = commands.player(&ports, vec![7.0; 3]);
        player.apply_due(SimTime::ZERO);
        assert_eq!(player.inputs(), [2.0, 7.0, 1.0]);
        assert_eq!(player.next(), Some(SimTime::from_nanos(10)));
        player.apply_due(SimTime::from_nanos(12));
        assert_eq!(
            (player.inputs(), player.next()),
            (&[4.0, 7.0, 3.0][..], None)
        );
    }
}
