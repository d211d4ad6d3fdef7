//! A mass on a spring whose motion is known in closed form, and boards that act on it.
#![allow(dead_code, reason = "each test uses some of it")]

use std::collections::VecDeque;

use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{EnergyBalance, Plant, PlantEvent, PlantEventKind, PlantFault, WorkCounts};

#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// \[rad/s\]
    pub frequency: f64,
    pub tells_velocity: bool,
    /// Its force acts so late.
    pub delay_us: u64,
    /// It tells of an angle between −π and π and of an orientation instead, which turn evenly.
    pub turns: bool,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            frequency: 40.0,
            tells_velocity: true,
            delay_us: 0,
            turns: false,
        }
    }
}

/// Angular velocity of what turns \[rad/s\].
const TURNS: f64 = 11.0;

/// A kilogram, moved from 1 m by the exact solution under each force, so that steps of whatever length end where they should.
pub struct Oscillator {
    shape: Shape,
    now: SimTime,
    position: f64,
    velocity: f64,
    steps: u64,
    /// Forces that were given and do not act yet, with when they will; and the one that does.
    coming: VecDeque<(SimTime, f64)>,
    last: f64,
    force: f64,
    log: Option<Vec<PlantEvent>>,
}

impl Oscillator {
    pub fn new(shape: Shape) -> Self {
        Self {
            shape,
            now: SimTime::ZERO,
            position: 1.0,
            velocity: 0.0,
            steps: 0,
            coming: VecDeque::new(),
            last: 0.0,
            force: 0.0,
            log: None,
        }
    }

    /// Where it is without force.
    pub fn free(shape: Shape, at: SimTime) -> f64 {
        libm::cos(shape.frequency * at.as_secs_f64())
    }

    /// The angle that it tells of, counted on.
    pub fn turned(at: SimTime) -> f64 {
        TURNS * at.as_secs_f64()
    }

    fn go(&mut self, to: SimTime) {
        let w = self.shape.frequency;
        let phase = w * (to - self.now).as_secs_f64();
        let (sin, cos) = (libm::sin(phase), libm::cos(phase));
        let rest = self.force / (w * w);
        let (from, velocity) = (self.position - rest, self.velocity);
        self.position = rest + from * cos + velocity / w * sin;
        self.velocity = velocity * cos - from * w * sin;
        let crossed = (self.position < 0.0) != (from + rest < 0.0);
        if let Some(log) = self.log.as_mut().filter(|_| crossed) {
            log.push(PlantEvent {
                at_s: f64::midpoint(self.now.as_secs_f64(), to.as_secs_f64()),
                part: "mass".to_owned(),
                kind: PlantEventKind::Reached,
            });
        }
        self.now = to;
    }
}

impl Plant for Oscillator {
    fn name(&self) -> &'static str {
        "oscillator"
    }
    fn ports(&self) -> Vec<Port> {
        let mut ports = vec![Port::input("mass/force", Unit::Newton, 1)];
        if self.shape.turns {
            ports.push(Port::output("mass/angle", Unit::Radian, 1));
            ports.push(Port::output("mass/orientation", Unit::One, 4));
            return ports;
        }
        ports.push(Port::output("mass/position", Unit::Meter, 1));
        if self.shape.tells_velocity {
            ports.push(Port::output("mass/velocity", Unit::MeterPerSecond, 1));
        }
        ports
    }
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.steps += 1;
        if inputs[0] != self.last {
            self.last = inputs[0];
            let acts = self.now + SimDuration::from_micros(self.shape.delay_us);
            self.coming.push_back((acts, inputs[0]));
        }
        while let Some(&(acts, force)) = self.coming.front().filter(|(acts, _)| *acts < to) {
            if acts > self.now {
                self.go(acts);
            }
            self.force = force;
            self.coming.pop_front();
        }
        self.go(to);
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        if self.shape.turns {
            let angle = Self::turned(self.now);
            outputs[0] = libm::atan2(libm::sin(angle), libm::cos(angle));
            // Whichever of the two signs.
            let half = outputs[0] / 2.0;
            outputs[1..].copy_from_slice(&[libm::cos(half), 0.0, 0.0, libm::sin(half)]);
            return;
        }
        let all = [self.position, self.velocity];
        let count = outputs.len();
        outputs.copy_from_slice(&all[..count]);
    }
    fn energy(&self) -> EnergyBalance {
        EnergyBalance::default()
    }
    fn work(&self) -> WorkCounts {
        WorkCounts {
            steps: self.steps,
            ..WorkCounts::default()
        }
    }
    fn log_events(&mut self, wanted: bool) {
        self.log = wanted.then(Vec::new);
    }
    fn events(&self) -> &[PlantEvent] {
        self.log.as_deref().unwrap_or_default()
    }
    fn save(&self) -> Snapshot {
        Snapshot::default()
    }
    fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
        Ok(())
    }
}

/// Ticks at its own period; at each it damps and stiffens the oscillator by what it sees now and saw before.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// \[µs\]
    pub period: u64,
    pub phase: u64,
}

/// The oscillator under the sum of what the boards want, seen every 8 ms, which is on every grid, for 0.8 s.
pub fn driven(plant: &mut dyn Plant, boards: &[Board]) -> Vec<f64> {
    const LOOK: u64 = 8_000;
    const STIFFNESS: f64 = 200.0;
    const DAMPING: f64 = 3.0;
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let mut due: Vec<u64> = boards.iter().map(|board| board.phase).collect();
    let mut wants = vec![0.0; boards.len()];
    let mut seen_by: Vec<Option<f64>> = vec![None; boards.len()];
    let (mut look, mut now, mut seen) = (LOOK, 0, Vec::new());
    let mut outputs = vec![0.0; 2];
    while look <= 800_000 {
        let next = due.iter().copied().fold(look, u64::min);
        if next > now {
            plant.advance(at(next), &[wants.iter().sum()]).unwrap();
            now = next;
        }
        plant.observe(&mut outputs);
        if look == now {
            seen.push(outputs[0]);
            look += LOOK;
        }
        for (n, board) in boards.iter().enumerate() {
            if due[n] == now {
                let period_s = board.period as f64 * 1e-6;
                let rate = seen_by[n].map_or(0.0, |last| (outputs[0] - last) / period_s);
                seen_by[n] = Some(outputs[0]);
                wants[n] = -STIFFNESS * outputs[0] - DAMPING * rate;
                due[n] += board.period;
            }
        }
    }
    seen
}
