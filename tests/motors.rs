//! A robot on motors, under a position controller once a millisecond, in both plants: where things happen slowly they must
//! agree, for then all that tells them apart is where a leg has its mass.

use std::path::Path;

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Lcp, Method};
use twinrig_legged::{Base, Drives, Setup, Start};
use twinrig_massless::{Force, Massless};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

fn oncilla() -> Robot {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let file = RobotFile::find("oncilla", beside).unwrap();
    file.robot().unwrap()
}

fn setup(robot: &Robot) -> Setup {
    let motors = robot.motors.unwrap();
    Setup {
        base: Base::Free,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: Some(Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: Drives::Motors {
            hip: motors.hip,
            knee: motors.knee,
        },
        start: Start::default(),
    }
}

/// What is compared, each \[m\] or \[rad\].
fn wanted(name: &str) -> bool {
    name == "body/position" || name.ends_with("hip/position") || name.ends_with("knee/position")
}

/// Heights of the trunk, and angles of hips and knees, every 10 ms of three seconds, of legs that bend and stretch once in
/// two seconds.
fn stand(plant: &mut dyn Plant) -> Vec<(f64, Vec<f64>)> {
    let layout = Layout::of(&plant.ports(), Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    plant.observe(&mut outputs);
    let drives: Vec<_> = LEGS
        .iter()
        .flat_map(|leg| ["hip", "knee"].map(|joint| format!("leg/{leg}/{joint}/position")))
        .map(|name| layout.find(&name).unwrap().start)
        .collect();
    let height = layout.find("body/position").unwrap().start + 2;
    let home: Vec<f64> = drives.iter().map(|place| outputs[*place]).collect();
    let mut inputs = [1.0; 16];
    let mut track = Vec::new();
    for ms in 0..3000_u64 {
        let phase = core::f64::consts::PI * ms as f64 * 1e-3;
        let bend = 0.25 * (1.0 - libm::cos(phase));
        for (i, place) in drives.iter().enumerate() {
            let wanted = home[i] + [0.0, bend][i % 2];
            inputs[2 * i] = 40.0 * (wanted - outputs[*place]);
        }
        let next = SimTime::ZERO + SimDuration::from_millis(ms + 1);
        plant.advance(next, &inputs).unwrap();
        plant.observe(&mut outputs);
        if ms % 10 == 9 {
            let angles = drives.iter().map(|place| outputs[*place]).collect();
            track.push((outputs[height], angles));
        }
    }
    track
}

#[test]
fn both_plants_stand_alike_on_motors() {
    let robot = oncilla();
    let options = twinrig_massless::Options {
        setup: setup(&robot),
        force: Force::Solve,
    };
    let mut massless = Massless::new(&robot, &options, &wanted).unwrap();
    let options = twinrig_lcp::Options {
        setup: setup(&robot),
        method: Method::Rk4,
        tolerance: twinrig_lcp::Options::TOLERANCE,
        toe: false,
    };
    let mut lcp = Lcp::new(&robot, &options, &wanted).unwrap();
    let (one, other) = (stand(&mut massless), stand(&mut lcp));
    // Half a second to come to rest in.
    let (one, other) = (&one[50..], &other[50..]);
    let (mut height, mut angle) = (0.0_f64, 0.0_f64);
    let mut means = [0.0; 8];
    for (a, b) in one.iter().zip(other) {
        height = height.max((a.0 - b.0).abs());
        for ((a, b), mean) in a.1.iter().zip(&b.1).zip(&mut means) {
            angle = angle.max((a - b).abs());
            *mean += (a - b) / one.len() as f64;
        }
    }
    // A leg of 232 g has 139 g in its foot here, and its segments have theirs there: half a per cent of the height.
    assert!(height < 1.5e-3, "{height} m");
    // The trunk sways to and fro on its hips meanwhile, by 0.03 rad, and not quite as fast in one plant as in the other. In
    // the mean that goes.
    let mean = means
        .iter()
        .fold(0.0_f64, |most, mean| most.max(mean.abs()));
    assert!(angle < 0.04 && mean < 5e-3, "{angle} rad, {mean} rad");
    // They do bend their knees.
    assert!(one[50].0 < one[150].0 - 0.02);
}
