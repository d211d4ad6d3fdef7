//! Against trajectories of `tests/reference`, which has other coordinates, other derivatives, other integrators and another
//! language. Two of its integrators agree to 1e-11 m in each scene.

#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::needless_range_loop,
    reason = "times are small and whole; rows are those of several tables at one instant"
)]

use std::fs;
use std::path::Path;

use serde_json::Value;
use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Lcp, Method, Options};
use twinrig_legged::{Base, Drives, Setup, StartPose};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

/// A trajectory of the reference.
struct Golden(Value);

impl Golden {
    fn read(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/golden");
        let text = fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        Self(serde_json::from_str(&text).unwrap())
    }

    fn number(&self, key: &str) -> f64 {
        self.0[key].as_f64().unwrap()
    }

    /// Rows of numbers, one for each instant; what is nested deeper is flattened.
    fn rows(&self, key: &str) -> Vec<Vec<f64>> {
        let rows = self.0[key].as_array().unwrap();
        rows.iter().map(flat).collect()
    }

    /// Joint angles and rates at the start.
    fn start(&self) -> StartPose {
        let three = |value: &Value| <[f64; 3]>::try_from(flat(value)).unwrap();
        StartPose {
            q: three(&self.0["start"]["angles_deg"]).map(f64::to_radians),
            rates: three(&self.0["start"]["rates"]),
        }
    }
}

fn flat(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(items) => items.iter().flat_map(flat).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}

fn robot() -> Robot {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    RobotFile::find("cheetah-cub", beside)
        .unwrap()
        .robot()
        .unwrap()
}

/// How a plant moves.
#[derive(Clone, Copy)]
struct Way {
    method: Method,
    step_us: u64,
    tolerance: f64,
}

/// The default method in short steps.
const fn steps_of(step_us: u64) -> Way {
    Way {
        method: Method::Rk4,
        step_us,
        tolerance: f64::INFINITY,
    }
}

/// A plant beside its reference.
struct Scene {
    golden: Golden,
    plant: Lcp,
    layout: Layout,
    hip: [f64; 3],
    now: u64,
    worst: f64,
}

impl Scene {
    fn new(golden: Golden, robot: &Robot, setup: Setup, toe: bool, way: Way) -> Self {
        let options = Options {
            setup: Setup {
                step: SimDuration::from_micros(way.step_us),
                ..setup
            },
            method: way.method,
            tolerance: way.tolerance,
            toe,
        };
        let plant = Lcp::new(robot, &options, &|_| true).unwrap();
        let layout = Layout::of(&plant.ports(), Direction::Output);
        Self {
            golden,
            plant,
            layout,
            hip: robot.legs[0].hip,
            now: 0,
            worst: 0.0,
        }
    }

    /// Goes on to an instant, as far as that is not where it is.
    fn to(&mut self, seconds: f64) {
        self.now = (seconds * 1e6).round() as u64;
        let to = SimTime::ZERO + SimDuration::from_micros(self.now);
        self.plant.advance(to, &[]).unwrap();
    }

    fn read(&mut self, signal: &str) -> Vec<f64> {
        let mut outputs = vec![0.0; self.layout.len()];
        self.plant.observe(&mut outputs);
        outputs[self.layout.find(signal).unwrap()].to_vec()
    }

    /// The foot in the leg plane, seen from the hip of a trunk that is level.
    fn foot_from_hip(&mut self) -> [f64; 2] {
        let (foot, trunk) = (
            self.read("leg/LF/foot/position"),
            self.read("body/position"),
        );
        [0, 2].map(|axis| foot[axis] - trunk[axis] - self.hip[axis])
    }

    fn note(&mut self, found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!(found.is_finite());
            self.worst = self.worst.max((found - expected).abs());
        }
    }
}

/// A leg on a trunk that is held; the greatest error of foot \[m\], angles and impact.
fn passive(name: &str, way: Way) -> f64 {
    let golden = Golden::read(name);
    let mut robot = robot();
    let given = |key: &str| golden.0["leg"][key].as_f64().unwrap();
    let leg = &mut robot.legs[0].leg;
    assert!((given("l2") - leg.l2).abs() < 1e-15, "another robot");
    (leg.diagonal.stiffness, leg.parallel.stiffness) = (given("k_d"), given("k_p"));
    (leg.diagonal.preload, leg.parallel.preload) = (given("preload_d"), given("preload_p"));
    leg.parallel_travel = given("travel");
    let friction = flat(&golden.0["leg"]["friction"]);
    let joints = &mut leg.joint_friction;
    (joints.hip, joints.knee) = (friction[0], friction[1]);
    (joints.ankle, joints.toe) = (friction[2], friction[3]);
    let setup = Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        start: golden.start().into(),
    };
    let toe = golden.0["toe"].as_bool().unwrap();
    let mut scene = Scene::new(golden, &robot, setup, toe, way);
    let (step, sparse) = (
        scene.golden.number("step_s"),
        scene.golden.number("sparse_step_s"),
    );
    let (feet, angles) = (scene.golden.rows("foot"), scene.golden.rows("angles"));
    let every = (sparse / step).round() as usize;
    for (k, foot) in feet.iter().enumerate() {
        scene.to(k as f64 * step);
        let found = scene.foot_from_hip();
        scene.note(&found, foot);
        if k % every == 0 {
            let found = scene.read("leg/LF/angles");
            scene.note(&found, &angles[k / every][..3]);
        }
    }
    let lost = scene.golden.rows("impact").concat();
    let (found, expected) = (scene.plant.energy().impact, lost[lost.len() - 1]);
    assert!(
        (found - expected).abs() <= 1e-6 * expected.max(1e-3),
        "{found} J lost in impacts"
    );
    scene.worst
}

