//! Left of the wire: what runs on the robot. It has no clock and no port; it is told the time and handed the bytes.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{HostTime, Port, Snapshot, SnapshotError, Unit};
use twinrig::runtime::{Driver, DriverError, Transfer};
use twinrig_wire::{Framer, FramerState};

use crate::protocol::{ASK, decode, measure};

/// How long it waits for an answer \[ns\].
const PATIENCE_NS: u64 = 50_000_000;
/// How often it asks at the beginning before it gives up.
const ATTEMPTS: u32 = 3;

pub struct RangeFinder {
    name: String,
    framer: Framer,
    state: State,
}

/// Everything that changes: what is saved and restored.
#[derive(Default, Serialize, Deserialize)]
struct State {
    /// When waiting for an answer is over; none if nothing is waited for.
    until: Option<HostTime>,
    to_send: bool,
    /// How often it may still ask until the device is open.
    attempts_left: u32,
    failed: bool,
    /// The newest distance \[m\].
    distance: f64,
    answers: u64,
    lost: u64,
}

impl RangeFinder {
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            framer: Framer::new(measure),
            state: State::default(),
        }
    }

    fn ask(&mut self, now: HostTime) {
        self.state.to_send = true;
        self.state.until = Some(HostTime::from_nanos(now.as_nanos() + PATIENCE_NS));
    }
}

impl Driver for RangeFinder {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        let name = format!("{}/distance", self.name);
        vec![Port::output(name, Unit::Meter, 1)]
    }

    fn open(&mut self, now: HostTime) {
        self.state.attempts_left = ATTEMPTS - 1;
        self.ask(now);
    }

    fn begin(&mut self, now: HostTime, _from_process: &[f64]) {
        self.ask(now);
    }

    fn close(&mut self, _now: HostTime) {
        // There is nothing to be left safe.
        self.state.until = None;
    }

    fn handle_bytes(&mut self, _now: HostTime, bytes: &[u8]) {
        self.framer.push(bytes);
        while let Some(frame) = self.framer.next_frame() {
            if let Some(millimetres) = decode(frame) {
                self.state.distance = f64::from(millimetres) * 1e-3;
                self.state.answers += 1;
                self.state.attempts_left = 0;
                self.state.until = None;
            }
        }
    }

    fn handle_timeout(&mut self, now: HostTime) {
        if self.state.until.is_none_or(|until| now < until) {
            return;
        }
        self.state.lost += 1;
        self.state.until = None;
        if self.state.attempts_left > 0 {
            self.state.attempts_left -= 1;
            self.ask(now);
        } else if self.state.answers == 0 {
            self.state.failed = true;
        }
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        self.state.until
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let to_send = std::mem::take(&mut self.state.to_send);
        if to_send {
            bytes.push(ASK);
        }
        to_send
    }

    fn poll_transfer(&mut self) -> Result<Transfer, DriverError> {
        if self.state.failed {
            let why = format!(
                "{} does not answer: is it there, at the right port?",
                self.name
            );
            return Err(DriverError { why });
        }
        Ok(match self.state.until {
            Some(_) => Transfer::Busy,
            None => Transfer::Done,
        })
    }

    fn to_process(&self) -> &[f64] {
        std::slice::from_ref(&self.state.distance)
    }

    fn gauges(&self) -> Vec<Port> {
        let gauge = |what, unit| Port::output(format!("{}/{what}", self.name), unit, 1);
        vec![
            gauge("answers", Unit::One),
            gauge("lost", Unit::One),
            gauge("last", Unit::Meter),
        ]
    }

    fn read_gauges(&self, values: &mut [f64]) {
        let State {
            answers,
            lost,
            distance,
            ..
        } = self.state;
        values.copy_from_slice(&[answers as f64, lost as f64, distance]);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, self.framer.state()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, framer): (State, FramerState) = snapshot.read()?;
        self.state = state;
        self.framer.set_state(framer);
        Ok(())
    }
}
