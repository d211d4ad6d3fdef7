//! Test bench of position servos.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit, signal,
};
use twinrig_robot::Servo;
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Ledger, Plant, PlantFault, PlantState, WorkCounts};

use super::error::{DrivesError, reject_duplicates};
use super::response::flush_to_zero;
use crate::{PositionServo, Ramp, SetPoint, SetPoints};

/// Greatest step length.
const STEP: SimDuration = SimDuration::from_millis(1);

/// Servos of the hip abduction without load, for plants whose legs do not abduct: a plant named
/// `servos`, with these ports:
///
/// | port | |
/// |---|---|
/// | `leg/LF/abduction/command` | input \[rad\] |
/// | `leg/LF/abduction/position` | \[rad\] |
///
/// All servos start at rest at zero.
#[derive(Debug, Clone)]
pub struct ServoBench {
    servo: PositionServo,
    shafts: Vec<ServoState>,
    set_points: SetPoints,
    now: SimTime,
    ledger: Ledger,
    steps: u64,
    ports: Vec<Port>,
    /// Indices of the shafts whose positions are requested.
    observed: Vec<usize>,
}

/// State of a servo.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct ServoState {
    position: f64,
    rate: f64,
}

/// Serialised state.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    shafts: Vec<ServoState>,
    ramps: Vec<Ramp>,
    ledger: Ledger,
    steps: u64,
}

