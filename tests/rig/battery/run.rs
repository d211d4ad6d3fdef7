//! Run of a case, with the samples that the laws evaluate.

use std::panic::{AssertUnwindSafe, catch_unwind};

use twinrig::kernel::{SimDuration, SimTime};
use twinrig::robot::{LegMount, Robot, RobotFile};
use twinrig::runtime::{EnergyBalance, Group, Observer, PlantState, RunEvent};
use twinrig::{Assembly, Registry};
use twinrig_kernel::{Layout, signal};
use twinrig_robot::leg::Pantograph;

use crate::battery::case::Case;
use crate::battery::momentum::{Momentum, momentum};

/// Robot file of all cases.
pub const ROBOT: &str = include_str!("../../../robots/cheetah-cub.toml");

/// A foot at a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Foot {
    /// Distance of its lowest point above the ground, along the normal \[m\].
    pub clearance: f64,
    /// Mean ground force since the last sample \[N\].
    pub force: [f64; 3],
    /// Position \[m\].
    pub position: [f64; 3],
}

/// A robot at a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    pub time_s: f64,
    pub energy: EnergyBalance,
    /// Position of the trunk \[m\].
    pub trunk: [f64; 3],
    pub feet: Vec<Foot>,
    /// Absolute angles of the segments of each leg \[rad\].
    pub angles: Vec<[f64; 3]>,
    /// Number of fallbacks to another method and of shortened steps so far.
    pub fallbacks: u64,
    /// Momentum of the segments; `None` for a plant with mass-less legs.
    pub momentum: Option<Momentum>,
}

/// A case and its result.
#[derive(Clone, Debug)]
pub struct Run {
    pub case: Case,
    /// Scenario file.
    pub text: String,
    /// Samples from the start to the end or to the error of the plant.
    pub samples: Vec<Sample>,
    /// Error of the plant, if any.
    pub refused: Option<String>,
    /// Mass of the robot with the legs of the case \[kg\].
    pub mass: f64,
    /// Length of the longest leg \[m\].
    pub length: f64,
    /// Greatest deflection of the bristle of a compliant sole \[m\].
    pub slip_deflection: f64,
}

/// Observer of trunk and feet.
struct FootObserver {
    trunk_offset: usize,
    foot_offsets: Vec<[usize; 3]>,
    trunk: [f64; 3],
    feet: Vec<Foot>,
}

impl FootObserver {
    fn of(layout: &Layout, legs: &[&str]) -> Self {
        let offset = |leg: &str, signal: &str| {
            let found = layout.find(&format!("leg/{leg}/foot/{signal}"));
            found.map_or(usize::MAX, |range| range.start)
        };
        let trunk = layout.find("body/position");
        Self {
            trunk_offset: trunk.map_or(usize::MAX, |range| range.start),
            trunk: [0.0; 3],
            foot_offsets: legs
                .iter()
                .map(|leg| ["clearance", "force", "position"].map(|signal| offset(leg, signal)))
                .collect(),
            feet: vec![Foot::default(); legs.len()],
        }
    }
}

impl Observer for FootObserver {
    fn event(&mut self, _: SimTime, _: RunEvent) {}

    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        if group != Group::Plant {
            return;
        }
        let start = self.trunk_offset;
        self.trunk.copy_from_slice(&values[start..start + 3]);
        for (foot, &[clearance, force, position]) in self.feet.iter_mut().zip(&self.foot_offsets) {
            foot.clearance = values[clearance];
            foot.force.copy_from_slice(&values[force..force + 3]);
            foot.position
                .copy_from_slice(&values[position..position + 3]);
        }
    }
}

/// Parses the robot of all cases.
///
/// # Panics
/// If the file is invalid.
pub fn robot() -> Robot {
    let file = RobotFile::parse("cheetah-cub.toml", ROBOT);
    match file.and_then(|file| file.robot()) {
        Ok(robot) => robot,
        Err(error) => panic!("{error}"),
    }
}

/// Returns the angles of the segments of a leg.
fn angles(state: Option<&PlantState>, leg: &str) -> [f64; 3] {
    let angles = state.and_then(|state| state.get(&signal::of_leg(leg, signal::ANGLES)));
    let angles = angles.and_then(|angles| angles.try_into().ok());
    angles.unwrap_or([f64::NAN; 3])
}

/// Maximum length of a leg \[m\].
fn reach(mount: &LegMount) -> f64 {
    Pantograph::new(&mount.leg).map_or(0.0, |leg| leg.length_max())
}

/// Deflection of the bristle of a foot at the limit of friction \[m\].
fn slip_deflection(mount: &LegMount) -> f64 {
    let compliance = mount.leg.compliance.as_ref();
    compliance.map_or(0.0, |compliance| compliance.slip_deflection)
}

/// Runs a case with the parts of a registry.
///
/// # Errors
/// The scenario of the case is invalid.
pub fn run(registry: &Registry, case: &Case) -> Result<Run, String> {
    run_text(registry, case, &case.scenario())
}

/// Runs the scenario `text` in place of that of `case`.
///
/// # Errors
/// As [`run`].
pub fn run_text(registry: &Registry, case: &Case, text: &str) -> Result<Run, String> {
    let assembly = Assembly::builder(registry).robot(ROBOT).recorded(text);
    let assembly = assembly.map_err(|error| error.to_string())?;
    let mut rig = assembly.rig().map_err(|error| error.to_string())?;
    let Some(robot) = assembly.robot() else {
        return Err("the scenario has no robot".to_owned());
    };
    let mut feet = FootObserver::of(rig.layout(Group::Plant), &case.legs);
    let period = case.period();
    let is_present = |name: &str| case.legs.contains(&name);
    let legs = robot.legs.iter().filter(|mount| is_present(&mount.name));
    let mut run = Run {
        case: case.clone(),
        text: text.to_owned(),
        samples: Vec::new(),
        refused: None,
        mass: robot.trunk.mass + legs.map(|mount| mount.leg.mass.total()).sum::<f64>(),
        length: robot.legs.iter().map(reach).fold(0.0, f64::max),
        slip_deflection: robot.legs.iter().map(slip_deflection).fold(0.0, f64::max),
    };
    let (mut now, end) = (SimTime::ZERO, SimTime::ZERO + case.duration);
    while now <= end {
        // A panic counts as a refusal; each case has its own plant.
        let result = catch_unwind(AssertUnwindSafe(|| rig.run_until(now, &mut feet)));
        let refused = match result {
            Ok(result) => result.err().map(|error| error.to_string()),
            Err(_) => Some("panic".to_owned()),
        };
        if refused.is_some() {
            run.refused = refused;
            break;
        }
        let plant = rig.plant();
        let state = plant.state();
        let angles = case.legs.iter().map(|leg| angles(state.as_ref(), leg));
        let angles = angles.collect();
        let state = state.filter(|_| plant.name() == "lcp");
        run.samples.push(Sample {
            time_s: now.as_secs_f64(),
            energy: plant.energy(),
            trunk: feet.trunk,
            feet: feet.feet.clone(),
            angles,
            fallbacks: plant.work().fallbacks,
            momentum: state.map(|state| momentum(robot, &case.legs, case.toe, &state)),
        });
        now += period.max(SimDuration::from_nanos(1));
    }
    Ok(run)
}
