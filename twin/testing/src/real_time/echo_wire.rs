use std::collections::VecDeque;
use std::ops::Range;

use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{
    Part, Plant, PlantAccess, PlantFault, PlantSignals, TaskError, Wire, WiringError,
};

/// Answers after 100 µs and actuates the plant with each answer.
#[derive(Default)]
pub struct EchoWire {
    received: Vec<u8>,
    answers: VecDeque<(SimTime, Vec<u8>)>,
    readable: Vec<u8>,
    answered: f64,
    drive: Range<usize>,
}

const TAKES: SimDuration = SimDuration::from_micros(100);

fn drive() -> Port {
    Port::output("drive", Unit::Volt, 1)
}

impl Part for EchoWire {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.drive = plant.find(owner, &drive())?;
        Ok(())
    }

    fn diagnostics(&self) -> Vec<Port> {
        vec![Port::output("echo/answered", Unit::One, 1)]
    }

    fn read_diagnostics(&self, _: SimTime, values: &mut [f64]) {
        values[0] = self.answered;
    }
}

impl Wire for EchoWire {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        self.received.extend(bytes);
        let answers = super::answer(&mut self.received);
        if !answers.is_empty() {
            self.answers.push_back((now + TAKES, answers));
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.answers.front().map(|(at, _)| *at)
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while self.next_wake().is_some_and(|at| at <= now) {
            let (_, bytes) = self.answers.pop_front().unwrap_or_default();
            plant.actuate(self.drive.clone())?[0] = 1.0;
            self.readable.extend(bytes);
            self.answered += 1.0;
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.readable);
    }
}

/// Plant with one output: its time in seconds.
#[derive(Default)]
pub struct Lag {
    /// The output.
    pub seconds: f64,
    /// Present time.
    pub now: SimTime,
    /// Fails when it is advanced to this time or further.
    pub fails_at: Option<SimTime>,
    /// Panics when it is advanced to this time or further.
    pub panics_at: Option<SimTime>,
    /// Wall-clock time of each step.
    pub takes: std::time::Duration,
}

impl Plant for Lag {
    fn name(&self) -> &'static str {
        "lag"
    }
    fn ports(&self) -> Vec<Port> {
        vec![drive().mirrored(), Port::output("time", Unit::Second, 1)]
    }
    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        assert!(to > self.now, "a plant is never moved back");
        self.now = to;
        assert!(
            self.panics_at.is_none_or(|at| to < at),
            "requested by the test"
        );
        if !self.takes.is_zero() {
            std::thread::sleep(self.takes);
        }
        self.seconds = to.as_secs_f64();
        match self.fails_at.filter(|at| to >= *at) {
            None => Ok(()),
            Some(time) => Err(PlantFault {
                time,
                part: "lag".into(),
                energy: 0.0,
                why: "it broke".into(),
            }),
        }
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        outputs[0] = self.seconds;
    }
}

/// Receives bytes and never transmits.
pub struct SilentWire;

impl Part for SilentWire {}

impl Wire for SilentWire {
    fn send(&mut self, _: SimTime, _: &[u8]) {}

    fn next_wake(&self) -> Option<SimTime> {
        None
    }

    fn advance(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        Ok(())
    }

    fn receive(&mut self, _: &mut Vec<u8>) {}
}
