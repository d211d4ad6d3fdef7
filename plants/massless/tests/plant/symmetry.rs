//! Mirrored robots, and motions that need no sideways freedom.

use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{Scene, Trot, at, robot, setup};

/// Commands of a trot, with the legs of this order in the place of LF, RF, LH, RH.
fn trotting_as(robot: &Robot, order: [usize; 4], ms: u64) -> Scene {
    let setup = setup();
    let ordered = |time_s: f64| {
        let commands = Trot::START.commands(robot, &setup, time_s);
        [0, 1, 2, 3].map(|i| (commands[i].0.clone(), commands[order[i]].1))
    };
    let start = Setup {
        start: ordered(0.0).to_vec().into(),
        ..setup.clone()
    };
    let mut scene = Scene::new(robot, &start);
    for now in 1..=ms {
        for (pair, (_, command)) in scene.commands.chunks_mut(2).zip(ordered(now as f64 * 1e-3)) {
            pair.copy_from_slice(&[command.hip, command.knee]);
        }
        scene.to(now);
    }
    scene
}

#[test]
fn a_mirrored_motion_is_the_mirrored_motion() {
    // A robot with the mass and springs of its sides different, and the other way round.
    let mut robot = robot();
    for mount in &mut robot.legs {
        if mount.name.starts_with('L') {
            mount.leg.diagonal.stiffness = 4000.0;
            mount.leg.mass.lumped_foot = 0.035;
            mount.hip[1] = 0.055;
        }
    }
    let mut mirrored = robot.clone();
    for (place, other) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
        mirrored.legs[place].leg = robot.legs[other].leg.clone();
        mirrored.legs[place].hip = robot.legs[other].hip;
        mirrored.legs[place].hip[1] *= -1.0;
    }
    let mut scene = trotting_as(&robot, [0, 1, 2, 3], 200);
    let mut image = trotting_as(&mirrored, [1, 0, 3, 2], 200);
    let (a, b) = (
        scene.read("body/position").to_vec(),
        image.read("body/position").to_vec(),
    );
    let (c, d) = (
        scene.read("body/rpy").to_vec(),
        image.read("body/rpy").to_vec(),
    );
    let differences = [
        a[0] - b[0],
        a[1] + b[1],
        a[2] - b[2],
        c[0] + d[0],
        c[1] - d[1],
        c[2] + d[2],
    ];
    assert!(
        a[1].abs() > 1e-4 && c[0].abs() > 1e-3,
        "it does not stay in the plane: {a:?} {c:?}"
    );
    // Only rounding tells left from right; contact makes 1e-16 into 1e-12 in 0.2 s.
    assert!(
        differences.iter().all(|x| x.abs() < 1e-9),
        "{differences:?}"
    );
}

/// Fore legs together, hind legs together.
fn pairwise(base: Base, robot: &Robot, ms: u64) -> Scene {
    let bound = |time_s: f64| {
        let commands = Trot::START.commands(robot, &setup(), time_s);
        [0, 0, 2, 2].map(|i| commands[i].1)
    };
    let commands = bound(0.0);
    let setup = Setup {
        base,
        start: robot
            .legs
            .iter()
            .zip(commands)
            .map(|(mount, command)| (mount.name.clone(), command))
            .collect(),
        ..setup()
    };
    let mut scene = Scene::new(robot, &setup);
    for now in 1..=ms {
        for (pair, command) in scene.commands.chunks_mut(2).zip(bound(now as f64 * 1e-3)) {
            pair.copy_from_slice(&[command.hip, command.knee]);
        }
        scene.to(now);
    }
    scene
}

#[test]
fn a_robot_whose_sides_move_together_needs_no_freedom_but_the_planes() {
    let robot = robot();
    let (mut free, mut planar) = (
        pairwise(Base::Free, &robot, 150),
        pairwise(Base::Planar, &robot, 150),
    );
    for signal in ["body/position", "body/rpy", "leg/RF/foot/position"] {
        let (a, b) = (free.read(signal).to_vec(), planar.read(signal).to_vec());
        for (x, y) in a.iter().zip(&b) {
            assert!(
                (x - y).abs() < 1e-9 * (1.0 + x.abs()),
                "{signal}: {a:?} {b:?}"
            );
        }
    }
    assert!(
        free.read("body/position")[0].abs() > 1e-3,
        "it goes somewhere"
    );
}

#[test]
fn what_is_measured_of_velocities_is_the_rate_of_what_is_measured_of_positions() {
    // In the air, the swinging of three legs turns the trunk about all its axes. Steps of 0.1 ms: the central difference is right
    // to jerk · h²/6, 1e5 m/s³ of the feet: 2e-4 m/s; what is hit in between is left out.
    let robot = robot();
    let mut setup = setup();
    setup.step = SimDuration::from_micros(100);
    setup.ground = None;
    setup.legs.truncate(3);
    setup.start = Trot::START.commands(&robot, &setup, 0.0).into();
    let mut scene = Scene::new(&robot, &setup);
    let mut good = 0;
    let signals = ["body", "leg/LF/foot", "leg/LH/foot"];
    for ms in 1..=200_u64 {
        scene.trot(&robot, &setup, Trot::START, ms);
        let impact = scene.energy().impact;
        let mut next = |to_us: u64| {
            let to = at(ms) + SimDuration::from_micros(to_us);
            scene.plant.advance(to, &scene.commands).unwrap();
            signals.map(|signal| {
                let position = scene.read(&format!("{signal}/position")).to_vec();
                (position, scene.read(&format!("{signal}/velocity")).to_vec())
            })
        };
        let (before, now, after) = (next(100), next(200), next(300));
        if scene.energy().impact > impact {
            continue;
        }
        good += 1;
        for k in 0..signals.len() {
            for i in 0..3 {
                let rate = (after[k].0[i] - before[k].0[i]) / 2e-4;
                let said = now[k].1[i];
                assert!(
                    (rate - said).abs() < 2e-4,
                    "{} axis {i} at {ms} ms: {rate}, not {said}",
                    signals[k]
                );
            }
        }
    }
    let spin = scene.read("body/angular_velocity").to_vec();
    assert!(
        good > 50 && spin.iter().all(|rate| rate.abs() > 1e-3),
        "{good} {spin:?}"
    );
}
