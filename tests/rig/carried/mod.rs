//! Payloads on the trunk and surfaces of the ground, on every plant of the default build.

mod payload;
mod surface;

use nalgebra::Vector3;
use twinrig_contact::Ground;
use twinrig_kernel::{Direction, SimDuration, SimTime, signal};
use twinrig_legged::{Abduction, Base, Constraints, Contacts, Drives, SetPoint, Setup, Start};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

/// Error of integration \[m\]: far below the default, so that properties hold to many digits.
const TOLERANCE: f64 = 1e-8;

/// Plant with the readings of a test.
struct Rig {
    name: String,
    plant: Box<dyn Plant>,
    commands: Vec<f64>,
    now: SimTime,
}

/// Returns a free robot with drives that hold its legs.
fn setup(legs: &[&str], ground: Option<Ground>) -> Setup {
    Setup {
        base: Base::Free,
        legs: legs.iter().map(|leg| (*leg).to_owned()).collect(),
        ground,
        step: SimDuration::from_millis(1),
        drives: Drives::Ideal { period: 5e-3 },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    }
}

/// Builds every plant and formulation of its constraints.
fn rigs(robot: &Robot, setup: &Setup) -> Vec<Rig> {
    let mut plants: Vec<(String, Box<dyn Plant>)> = Vec::new();
    for constraints in [Constraints::Rigid, Constraints::Compliant] {
        let mut massless = twinrig_massless::Options::compliant(setup.clone(), TOLERANCE);
        massless.constraints = constraints;
        let plant = twinrig_massless::Massless::new(robot, &massless, &|_| true).unwrap();
        plants.push((format!("massless {constraints:?}"), Box::new(plant)));
        let methods = match constraints {
            Constraints::Rigid => vec![twinrig_lcp::Method::Rk4, twinrig_lcp::Method::Moreau],
            Constraints::Compliant => vec![twinrig_lcp::Method::Rk4],
        };
        for method in methods {
            let options = twinrig_lcp::Options {
                setup: setup.clone(),
                constraints,
                method,
                tolerance: TOLERANCE,
                toe: false,
                features: twinrig_lcp::Features::Detected,
            };
            let plant = twinrig_lcp::Lcp::new(robot, &options, &|_| true).unwrap();
            plants.push((format!("lcp {constraints:?} {method:?}"), Box::new(plant)));
        }
    }
    let rig = |(name, plant): (String, Box<dyn Plant>)| {
        let inputs = plant.ports().into_iter();
        let inputs = inputs.filter(|port| port.direction == Direction::Input);
        let mut commands = vec![0.0; inputs.count()];
        plant.initial_inputs(&mut commands);
        Rig {
            name,
            plant,
            commands,
            now: SimTime::ZERO,
        }
    };
    plants.into_iter().map(rig).collect()
}

impl Rig {
    /// Advances to a time after the start.
    fn run_to(&mut self, micros: u64) {
        self.now = SimTime::ZERO + SimDuration::from_micros(micros);
        let advanced = self.plant.advance(self.now, &self.commands);
        advanced.unwrap_or_else(|fault| panic!("{}: {fault}", self.name));
    }

    /// Sets the velocity \[m/s\] and, in trunk axes, the angular velocity \[rad/s\] of the trunk.
    fn launch(&mut self, velocity: [f64; 3], turning: [f64; 3]) {
        let state = self.plant.state().unwrap();
        let state = state.with(signal::BODY_VELOCITY, &velocity);
        let state = state.with(signal::BODY_ANGULAR_VELOCITY, &turning);
        self.plant.resume_from(&state).unwrap();
    }

    /// Reads an output.
    fn read(&mut self, name: &str) -> Vec<f64> {
        let ports = self.plant.ports().into_iter();
        let ports: Vec<_> = ports
            .filter(|port| port.direction == Direction::Output)
            .collect();
        let mut values = vec![0.0; ports.iter().map(|port| port.size).sum()];
        self.plant.observe(&mut values);
        let mut at = 0;
        for port in &ports {
            if port.name == name {
                return values[at..at + port.size].to_vec();
            }
            at += port.size;
        }
        panic!("{} has no {name}", self.name)
    }

    fn vector(&mut self, name: &str) -> Vector3<f64> {
        Vector3::from_column_slice(&self.read(name))
    }
}
