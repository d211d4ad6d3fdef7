//! The plants of a robot with pushes, by name of the method.

use std::path::Path;

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Constraints, Features, Lcp, Method};
use twinrig_legged::{
    Abduction, Base, Contacts, Drives, Push, PushShape, PushTarget, SetPoint, Setup, StartPose,
};
use twinrig_massless::{Force, Massless};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

/// Methods whose error is of fourth order or controlled.
pub const ACCURATE: [&str; 3] = ["massless compliant", "lcp compliant", "rk4"];
/// Methods of second order.
pub const SECOND_ORDER: [&str; 3] = ["massless rigid", "rodas4", "moreau"];
/// Methods of first order.
pub const FIRST_ORDER: [&str; 2] = ["semi-implicit", "explicit-euler"];

pub fn cheetah() -> Robot {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let file = RobotFile::find("cheetah-cub", root).unwrap();
    file.robot().unwrap()
}

/// A robot in the air whose drives hold its legs.
pub fn in_the_air(legs: &[&str]) -> Setup {
    let q = [0.2, -0.6, 0.65];
    Setup {
        base: Base::Free,
        legs: legs.iter().map(|&leg| leg.to_owned()).collect(),
        ground: None,
        step: SimDuration::from_millis(1),
        drives: Drives::Ideal { period: 10e-3 },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: StartPose { q, rates: [0.0; 3] }.into(),
    }
}

/// The same robot on the ground.
pub fn standing() -> Setup {
    Setup {
        ground: Some(Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        ..in_the_air(&["LF", "RF", "LH", "RH"])
    }
}

/// Builds the plant of a method with all outputs.
pub fn plant(method: &str, setup: &Setup, pushes: &[Push]) -> Box<dyn Plant> {
    plant_of(&cheetah(), method, setup, pushes)
}

/// The same of a robot.
pub fn plant_of(robot: &Robot, method: &str, setup: &Setup, pushes: &[Push]) -> Box<dyn Plant> {
    let (setup, all) = (setup.clone(), |_: &str| true);
    let massless = |options| {
        let plant = Massless::new(robot, &options, &all).unwrap();
        Box::new(plant.with_pushes(pushes, &all).unwrap()) as Box<dyn Plant>
    };
    let lcp = |constraints, method| {
        let options = twinrig_lcp::Options {
            constraints,
            setup: setup.clone(),
            method,
            tolerance: twinrig_lcp::Options::TOLERANCE,
            features: Features::Detected,
            toe: false,
        };
        let plant = Lcp::new(robot, &options, &all).unwrap();
        Box::new(plant.with_pushes(pushes, &all).unwrap()) as Box<dyn Plant>
    };
    match method {
        "massless rigid" => massless(twinrig_massless::Options::new(setup, Force::Solve)),
        "massless compliant" => massless(twinrig_massless::Options::compliant(
            setup,
            twinrig_massless::Options::TOLERANCE,
        )),
        "lcp compliant" => lcp(Constraints::Compliant, Method::Rk4),
        "rk4" => lcp(Constraints::Rigid, Method::Rk4),
        "rodas4" => lcp(Constraints::Rigid, Method::Rodas4),
        "moreau" => lcp(Constraints::Rigid, Method::Moreau),
        "semi-implicit" => lcp(Constraints::Rigid, Method::SemiImplicit),
        "explicit-euler" => lcp(Constraints::Rigid, Method::ExplicitEuler),
        other => panic!("{other}"),
    }
}

pub fn push(target: PushTarget, at_us: u64, for_us: u64, shape: PushShape, peak: [f64; 3]) -> Push {
    Push {
        name: "push".to_owned(),
        target,
        at: at(at_us),
        duration: SimDuration::from_micros(for_us),
        shape,
        peak,
    }
}

pub fn at(us: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(us)
}

/// A plant with its initial inputs, which hold the drives.
pub struct Held {
    pub plant: Box<dyn Plant>,
    inputs: Vec<f64>,
    layout: Layout,
}

impl Held {
    pub fn new(plant: Box<dyn Plant>) -> Self {
        let layout = |direction| Layout::of(&plant.ports(), direction);
        let mut inputs = vec![0.0; layout(Direction::Input).len()];
        plant.initial_inputs(&mut inputs);
        Self {
            inputs,
            layout: layout(Direction::Output),
            plant,
        }
    }

    pub fn advance(&mut self, to_us: u64) {
        let done = self.plant.advance(at(to_us), &self.inputs);
        done.unwrap_or_else(|fault| panic!("{}: {fault}", self.plant.name()));
    }

    pub fn read(&mut self, signal: &str) -> Vec<f64> {
        let mut outputs = vec![0.0; self.layout.len()];
        self.plant.observe(&mut outputs);
        let range = self.layout.find(signal);
        outputs[range.unwrap_or_else(|| panic!("no {signal}"))].to_vec()
    }

    pub fn vector(&mut self, signal: &str) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::from_column_slice(&self.read(signal))
    }
}
