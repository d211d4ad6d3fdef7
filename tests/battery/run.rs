//! A case that is run: its plant as the laws see it, at every observation.

use std::panic::{AssertUnwindSafe, catch_unwind};

use twinrig::kernel::{SimDuration, SimTime};
use twinrig::robot::{LegMount, Robot, RobotFile};
use twinrig::runtime::{EnergyBalance, Group, Observer, RunEvent};
use twinrig::{Assembly, Registry};
use twinrig_kernel::Layout;
use twinrig_leg::Pantograph;

use crate::case::Case;
use crate::momentum::{Momentum, momentum};

/// The robot of all cases.
pub const ROBOT: &str = include_str!("../../robots/cheetah-cub.toml");

/// A foot at an observation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Foot {
    /// Distance above the ground of its lowest point, along the normal \[m\].
    pub clearance: f64,
    /// Mean force of the ground since the last observation \[N\].
    pub force: [f64; 3],
    /// Position \[m\].
    pub position: [f64; 3],
}

/// A robot at an observation.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    pub time_s: f64,
    pub energy: EnergyBalance,
    /// Position of the trunk \[m\].
    pub trunk: [f64; 3],
    pub feet: Vec<Foot>,
    /// How often the plant has left a step to another method, or shortened it.
    pub fallbacks: u64,
    /// Of the robot as segments; none for a plant whose legs have no mass.
    pub momentum: Option<Momentum>,
}

/// A case and what came of it.
#[derive(Clone, Debug)]
pub struct Run {
    pub case: Case,
    /// From the start on, to the end or to where the plant refused to go on.
    pub samples: Vec<Sample>,
    /// Why the plant refused.
    pub refused: Option<String>,
    /// Mass of the robot without the legs that are not there \[kg\].
    pub mass: f64,
    /// Length of its longest leg \[m\].
    pub length: f64,
}

/// Reads trunk and feet where a layout has them.
struct Observed {
    trunk_at: usize,
    places: Vec<[usize; 3]>,
    trunk: [f64; 3],
    feet: Vec<Foot>,
}

impl Observed {
    fn of(layout: &Layout, legs: &[&str]) -> Self {
        let place = |leg: &str, what: &str| {
            let found = layout.find(&format!("leg/{leg}/foot/{what}"));
            found.map_or(usize::MAX, |range| range.start)
        };
        let trunk = layout.find("body/position");
        Self {
            trunk_at: trunk.map_or(usize::MAX, |range| range.start),
            trunk: [0.0; 3],
            places: legs
                .iter()
                .map(|leg| ["clearance", "force", "position"].map(|what| place(leg, what)))
                .collect(),
            feet: vec![Foot::default(); legs.len()],
        }
    }
}

impl Observer for Observed {
    fn event(&mut self, _: SimTime, _: RunEvent) {}

    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        if group != Group::Plant {
            return;
        }
        let at = self.trunk_at;
        self.trunk.copy_from_slice(&values[at..at + 3]);
        for (foot, &[clearance, force, position]) in self.feet.iter_mut().zip(&self.places) {
            foot.clearance = values[clearance];
            foot.force.copy_from_slice(&values[force..force + 3]);
            foot.position
                .copy_from_slice(&values[position..position + 3]);
        }
    }
}

/// The robot of all cases.
///
/// # Panics
/// If its file has a mistake.
pub fn robot() -> Robot {
    let file = RobotFile::parse("cheetah-cub.toml", ROBOT);
    match file.and_then(|file| file.robot()) {
        Ok(robot) => robot,
        Err(error) => panic!("{error}"),
    }
}

/// Greatest length of a leg [m].
fn reach(mount: &LegMount) -> f64 {
    Pantograph::new(&mount.leg).map_or(0.0, |leg| leg.length_max())
}

/// Runs a case with the parts of a registry.
///
/// # Errors
/// A case that makes no rig.
pub fn run(registry: &Registry, case: &Case) -> Result<Run, String> {
    run_text(registry, case, &case.scenario())
}

/// Runs a scenario as what a case is said to be.
///
/// # Errors
/// As [`run`].
pub fn run_text(registry: &Registry, case: &Case, text: &str) -> Result<Run, String> {
    let assembly = Assembly::of_texts(registry, text, ROBOT, &[]);
    let assembly = assembly.map_err(|error| error.to_string())?;
    let mut rig = assembly.rig().map_err(|error| error.to_string())?;
    let Some(robot) = assembly.robot() else {
        return Err("there is no robot".to_owned());
    };
    let mut feet = Observed::of(rig.layout(Group::Plant), &case.legs);
    let period = case.period();
    let there = |name: &str| case.legs.contains(&name);
    let legs = robot.legs.iter().filter(|mount| there(&mount.name));
    let mut run = Run {
        case: case.clone(),
        samples: Vec::new(),
        refused: None,
        mass: robot.trunk.mass + legs.map(|mount| mount.leg.mass.total()).sum::<f64>(),
        length: robot.legs.iter().map(reach).fold(0.0, f64::max),
    };
    let (mut now, end) = (SimTime::ZERO, SimTime::ZERO + case.duration);
    while now <= end {
        // A panic is a refusal like any other, and the next case has its own plant.
        let went = catch_unwind(AssertUnwindSafe(|| rig.run_until(now, &mut feet)));
        let refused = match went {
            Ok(went) => went.err().map(|error| error.to_string()),
            Err(_) => Some("it panicked".to_owned()),
        };
        if refused.is_some() {
            run.refused = refused;
            break;
        }
        let plant = rig.plant();
        let state = plant.state().filter(|_| plant.name() == "lcp");
        run.samples.push(Sample {
            time_s: now.as_secs_f64(),
            energy: plant.energy(),
            trunk: feet.trunk,
            feet: feet.feet.clone(),
            fallbacks: plant.work().fallbacks,
            momentum: state.map(|state| momentum(robot, &case.legs, case.toe, &state)),
        });
        now += period.max(SimDuration::from_nanos(1));
    }
    Ok(run)
}
