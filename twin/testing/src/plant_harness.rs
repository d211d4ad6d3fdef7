//! A plant with its commands, signals and time.

use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_legged::Setup;
use twinrig_robot::Robot;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault};

use crate::trot::Trot;

/// A plant with its commands, signals and time.
#[derive(Clone, Debug)]
pub struct PlantHarness<P> {
    /// Plant.
    pub plant: P,
    /// Inputs; at first those that hold the drives at their start.
    pub commands: Vec<f64>,
    /// Time \[µs\].
    pub now_us: u64,
    /// Interval of [`step`](Self::step) and [`run_checked`](Self::run_checked) \[µs\].
    pub step_us: u64,
    layout: Layout,
    outputs: Vec<f64>,
}

impl<P: Plant> PlantHarness<P> {
    /// Creates a harness at time zero.
    pub fn new(plant: P) -> Self {
        let layout = |direction| Layout::of(&plant.ports(), direction);
        let mut commands = vec![0.0; layout(Direction::Input).len()];
        plant.initial_inputs(&mut commands);
        let layout = layout(Direction::Output);
        Self {
            plant,
            commands,
            now_us: 0,
            step_us: 2000,
            outputs: vec![0.0; layout.len()],
            layout,
        }
    }

    /// Advances to an instant. Returns the fault, if any.
    pub fn try_advance_to_us(&mut self, us: u64) -> Result<(), PlantFault> {
        self.plant.advance(at_us(us), &self.commands)?;
        self.now_us = us;
        Ok(())
    }

    /// Advances by a duration. Returns the fault, if any.
    pub fn try_advance_us(&mut self, us: u64) -> Result<(), PlantFault> {
        self.try_advance_to_us(self.now_us + us)
    }

    /// Advances to an instant.
    pub fn advance_to_us(&mut self, us: u64) {
        self.try_advance_to_us(us).unwrap();
    }

    /// Advances to an instant.
    pub fn advance_to_ms(&mut self, ms: u64) {
        self.advance_to_us(1000 * ms);
    }

    /// Advances by a duration.
    pub fn advance_us(&mut self, us: u64) {
        self.try_advance_us(us).unwrap();
    }

    /// Advances by a step.
    pub fn step(&mut self) -> Result<(), PlantFault> {
        self.try_advance_us(self.step_us)
    }

    /// Runs for a duration and checks every output for NaN after each step. Returns the fault of a
    /// failed step, after checking that the outputs are unchanged.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "runs last seconds"
    )]
    pub fn run_checked(&mut self, seconds: f64) -> Result<(), PlantFault> {
        let until = self.now_us + (seconds * 1e6).round() as u64;
        while self.now_us < until {
            let before = self.observe().to_vec();
            let result = self.step();
            let now = self.now_us;
            let after = self.observe();
            assert!(after.iter().all(|x| !x.is_nan()), "at {now} µs");
            if let Err(fault) = result {
                assert_eq!(after, before, "outputs are unchanged after a fault");
                assert_eq!(fault.time.as_nanos(), 1000 * now);
                assert!(!fault.part.is_empty() && !fault.why.is_empty());
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Advances to an instant under the commands of a trot.
    pub fn trot(&mut self, robot: &Robot, setup: &Setup, trot: Trot, ms: u64) {
        self.commands = trot.commands(robot, setup, ms as f64 * 1e-3);
        self.advance_to_ms(ms);
    }

    /// Returns all signals.
    pub fn observe(&mut self) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        &self.outputs
    }

    /// Returns a signal.
    pub fn read(&mut self, signal: &str) -> Vec<f64> {
        let range = self.layout.find(signal).unwrap();
        self.observe()[range].to_vec()
    }

    /// Returns a scalar signal.
    pub fn value(&mut self, signal: &str) -> f64 {
        let values = self.read(signal);
        assert_eq!(values.len(), 1, "{signal}");
        values[0]
    }

    /// Returns the energy balance.
    pub fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }

    /// Returns the positions of a foot every 2 ms for a duration in milliseconds.
    pub fn trace(&mut self, leg: &str, ms: u64) -> Vec<[f64; 3]> {
        let signal = format!("leg/{leg}/foot/position");
        (1..=ms / 2)
            .map(|k| {
                self.advance_to_ms(2 * k);
                self.read(&signal).try_into().unwrap()
            })
            .collect()
    }
}

/// Returns the instant of a time in microseconds.
pub fn at_us(us: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(us)
}

/// Returns the instant of a time in milliseconds.
pub fn at_ms(ms: u64) -> SimTime {
    at_us(1000 * ms)
}
