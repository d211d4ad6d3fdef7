//! Commands that were recorded once and are played to every plant.

use std::sync::mpsc::{Receiver, Sender, channel};

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};

/// What a plant is commanded over a scene: values that hold from one instant to the next.
///
/// Every plant of a study is played the same ones, so that what is compared is the plant and not how a controller answers it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Commands {
    layout: Layout,
    changes: Vec<Held>,
}

/// Values that hold from an instant on.
#[derive(Clone, Debug, PartialEq)]
struct Held {
    from: SimTime,
    values: Vec<f64>,
}

impl Commands {
    /// None: every plant keeps the commands it starts with.
    pub fn none() -> Self {
        Self::default()
    }

    /// Of these signals, at first with no values.
    pub fn of<'a>(ports: impl IntoIterator<Item = &'a Port>) -> Self {
        Self {
            layout: Layout::of(ports, Direction::Input),
            changes: Vec::new(),
        }
    }

    /// From `from` on, which is later than all before, `values` hold, end to end in the order of the signals. Values that
    /// already hold are not held again.
    pub fn hold(&mut self, from: SimTime, values: &[f64]) {
        if self.changes.last().is_none_or(|last| last.values != values) {
            self.changes.push(Held {
                from,
                values: values.to_vec(),
            });
        }
    }

    /// Whether they change on the way: a plant then steps no further than to the next change.
    pub fn change(&self) -> bool {
        self.changes.len() > 1
    }

    /// The shortest time between two changes.
    pub fn period(&self) -> Option<SimDuration> {
        let pairs = self.changes.windows(2);
        pairs.map(|pair| pair[1].from - pair[0].from).min()
    }

    /// Plays them to a plant with these ports, which starts with `first` inputs.
    pub(crate) fn player(&self, ports: &[Port], first: Vec<f64>) -> Player<'_> {
        let own = Layout::of(ports, Direction::Input);
        let mut wires = Vec::new();
        for field in own.fields() {
            if let Some(from) = self.layout.find(&field.port.name) {
                wires.extend(from.zip(field.range()));
            }
        }
        Player {
            commands: self,
            next: 0,
            wires,
            inputs: first,
        }
    }
}

/// Commands on their way to a plant.
pub(crate) struct Player<'a> {
    commands: &'a Commands,
    next: usize,
    /// From which value of the commands to which input of the plant.
    wires: Vec<(usize, usize)>,
    inputs: Vec<f64>,
}

impl Player<'_> {
    /// Makes the changes that are due at `now`.
    pub(crate) fn arrive(&mut self, now: SimTime) {
        while let Some(held) = self.commands.changes.get(self.next) {
            if held.from > now {
                break;
            }
            for &(from, to) in &self.wires {
                self.inputs[to] = held.values[from];
            }
            self.next += 1;
        }
    }

    /// When the next change is due.
    pub(crate) fn next(&self) -> Option<SimTime> {
        self.commands.changes.get(self.next).map(|held| held.from)
    }

    /// What holds.
    pub(crate) fn inputs(&self) -> &[f64] {
        &self.inputs
    }
}

/// A plant that remembers what it was commanded: put it into a rig, run the rig, and ask the [`Tape`].
pub struct Tapped {
    plant: Box<dyn Plant>,
    now: SimTime,
    heard: Sender<(SimTime, Vec<f64>)>,
    last: Vec<f64>,
}

/// The other end of a [`Tapped`] plant.
pub struct Tape {
    ports: Vec<Port>,
    heard: Receiver<(SimTime, Vec<f64>)>,
}

impl Tapped {
    /// Around `plant`, which is at the start of its run.
    pub fn new(plant: Box<dyn Plant>) -> (Self, Tape) {
        let (heard, tape) = channel();
        let tape = Tape {
            ports: plant.ports(),
            heard: tape,
        };
        let tapped = Self {
            plant,
            now: SimTime::ZERO,
            heard,
            last: Vec::new(),
        };
        (tapped, tape)
    }
}

impl Tape {
    /// What was commanded so far.
    pub fn commands(&self) -> Commands {
        let mut commands = Commands::of(&self.ports);
        for (from, values) in self.heard.try_iter() {
            commands.hold(from, &values);
        }
        commands
    }
}

impl Plant for Tapped {
    fn name(&self) -> &str {
        self.plant.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.plant.ports()
    }

    fn first_inputs(&self, inputs: &mut [f64]) {
        self.plant.first_inputs(inputs);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if self.last != inputs {
            self.last = inputs.to_vec();
            // Whoever dropped the tape does not want to know.
            let _ = self.heard.send((self.now, inputs.to_vec()));
        }
        self.plant.advance(to, inputs)?;
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        self.plant.observe(outputs);
    }

    fn begin_window(&mut self) {
        self.plant.begin_window();
    }

    fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }

    fn work(&self) -> WorkCounts {
        self.plant.work()
    }

    fn save(&self) -> Snapshot {
        self.plant.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.plant.restore(snapshot)
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::Unit;

    use super::*;

    #[test]
    fn signals_find_each_other_by_name_and_what_is_not_commanded_stays() {
        let port = |name| Port::input(name, Unit::Radian, 1);
        let mut commands = Commands::of(&[port("a"), port("b")]);
        commands.hold(SimTime::ZERO, &[1.0, 2.0]);
        commands.hold(SimTime::from_nanos(5), &[1.0, 2.0]);
        commands.hold(SimTime::from_nanos(10), &[3.0, 4.0]);
        assert!(commands.change());
        assert_eq!(commands.period(), Some(SimDuration::from_nanos(10)));
        let ports = [port("b"), port("c"), port("a")];
        let mut player = commands.player(&ports, vec![7.0; 3]);
        player.arrive(SimTime::ZERO);
        assert_eq!(player.inputs(), [2.0, 7.0, 1.0]);
        assert_eq!(player.next(), Some(SimTime::from_nanos(10)));
        player.arrive(SimTime::from_nanos(12));
        assert_eq!(
            (player.inputs(), player.next()),
            (&[4.0, 7.0, 3.0][..], None)
        );
    }
}
