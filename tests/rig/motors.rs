//! A robot with motors under a position controller with a period of 1 ms, in both plants: during
//! slow motion they must agree, because only the distribution of the leg masses differs.

use std::path::Path;

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Lcp, Method};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start};
use twinrig_massless::{Force, Massless};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

fn oncilla() -> Robot {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let file = RobotFile::find("oncilla", root).unwrap();
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
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    }
}

/// Selects the compared signals, in \[m\] or \[rad\].
fn is_compared(name: &str) -> bool {
    name == "body/position" || name.ends_with("hip/position") || name.ends_with("knee/position")
}

/// Records height of the trunk, and angles of hips and knees, every 10 ms for three seconds, while
/// the legs bend and stretch with a period of two seconds.
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
    let home: Vec<f64> = drives.iter().map(|index| outputs[*index]).collect();
    let mut inputs = [1.0; 16];
    let mut track = Vec::new();
    for ms in 0..3000_u64 {
        let phase = core::f64::consts::PI * ms as f64 * 1e-3;
        let bend = 0.25 * (1.0 - libm::cos(phase));
        for (i, index) in drives.iter().enumerate() {
            let set_point = home[i] + [0.0, bend][i % 2];
            inputs[2 * i] = 40.0 * (set_point - outputs[*index]);
        }
        let next = SimTime::ZERO + SimDuration::from_millis(ms + 1);
        plant.advance(next, &inputs).unwrap();
        plant.observe(&mut outputs);
        if ms % 10 == 9 {
            let angles = drives.iter().map(|index| outputs[*index]).collect();
            track.push((outputs[height], angles));
        }
    }
    track
}

#[test]
fn plants_agree_for_slow_motion_on_motors() {
    let robot = oncilla();
    let options = twinrig_massless::Options::new(setup(&robot), Force::Solve);
    let mut massless = Massless::new(&robot, &options, &is_compared).unwrap();
    let options = twinrig_lcp::Options {
        constraints: twinrig_lcp::Constraints::Rigid,
        setup: setup(&robot),
        method: Method::Rk4,
        tolerance: twinrig_lcp::Options::TOLERANCE,
        features: twinrig_lcp::Features::Detected,
        toe: false,
    };
    let mut lcp = Lcp::new(&robot, &options, &is_compared).unwrap();
    let (first, second) = (stand(&mut massless), stand(&mut lcp));
    // The first half second is a transient.
    let (first, second) = (&first[50..], &second[50..]);
    let (mut height, mut angle) = (0.0_f64, 0.0_f64);
    let mut means = [0.0; 8];
    for (a, b) in first.iter().zip(second) {
        height = height.max((a.0 - b.0).abs());
        for ((a, b), mean) in a.1.iter().zip(&b.1).zip(&mut means) {
            angle = angle.max((a - b).abs());
            *mean += (a - b) / first.len() as f64;
        }
    }
    // A leg of 232 g has 139 g in its foot in the mass-less plant and distributed masses in the
    // other: half a per cent of the height.
    assert!(height < 1.5e-3, "{height} m");
    // The trunk sways on its hips by 0.03 rad, with slightly different speeds in the two plants;
    // the mean difference is small.
    let mean = means.iter().fold(0.0_f64, |max, mean| max.max(mean.abs()));
    assert!(angle < 0.04 && mean < 5e-3, "{angle} rad, {mean} rad");
    // The knees do bend.
    assert!(first[50].0 < first[150].0 - 0.02);
}
