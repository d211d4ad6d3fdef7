//! Compliant constraints in a trot, and setups that they refuse.

use twinrig_legged::{Abduction, Contacts, Drives, LeggedError, SetPoint, Setup};
use twinrig_massless::{Massless, MasslessError, Options};
use twinrig_robot::Robot;
use twinrig_runtime::{Plant, PlantEventKind};
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use super::harness::{Harness, setup};

fn build(robot: &Robot, setup: Setup) -> Result<Massless, MasslessError> {
    Massless::new(robot, &Options::compliant(setup, 1e-6), &|_| true)
}

/// Setup of a trot with linear set-points.
fn linear(robot: &Robot) -> Setup {
    Setup {
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Linear {
            period: twinrig_kernel::SimDuration::from_millis(2),
        },
        ..Trot::START.started(robot, setup())
    }
}

/// Trots from one instant to another, in steps of 2 ms.
fn trot(harness: &mut Harness, robot: &Robot, setup: &Setup, from_ms: u64, to_ms: u64) {
    for ms in (from_ms + 2..=to_ms).step_by(2) {
        harness.trot(robot, setup, Trot::START, ms);
    }
}

#[test]
fn restored_trot_continues_bit_for_bit() {
    let robot = robot();
    let setup = linear(&robot);
    let new = || Harness::new(build(&robot, setup.clone()).unwrap());
    let mut harness = new();
    trot(&mut harness, &robot, &setup, 0, 500);
    let saved = harness.plant.save();
    trot(&mut harness, &robot, &setup, 500, 700);
    let mut other = new();
    other.plant.restore(&saved).unwrap();
    trot(&mut other, &robot, &setup, 500, 700);
    let bits = |harness: &mut Harness| {
        let outputs = harness.observe().iter();
        outputs.map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&mut harness), bits(&mut other));
    assert_eq!(harness.plant.work(), other.plant.work());
}

#[test]
fn snapshot_of_rigid_constraints_is_refused() {
    let robot = robot();
    let rigid = Options::new(setup(), twinrig_massless::Force::Solve);
    let rigid = Massless::new(&robot, &rigid, &|_| true).unwrap();
    let mut compliant = build(&robot, setup()).unwrap();
    let error = compliant.restore(&rigid.save()).unwrap_err().to_string();
    assert!(error.contains("rigid constraints"), "{error}");
}

#[test]
fn trot_is_smooth_and_keeps_the_energy_balance() {
    let robot = robot();
    let setup = linear(&robot);
    let mut harness = Harness::new(build(&robot, setup.clone()).unwrap());
    trot(&mut harness, &robot, &setup, 0, 1000);
    let position = harness.read("body/position");
    assert!(position[2] > 0.08, "it stands: {position:?}");
    let balance = harness.energy();
    assert!(
        balance.residual.abs() < 1e-4 * balance.exchanged,
        "{balance:?}"
    );
    let work = harness.plant.work();
    let a_step = work.evaluations as f64 / 500.0;
    assert!(a_step < 14.0, "{a_step} evaluations a step of 2 ms");
    assert!(harness.plant.constraint_violation().unwrap() < 2e-3);
}

#[test]
fn legs_without_drives_or_compliance_are_refused() {
    let without_drives = Setup {
        drives: Drives::None,
        ..setup()
    };
    let error = build(&robot(), without_drives).unwrap_err();
    assert_eq!(error, MasslessError::WithoutDrives);
    let mut robot = robot();
    robot.legs[1].leg.compliance = None;
    let error = build(&robot, setup()).unwrap_err();
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::Compliance { leg }) if leg == "RF"),
        "{error}"
    );
}

#[test]
fn steps_and_observations_allocate_nothing() {
    let robot = robot();
    let setup = linear(&robot);
    let mut harness = Harness::new(build(&robot, setup.clone()).unwrap());
    trot(&mut harness, &robot, &setup, 0, 100);
    let mut outputs = vec![0.0; harness.observe().len()];
    let commands = harness.commands.clone();
    let allocations = allocation_counter::measure(|| {
        for ms in 51..100 {
            let at = twinrig_testing::plant_harness::at_ms(2 * ms);
            harness.plant.advance(at, &commands).unwrap();
            harness.plant.observe(&mut outputs);
            harness.plant.begin_window();
        }
    });
    assert_eq!(allocations.count_total, 0);
}

#[test]
fn touch_downs_converge_with_the_tolerance() {
    let robot = robot();
    let setup = linear(&robot);
    let landings = |tolerance| {
        let options = Options::compliant(setup.clone(), tolerance);
        let mut harness = Harness::new(Massless::new(&robot, &options, &|_| true).unwrap());
        harness.plant.log_events(true);
        trot(&mut harness, &robot, &setup, 0, 600);
        assert_eq!(
            harness.plant.work().events,
            harness.plant.events().len() as u64
        );
        let events = harness.plant.events().iter().filter(|event| {
            let reached = event.kind == PlantEventKind::Reached;
            event.part.ends_with("/ground") && reached && event.at_s > 0.05
        });
        events.cloned().collect::<Vec<_>>()
    };
    let fine = landings(1e-9);
    assert!(fine.len() > 3, "{fine:?}");
    for (tolerance, error_s) in [(1e-7, 1e-4), (1e-8, 1e-5)] {
        let coarse = landings(tolerance);
        assert_eq!(fine.len(), coarse.len(), "{fine:?} {coarse:?}");
        for (a, b) in fine.iter().zip(&coarse) {
            let apart = (a.at_s - b.at_s).abs();
            assert!(a.part == b.part && apart < error_s, "{a:?} {b:?}");
        }
    }
}