/// A free trunk with some legs and no ground; the greatest error of places \[m\] and attitude.
fn tumble(name: &str, way: Way) -> f64 {
    let golden = Golden::read(name);
    let mut robot = robot();
    let friction = flat(&golden.0["friction"]);
    for mount in &mut robot.legs {
        let leg = &mut mount.leg;
        leg.diagonal.preload = golden.number("preload_m");
        leg.parallel.preload = golden.number("preload_m");
        leg.parallel_travel = golden.number("travel_m");
        let joints = &mut leg.joint_friction;
        (joints.hip, joints.knee) = (friction[0], friction[1]);
        (joints.ankle, joints.toe) = (friction[2], friction[3]);
    }
    let legs = golden.0["legs"].as_array().unwrap().iter();
    let legs: Vec<String> = legs.map(|leg| leg.as_str().unwrap().to_owned()).collect();
    let setup = Setup {
        base: Base::Free,
        legs: legs.clone(),
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        start: golden.start().into(),
    };
    let toe = golden.0["toe"].as_bool().unwrap();
    let mut scene = Scene::new(golden, &robot, setup, toe, way);
    let step = scene.golden.number("step_s");
    let expected = ["position", "orientation", "feet"].map(|key| scene.golden.rows(key));
    for k in 0..expected[0].len() {
        if k == 0 {
            scene.plant.log_events(true);
        }
        scene.to(k as f64 * step);
        if k == 8 && name == "tumble-stops" {
            for e in scene.plant.events().iter().take(60) {
                println!("{:.13} {} {:?}", e.at_s, e.part, e.kind);
            }
        }
        let place = scene.read("body/position");
        scene.note(&place, &expected[0][k]);
        let attitude = scene.read("body/orientation");
        scene.note(&attitude, &expected[1][k]);
        let feet = legs
            .iter()
            .flat_map(|leg| scene.read(&format!("leg/{leg}/foot/position")));
        let feet: Vec<f64> = feet.collect();
        scene.note(&feet, &expected[2][k]);
    }
    scene.worst
}

#[test]
fn a_passive_leg_moves_as_the_reference_does() {
    for (name, step_us) in [
        ("passive", 50),
        ("hard-hit", 50),
        ("loose", 50),
        ("between", 40),
        ("hard-light", 25),
        ("undamped", 25),
        ("toe", 25),
    ] {
        let worst = passive(name, steps_of(step_us));
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}

#[test]
fn a_leg_of_a_hundred_times_the_stiffness_moves_as_the_reference_does() {
    for name in ["stiff", "stiff-between"] {
        let worst = passive(name, steps_of(10));
        assert!(worst < 1e-8, "{name}: {worst:e}");
    }
}

#[test]
fn a_robot_tumbles_as_the_reference_does() {
    for name in [
        "tumble",
        "tumble-undamped",
        "tumble-toe",
        "tumble-leg",
        "tumble-stops",
    ] {
        let worst = tumble(name, steps_of(25));
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}

#[test]
fn errors_fall_with_the_fourth_power_of_the_step() {
    for name in ["passive", "hard-hit", "undamped", "toe"] {
        let [coarse, fine] = [200, 100].map(|step_us| passive(name, steps_of(step_us)));
        assert!(coarse > 10.0 * fine, "{name}: {coarse:e}, then {fine:e}");
    }
}

/// A trunk in the plane with a leg at its centre of mass, above lower ground; the greatest error of places \[m\] and angles.
fn drop(name: &str, base: Base, way: Way) -> f64 {
    let golden = Golden::read(name);
    let mut robot = robot();
    robot.legs[0].hip = [0.0; 3];
    let lower = HeightField::new(
        [-2.0; 2],
        1.0,
        5,
        vec![-flat(&golden.0["start"]["fall_m"])[0]; 25],
    );
    let terrain = Terrain::Heights(lower.unwrap());
    let setup = Setup {
        base,
        legs: vec!["LF".to_owned()],
        ground: Some(Ground::new(terrain, golden.number("friction"), 0.0).unwrap()),
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        start: golden.start().into(),
    };
    let mut scene = Scene::new(golden, &robot, setup, false, way);
    scene.plant.log_events(true);
    let step = scene.golden.number("step_s");
    let (trunk, feet) = (scene.golden.rows("trunk"), scene.golden.rows("foot"));
    for (k, (trunk, foot)) in trunk.iter().zip(&feet).enumerate() {
        scene.to(k as f64 * step);
        let (place, tilt) = (scene.read("body/position"), scene.read("body/orientation"));
        let pitch = 2.0 * libm::atan2(tilt[2], tilt[0]);
        scene.note(&[place[0], place[2], pitch], trunk);
        let found = scene.read("leg/LF/foot/position");
        scene.note(&[found[0], found[2]], foot);
    }
    scene.worst
}

#[test]
fn a_leg_lands_as_the_reference_does() {
    for name in ["drop", "stride"] {
        // Nothing pushes sideways: a free trunk stays in the plane, too.
        for base in [Base::Planar, Base::Free] {
            for us in [25, 100, 500, 2000] {
                let worst = drop(name, base, steps_of(us));
                println!("{name} {base:?} {us}: {worst:e}");
            }
        }
    }
}
