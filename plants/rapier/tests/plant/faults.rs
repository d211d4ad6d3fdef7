//! A plant that diverges stops and reports the diverged part.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::StartPose;
use twinrig_rapier::{Joints, Options, Solver};
use twinrig_runtime::{Plant, PlantFault};
use twinrig_testing::reference_trajectory::ReferenceTrajectory;
use twinrig_testing::robots::{robot, suspended};

use crate::fixture::{Fixture, standing, with_joints, with_options};

/// Runs for half a second. Returns the fault, if any.
fn fault(fixture: &mut Fixture) -> Option<PlantFault> {
    let end = SimTime::ZERO + SimDuration::from_millis(500);
    fixture.plant.advance(end, &fixture.commands).err()
}

/// A leg at its stops, with stiff springs and rates of some ten rad/s.
fn swinging(step_us: u64) -> Fixture {
    let reference = ReferenceTrajectory::read("hard-hit");
    let setup = reference.setup(step_us);
    with_joints(&reference.robot(), setup, Joints::Impulse)
}

#[test]
fn excessive_steps_are_a_fault() {
    for step_us in [50_000, 100_000] {
        let fault = fault(&mut swinging(step_us));
        let fault = fault.unwrap_or_else(|| panic!("no fault at {step_us} µs"));
        assert!(
            fault.energy.is_finite() && fault.energy.abs() < 100.0,
            "{fault}"
        );
        assert!(fault.why.contains("shorten the step"), "{fault}");
        assert!(
            fault.part == "energy" || fault.part.starts_with("leg/"),
            "{fault}"
        );
    }
}

#[test]
fn any_step_ends_in_a_fault_or_a_plausible_state() {
    let robot = robot();
    let reach = 0.5;
    for step_us in [2_000, 5_000, 10_000, 20_000, 50_000, 100_000] {
        for joints in Joints::ALL {
            let mut fixture = with_joints(&robot, standing(step_us), joints);
            let fault = fault(&mut fixture);
            if fault.is_some() {
                assert!(step_us > 2_000, "{joints:?}: {fault:?}");
                continue;
            }
            let balance = fixture.plant.energy();
            // 1.1 kg from a height of 0.2 m: 2.2 J, and springs of the same order.
            assert!(
                balance.stored().abs() < 10.0 && balance.residual < 10.0,
                "{step_us}, {joints:?}: {balance:?}"
            );
            let [body, foot] =
                ["body/position", "leg/LF/foot/position"].map(|name| fixture.read(name));
            let difference: f64 = body.iter().zip(&foot).map(|(a, b)| (a - b) * (a - b)).sum();
            assert!(
                difference.sqrt() < reach,
                "{step_us}, {joints:?}: {difference}"
            );
        }
    }
}

#[test]
fn multibody_joints_with_engine_defaults_fault_or_stay_finite() {
    for name in ["hard-hit", "undamped", "passive"] {
        for step_us in [500, 2000] {
            let reference = ReferenceTrajectory::read(name);
            let options = Options {
                solver: Solver::engine_defaults(),
                ..Options::new(reference.setup(step_us), Joints::Multibody)
            };
            let mut fixture = with_options(&reference.robot(), &options);
            let fault = fault(&mut fixture);
            let energy = fixture.plant.energy();
            assert!(
                fault.is_some() || energy.stored().abs() < 10.0,
                "{name}: {energy:?}"
            );
        }
    }
}

#[test]
fn excessive_segment_rate_is_a_fault_in_the_first_step() {
    let start = StartPose {
        q: [0.0, -0.3, 0.3],
        rates: [3000.0, 0.0, 0.0],
    };
    let options = Options::new(suspended(&["LF"], start, 1000), Joints::Impulse);
    let mut fixture = with_options(&robot(), &options);
    let fault = fault(&mut fixture).unwrap();
    assert_eq!((fault.part.as_str(), fault.time), ("leg/LF", SimTime::ZERO));
    assert!(fault.why.contains("rad/s"), "{fault}");
}