impl ServoBench {
    /// Creates a servo for each of these legs, all alike. `requested` selects the output signals.
    ///
    /// # Errors
    /// [`DrivesError`] for duplicate legs, and for an invalid servo.
    pub fn new(
        legs: &[String],
        servo: &Servo,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Self, DrivesError> {
        reject_duplicates(legs)?;
        let (mut ports, mut observed) = (Vec::new(), Vec::new());
        for (index, port) in Self::ports_of(legs).into_iter().enumerate() {
            let output = port.direction == Direction::Output;
            if output && !requested(&port.name) {
                continue;
            }
            ports.push(port);
            if output {
                observed.push(index - legs.len());
            }
        }
        Ok(Self {
            servo: PositionServo::new(servo)?,
            shafts: vec![ServoState::default(); legs.len()],
            set_points: SetPoints::new(SetPoint::Held, legs.len()),
            now: SimTime::ZERO,
            ledger: Ledger::opened([0.0; 3]),
            steps: 0,
            ports,
            observed,
        })
    }

    /// Selects the course of the set-points between commands.
    #[must_use]
    pub fn with_set_point(mut self, set_point: SetPoint) -> Self {
        self.set_points = SetPoints::new(set_point, self.shafts.len());
        self
    }

    /// The ports of servos of these legs, all outputs included: commands, then positions.
    pub fn ports_of(legs: &[String]) -> Vec<Port> {
        let angle = |leg: &String, what: &str| signal::of_leg(leg, &format!("abduction/{what}"));
        let commands = legs.iter().map(|leg| angle(leg, "command"));
        let positions = legs.iter().map(|leg| angle(leg, "position"));
        let commands = commands.map(|name| Port::input(name, Unit::Radian, 1));
        let positions = positions.map(|name| Port::output(name, Unit::Radian, 1));
        commands.chain(positions).collect()
    }

    /// Names of the legs, in the order of the shafts.
    fn legs(&self) -> impl Iterator<Item = &str> {
        let command = |port: &'_ Port| port.direction == Direction::Input;
        let commands = self.ports.iter().filter(move |port| command(port));
        commands.filter_map(|port| {
            let (leg, _) = signal::parse_leg(&port.name)?;
            Some(leg)
        })
    }

    /// Kinetic energy \[J\].
    fn kinetic(&self) -> f64 {
        let inertia = self.servo.inertia();
        let shafts = self.shafts.iter();
        shafts
            .map(|shaft| 0.5 * inertia * shaft.rate * shaft.rate)
            .sum()
    }

    /// Advances from the present time to `next`, or to the end of an approach before it.
    fn step(&mut self, next: SimTime, commands: &[f64]) {
        let (mut next, mut commands) = (next, commands);
        if self.set_points.are_linear() {
            next = self.set_points.step_end(self.now, next);
            commands = self.set_points.over(self.now, next).mean;
        }
        let seconds = (next - self.now).as_secs_f64();
        self.now = next;
        let servo = &self.servo;
        let rate_change_max = servo.torque() * seconds / servo.inertia();
        let mut kinetic = 0.0;
        for (shaft, command) in self.shafts.iter_mut().zip(commands) {
            let rate = shaft.rate;
            let target = servo.rate_after(seconds, *command, shaft.position, rate);
            let rate_change = (target - rate).clamp(-rate_change_max, rate_change_max);
            let mean = rate + 0.5 * rate_change;
            shaft.position += seconds * mean;
            shaft.rate = flush_to_zero(rate + rate_change);
            self.ledger.actuator += servo.inertia() * rate_change * mean;
            kinetic += 0.5 * servo.inertia() * shaft.rate * shaft.rate;
        }
        self.ledger.close_step([kinetic, 0.0, 0.0]);
        self.steps += 1;
    }
}

impl Plant for ServoBench {
    fn name(&self) -> &'static str {
        "servos"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if let Some(i) = inputs.iter().position(|input| !input.is_finite()) {
            let mut ports = self.ports.iter();
            let port = ports.nth(i).map(|port| port.name.clone());
            return Err(PlantFault {
                time: self.now,
                part: port.unwrap_or_default(),
                energy: self.energy().stored(),
                why: "the command is not a number".to_owned(),
            });
        }
        self.set_points.command(self.now, inputs);
        let mut steps = LongLoop::default();
        while self.now < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            self.step(to.min(self.now + STEP), inputs);
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        for (output, shaft) in outputs.iter_mut().zip(&self.observed) {
            *output = self.shafts[*shaft].position;
        }
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.steps)
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            shafts: self.shafts.clone(),
            ramps: self.set_points.save(),
            ledger: self.ledger,
            steps: self.steps,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        if saved.shafts.len() != self.shafts.len() {
            return Err(SnapshotError::Mismatch {
                expected: format!("{} servos", self.shafts.len()),
                found: format!("{} servos", saved.shafts.len()),
            });
        }
        let checked = self.set_points.check(&saved.ramps);
        checked.map_err(|found| SnapshotError::Mismatch {
            expected: "servos".to_owned(),
            found,
        })?;
        self.set_points.restore(saved.ramps);
        (self.now, self.shafts) = (saved.now, saved.shafts);
        (self.ledger, self.steps) = (saved.ledger, saved.steps);
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        let shafts = self.legs().zip(&self.shafts);
        Some(
            shafts.fold(PlantState::at(self.now), |state, (leg, shaft)| {
                state.with(abduction(leg), &[shaft.position, shaft.rate])
            }),
        )
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let mut shafts = self.shafts.clone();
        let mut lines = Vec::new();
        for (leg, shaft) in self.legs().zip(&mut shafts) {
            match from.get(&abduction(leg)) {
                Some(&[position, rate]) if position.is_finite() && rate.is_finite() => {
                    (shaft.position, shaft.rate) = (position, rate);
                }
                _ => lines.push(format!("{} is missing and keeps its value", abduction(leg))),
            }
        }
        let legs: Vec<String> = self.legs().map(abduction).collect();
        let unknown = from
            .iter()
            .filter(|(name, _)| !legs.iter().any(|known| known == name));
        lines.extend(unknown.map(|(name, _)| format!("{name} is not a state of this plant")));
        (self.now, self.shafts, self.steps) = (from.time, shafts, 0);
        let positions = self.shafts.iter().map(|shaft| shaft.position);
        self.set_points.reset(|at| {
            at.iter_mut()
                .zip(positions)
                .for_each(|(at, position)| *at = position);
        });
        self.ledger = Ledger::opened([self.kinetic(), 0.0, 0.0]);
        Ok(lines)
    }
}

/// Name of a leg's abduction in a [`PlantState`]: angle and rate.
fn abduction(leg: &str) -> String {
    signal::of_leg(leg, "abduction")
}
