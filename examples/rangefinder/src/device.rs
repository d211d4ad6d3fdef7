//! Right of the wire: what stands in for the device. It hears bytes, and sees a signal of the plant.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig::runtime::{PlantSignals, TaskError, WiringError, World};
use twinrig_wire::{Node, Piece, Tap};

use crate::protocol::{ASK, MILLIMETRES_MAX, encode};

/// How long a measurement takes.
const MEASURING: SimDuration = SimDuration::from_millis(5);

pub struct EmulatedRangeFinder {
    name: String,
    /// What it measures \[m\].
    tap: Tap,
    place: usize,
    state: State,
}

#[derive(Default, Serialize, Deserialize)]
struct State {
    /// When it is asked for, and not measured yet.
    measured_at: Option<SimTime>,
    to_say: Option<(SimTime, Vec<u8>)>,
}

impl EmulatedRangeFinder {
    pub fn new(name: &str, tap: Tap) -> Self {
        Self {
            name: name.to_owned(),
            tap,
            place: 0,
            state: State::default(),
        }
    }
}

impl Node for EmulatedRangeFinder {
    fn name(&self) -> &str {
        &self.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.place = self.tap.find(owner, plant)?;
        Ok(())
    }

    fn hear(&mut self, piece: Piece<'_>) {
        let asked = piece.bytes.iter().position(|&byte| byte == ASK);
        if let Some(asked) = asked {
            // A measurement that is going on goes on.
            let at = piece.at(asked) + MEASURING;
            self.state.measured_at.get_or_insert(at);
        }
    }

    fn attention(&self) -> Option<usize> {
        Some(1)
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.state.measured_at
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        if self.state.measured_at.is_some_and(|at| at <= now) {
            self.state.measured_at = None;
            let seen = world.sample(self.place..self.place + 1)?[0];
            let millimetres = (1e3 * self.tap.reading(seen)).round();
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "clamped; what is no number becomes 0"
            )]
            let millimetres = millimetres.clamp(0.0, f64::from(MILLIMETRES_MAX)) as u32;
            let mut answer = Vec::new();
            encode(millimetres, &mut answer);
            self.state.to_say = Some((now, answer));
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, answer) = self.state.to_say.take()?;
        bytes.extend(answer);
        Some(start)
    }

    fn gauges(&self) -> Vec<Port> {
        Vec::new()
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        Ok(())
    }
}
