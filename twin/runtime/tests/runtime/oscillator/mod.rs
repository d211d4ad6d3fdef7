//! A mass on a spring, solved in closed form, and boards that act on it.
#![allow(dead_code, reason = "each test uses some of it")]

use std::collections::VecDeque;

use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Plant, PlantEvent, PlantEventKind, PlantFault, WorkCounts};

#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// \[rad/s\]
    pub frequency: f64,
    pub outputs_velocity: bool,
    /// Delay of the force \[µs\].
    pub delay_us: u64,
    /// Outputs an angle in [−π, π] and an orientation instead, both in uniform rotation.
    pub rotates: bool,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            frequency: 40.0,
            outputs_velocity: true,
            delay_us: 0,
            rotates: false,
        }
    }
}

/// Angular velocity of the rotation \[rad/s\].
const ROTATION: f64 = 11.0;

/// A mass of 1 kg, advanced from 1 m by the exact solution under each force: independent of the
/// step size.
pub struct Oscillator {
    shape: Shape,
    now: SimTime,
    position: f64,
    velocity: f64,
    steps: u64,
    /// Forces that do not act yet, with the times at which they will, the last command, and the
    /// acting force.
    pending: VecDeque<(SimTime, f64)>,
    last_command: f64,
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
            pending: VecDeque::new(),
            last_command: 0.0,
            force: 0.0,
            log: None,
        }
    }

    /// Returns the position without force.
    pub fn free(shape: Shape, at: SimTime) -> f64 {
        libm::cos(shape.frequency * at.as_secs_f64())
    }

    /// Returns the unwrapped angle.
    pub fn angle_at(at: SimTime) -> f64 {
        ROTATION * at.as_secs_f64()
    }

    fn advance_exactly(&mut self, to: SimTime) {
        let w = self.shape.frequency;
        let phase = w * (to - self.now).as_secs_f64();
        let (sin, cos) = (libm::sin(phase), libm::cos(phase));
        let equilibrium = self.force / (w * w);
        let (from, velocity) = (self.position - equilibrium, self.velocity);
        self.position = equilibrium + from * cos + velocity / w * sin;
        self.velocity = velocity * cos - from * w * sin;
        let crossed = (self.position < 0.0) != (from + equilibrium < 0.0);
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
        if self.shape.rotates {
            ports.push(Port::output("mass/angle", Unit::Radian, 1));
            ports.push(Port::output("mass/orientation", Unit::One, 4).rotation());
            return ports;
        }
        ports.push(Port::output("mass/position", Unit::Meter, 1));
        if self.shape.outputs_velocity {
            let velocity = Port::output("mass/velocity", Unit::MeterPerSecond, 1);
            ports.push(velocity.rate_of("mass/position"));
        }
        ports
    }
    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.steps += 1;
        if inputs[0] != self.last_command {
            self.last_command = inputs[0];
            let acts = self.now + SimDuration::from_micros(self.shape.delay_us);
            self.pending.push_back((acts, inputs[0]));
        }
        while let Some(&(acts, force)) = self.pending.front().filter(|(acts, _)| *acts < to) {
            if acts > self.now {
                self.advance_exactly(acts);
            }
            self.force = force;
            self.pending.pop_front();
        }
        self.advance_exactly(to);
        Ok(())
    }
    fn observe(&mut self, outputs: &mut [f64]) {
        if self.shape.rotates {
            let angle = Self::angle_at(self.now);
            outputs[0] = libm::atan2(libm::sin(angle), libm::cos(angle));
            // Either of the two signs.
            let half = outputs[0] / 2.0;
            outputs[1..].copy_from_slice(&[libm::cos(half), 0.0, 0.0, libm::sin(half)]);
            return;
        }
        let all = [self.position, self.velocity];
        let count = outputs.len();
        outputs.copy_from_slice(&all[..count]);
    }
    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.steps)
    }
    fn log_events(&mut self, enabled: bool) {
        self.log = enabled.then(Vec::new);
    }
    fn events(&self) -> &[PlantEvent] {
        self.log.as_deref().unwrap_or_default()
    }
}

/// Board that damps and stiffens the oscillator at its own period, by the present and the previous
/// sample.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// \[µs\]
    pub period: u64,
    pub phase: u64,
}

/// Positions of the oscillator under the sum of the boards' forces, every 8 ms, which is on every
/// grid, for 0.8 s.
pub fn driven(plant: &mut dyn Plant, boards: &[Board]) -> Vec<f64> {
    const OBSERVE_EVERY: u64 = 8_000;
    const STIFFNESS: f64 = 200.0;
    const DAMPING: f64 = 3.0;
    let at = |micros| SimTime::ZERO + SimDuration::from_micros(micros);
    let mut due: Vec<u64> = boards.iter().map(|board| board.phase).collect();
    let mut forces = vec![0.0; boards.len()];
    let mut previous: Vec<Option<f64>> = vec![None; boards.len()];
    let (mut observe_at, mut now, mut positions) = (OBSERVE_EVERY, 0, Vec::new());
    let mut outputs = vec![0.0; 2];
    while observe_at <= 800_000 {
        let next = due.iter().copied().fold(observe_at, u64::min);
        if next > now {
            plant.advance(at(next), &[forces.iter().sum()]).unwrap();
            now = next;
        }
        plant.observe(&mut outputs);
        if observe_at == now {
            positions.push(outputs[0]);
            observe_at += OBSERVE_EVERY;
        }
        for (n, board) in boards.iter().enumerate() {
            if due[n] == now {
                let period_s = board.period as f64 * 1e-6;
                let rate = previous[n].map_or(0.0, |last| (outputs[0] - last) / period_s);
                previous[n] = Some(outputs[0]);
                forces[n] = -STIFFNESS * outputs[0] - DAMPING * rate;
                due[n] += board.period;
            }
        }
    }
    positions
}
