//! A run allocates no memory after its start.

use twinrig_legged::{Base, Constraints, Drives, FirmwarePlace, Setup};
use twinrig_massless::{Force, Massless, Method, Options};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use super::harness::{Harness, setup, trotting};

#[test]
fn steps_and_observations_allocate_nothing() {
    let (robot, setup) = (robot(), setup());
    check(&robot, &setup, trotting(&robot, &setup, Force::Solve, 1000));
}

#[test]
fn explicit_steps_allocate_nothing() {
    let robot = robot();
    let setup = Setup {
        base: Base::Fixed,
        ground: None,
        ..Trot::START.started(&robot, setup())
    };
    let options = Options {
        method: Method::ExplicitEuler,
        ..Options::new(setup.clone(), Force::LinearLookup { cells: 32 })
    };
    let mut harness = Harness::new(Massless::new(&robot, &options, &|_| true).unwrap());
    for ms in 1..=1000 {
        harness.trot(&robot, &setup, Trot::START, ms);
    }
    check(&robot, &setup, harness);
}

/// From the first command on, with several under way.
#[test]
fn serial_servos_allocate_nothing() {
    let cub = RobotFile::find("cheetah-cub-sts3215", "/".as_ref()).unwrap();
    let robot = cub.robot().unwrap();
    let mut servo = robot.serial.unwrap();
    servo.controller.command_delay = 5e-3;
    let setup = Setup {
        base: Base::Fixed,
        ground: None,
        drives: Drives::Serial {
            servo: Box::new(servo),
            firmware: FirmwarePlace::Plant,
        },
        ..setup()
    };
    let options = Options {
        constraints: Constraints::Compliant,
        ..Options::new(setup, Force::Solve)
    };
    let mut plant = Massless::new(&robot, &options, &|_| true).unwrap();
    let mut commands = [0.0; 8];
    plant.initial_inputs(&mut commands);
    let allocations = allocation_counter::measure(|| {
        for ms in 1..300 {
            commands[0] += 1e-3;
            plant.advance(at_ms(ms), &commands).unwrap();
        }
    });
    assert_eq!(allocations.count_total, 0);
}

fn check(robot: &Robot, setup: &Setup, mut harness: Harness) {
    let commands: Vec<Vec<f64>> = (1001..2000)
        .map(|ms| {
            let commands = Trot::START.legs(robot, setup, f64::from(ms) * 1e-3);
            commands
                .iter()
                .flat_map(|(_, command)| [command.hip, command.knee])
                .collect()
        })
        .collect();
    let mut outputs = vec![0.0; harness.observe().len()];
    let allocations = allocation_counter::measure(|| {
        for (ms, commands) in (1001..).zip(&commands) {
            harness.plant.advance(at_ms(ms), commands).unwrap();
            harness.plant.observe(&mut outputs);
            harness.plant.begin_window();
        }
    });
    assert_eq!(allocations.count_total, 0);
    // Check of the counter itself.
    assert!(allocation_counter::measure(|| drop(harness.plant.save())).count_total > 0);
}
