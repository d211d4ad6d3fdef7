//! Mirrored robots, and motions in the plane.

use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use super::harness::{Harness, massless, setup};

/// Runs a trot with the commands of the legs permuted: `order` of LF, RF, LH, RH.
fn trotting_as(robot: &Robot, order: [usize; 4], ms: u64) -> Harness {
    let setup = setup();
    let ordered = |time_s: f64| {
        let commands = Trot::START.legs(robot, &setup, time_s);
        [0, 1, 2, 3].map(|i| (commands[i].0.clone(), commands[order[i]].1))
    };
    let start = Setup {
        start: ordered(0.0).to_vec().into(),
        ..setup.clone()
    };
    let mut harness = massless(robot, &start);
    for now in 1..=ms {
        for (pair, (_, command)) in harness
            .commands
            .chunks_mut(2)
            .zip(ordered(now as f64 * 1e-3))
        {
            pair.copy_from_slice(&[command.hip, command.knee]);
        }
        harness.advance_to_ms(now);
    }
    harness
}

#[test]
fn mirrored_robot_moves_as_the_mirror_image() {
    // A robot whose sides differ in mass and springs, and its mirror image.
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
    let mut harness = trotting_as(&robot, [0, 1, 2, 3], 200);
    let mut mirror = trotting_as(&mirrored, [1, 0, 3, 2], 200);
    let (a, b) = (harness.read("body/position"), mirror.read("body/position"));
    let (c, d) = (harness.read("body/rpy"), mirror.read("body/rpy"));
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
        "the motion leaves the plane: {a:?} {c:?}"
    );
    // Only rounding breaks the symmetry; contact amplifies 1e-16 to 1e-12 in 0.2 s.
    assert!(
        differences.iter().all(|x| x.abs() < 1e-9),
        "{differences:?}"
    );
}

/// Runs with equal commands of the fore legs, and of the hind legs.
fn pairwise(base: Base, robot: &Robot, ms: u64) -> Harness {
    let pair_commands = |time_s: f64| {
        let commands = Trot::START.legs(robot, &setup(), time_s);
        [0, 0, 2, 2].map(|i| commands[i].1)
    };
    let commands = pair_commands(0.0);
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
    let mut harness = massless(robot, &setup);
    for now in 1..=ms {
        for (pair, command) in harness
            .commands
            .chunks_mut(2)
            .zip(pair_commands(now as f64 * 1e-3))
        {
            pair.copy_from_slice(&[command.hip, command.knee]);
        }
        harness.advance_to_ms(now);
    }
    harness
}

#[test]
fn symmetric_motion_on_a_free_base_equals_that_on_a_planar_base() {
    let robot = robot();
    let (mut free, mut planar) = (
        pairwise(Base::Free, &robot, 150),
        pairwise(Base::Planar, &robot, 150),
    );
    for signal in ["body/position", "body/rpy", "leg/RF/foot/position"] {
        let (a, b) = (free.read(signal), planar.read(signal));
        for (x, y) in a.iter().zip(&b) {
            assert!(
                (x - y).abs() < 1e-9 * (1.0 + x.abs()),
                "{signal}: {a:?} {b:?}"
            );
        }
    }
    assert!(
        free.read("body/position")[0].abs() > 1e-3,
        "the robot moves forward"
    );
}

#[test]
fn measured_velocities_are_the_rates_of_measured_positions() {
    // In the air, the swing of three legs turns the trunk about all its axes. With steps of 0.1 ms
    // the error of the central difference is jerk · h²/6, at 1e5 m/s³ of the feet 2e-4 m/s; samples
    // with impacts are skipped.
    let robot = robot();
    let mut setup = setup();
    setup.step = SimDuration::from_micros(100);
    setup.ground = None;
    setup.legs.truncate(3);
    setup.start = Trot::START.legs(&robot, &setup, 0.0).into();
    let mut harness = massless(&robot, &setup);
    let mut samples = 0;
    let signals = ["body", "leg/LF/foot", "leg/LH/foot"];
    for ms in 1..=200_u64 {
        harness.trot(&robot, &setup, Trot::START, ms);
        let impact = harness.energy().impact;
        let mut next = |to_us: u64| {
            let target = at_ms(ms) + SimDuration::from_micros(to_us);
            harness.plant.advance(target, &harness.commands).unwrap();
            signals.map(|signal| {
                let position = harness.read(&format!("{signal}/position"));
                (position, harness.read(&format!("{signal}/velocity")))
            })
        };
        let (before, now, after) = (next(100), next(200), next(300));
        if harness.energy().impact > impact {
            continue;
        }
        samples += 1;
        for k in 0..signals.len() {
            for i in 0..3 {
                let rate = (after[k].0[i] - before[k].0[i]) / 2e-4;
                let measured = now[k].1[i];
                assert!(
                    (rate - measured).abs() < 2e-4,
                    "{} axis {i} at {ms} ms: {rate}, not {measured}",
                    signals[k]
                );
            }
        }
    }
    let spin = harness.read("body/angular_velocity");
    assert!(
        samples > 50 && spin.iter().all(|rate| rate.abs() > 1e-3),
        "{samples} {spin:?}"
    );
}
