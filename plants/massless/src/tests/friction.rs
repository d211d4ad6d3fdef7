//! Joint friction, from almost none to more than any step resolves by fixed-point iteration.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Setup, StartPose};
use twinrig_massless::{Force, Massless, Options};
use twinrig_robot::{JointFriction, Robot};
use twinrig_runtime::{Plant, PlantFault};
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use super::harness::{massless, setup};

/// Cheetah-cub with this friction in all joints \[N·m·s/rad\].
fn with_joint_friction(friction: f64) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        mount.leg.joint_friction = JointFriction {
            hip: friction,
            knee: friction,
            ankle: friction,
            toe: friction,
        };
    }
    robot
}

/// Passive legs of the thesis (2.5.1): no drives, no ground, the hips 10° in front and the knees
/// flexed by a tenth.
fn hanging(base: Base, step: SimDuration) -> Setup {
    let q = [10.0_f64, -9.5, 9.5].map(f64::to_radians);
    Setup {
        base,
        ground: None,
        drives: Drives::None,
        step,
        start: StartPose { q, rates: [0.0; 3] }.into(),
        ..setup()
    }
}

fn plant(robot: &Robot, setup: Setup) -> Massless {
    let force = Force::Solve;
    Massless::new(robot, &Options::new(setup, force), &|_| true).unwrap()
}

/// Plant whose legs swing between their stops without hitting them, as impacts would hide the order
/// of the method.
fn swinging(friction: f64, step_us: u64) -> Massless {
    let mut robot = with_joint_friction(friction);
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (-0.004, -0.004);
        mount.leg.parallel_travel = 0.014;
    }
    let mut setup = hanging(Base::Fixed, SimDuration::from_micros(step_us));
    setup.start = StartPose {
        q: [10.0_f64, -25.0, 37.0].map(f64::to_radians),
        rates: [6.0, -4.0, 3.0],
    }
    .into();
    plant(&robot, setup)
}

/// Angles of the leg LF every 10 ms, for 300 ms.
fn angles(friction: f64, step_us: u64) -> Vec<f64> {
    let mut plant = swinging(friction, step_us);
    let each = (1..=30).flat_map(|k| {
        plant.advance(at_ms(10 * k), &[]).unwrap();
        let state = plant.state().unwrap();
        state.get("leg/LF/angles").unwrap().to_vec()
    });
    each.collect()
}

/// With fixed-point iteration alone, friction of 2e-2 N·m·s/rad moved the hips of passive legs from
/// 10° to 66° at 2 ms, and the reported dissipation was −0.08 J.
#[test]
fn stiff_joint_friction_is_integrated_to_second_order() {
    for friction in [1e-3, 5e-3, 2e-2, 1e-1, 1.0] {
        let fine = angles(friction, 25);
        let difference = |step_us: u64| {
            let coarse = angles(friction, step_us);
            let difference = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs());
            difference.fold(0.0_f64, f64::max)
        };
        let [coarse, quarter] = [difference(2000), difference(500)];
        assert!(coarse < 2e-3, "{friction}: {coarse:.1e} rad");
        assert!(
            quarter < coarse / 8.0,
            "{friction}: {coarse:.1e} rad at 2 ms, {quarter:.1e} rad at 0.5 ms"
        );
    }
}

/// ∫ Σ d q̇² of hip, knee and ankle, from the observed rates, not from the energy balance of the
/// plant.
fn friction_work(plant: &mut Massless, friction: f64, until_us: u64) -> f64 {
    const EACH_US: u64 = 50;
    let power = |plant: &Massless| {
        let state = plant.state().unwrap();
        let of = |leg: &str| {
            let rates = state.get(&format!("leg/{leg}/rates")).unwrap();
            let joints = [rates[0], rates[1] - rates[0], rates[2] - rates[1]];
            friction * joints.iter().map(|rate| rate * rate).sum::<f64>()
        };
        ["LF", "RF", "LH", "RH"].map(of).iter().sum::<f64>()
    };
    let mut sum = 0.0;
    let mut before = power(plant);
    for k in 1..=until_us / EACH_US {
        let now = SimTime::ZERO + SimDuration::from_micros(k * EACH_US);
        plant.advance(now, &[]).unwrap();
        let after = power(plant);
        sum += 0.5e-6 * EACH_US as f64 * (before + after);
        before = after;
    }
    sum
}

#[test]
fn dissipated_energy_is_that_of_the_friction_law_at_the_observed_rates() {
    for friction in [1e-3, 5e-3, 2e-2] {
        let mut plant = swinging(friction, 50);
        let expected = friction_work(&mut plant, friction, 300_000);
        let balance = plant.energy();
        assert!(
            (balance.dissipated / expected - 1.0).abs() < 1e-3,
            "{friction}: {balance:?}, not {expected}"
        );
    }
}

/// Runs passive legs with any friction and step on any base; fails with the plant's fault.
fn run_passive(base: Base, friction: f64, step_us: u64, q: [f64; 3]) -> Result<(), PlantFault> {
    let mut setup = hanging(base, SimDuration::from_micros(step_us));
    setup.start = StartPose {
        q,
        rates: [3.0, -2.0, 4.0],
    }
    .into();
    let mut plant = plant(&with_joint_friction(friction), setup);
    let mut dissipated = 0.0;
    let energy_before = plant.energy().stored();
    for k in 1..=40 {
        plant.advance(at_ms(10 * k), &[])?;
        let balance = plant.energy();
        assert!(
            balance.dissipated >= dissipated,
            "{balance:?} after {dissipated}"
        );
        assert!(
            balance.residual.abs() < 1e-5 * balance.exchanged + 1e-9,
            "{balance:?}"
        );
        assert!(
            balance.stored() - energy_before < 1e-3 * balance.exchanged + 1e-9,
            "{balance:?}"
        );
        dissipated = balance.dissipated;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn friction_dissipates_and_energy_balance_closes_for_any_friction_and_step(
        base in prop_oneof![Just(Base::Free), Just(Base::Planar), Just(Base::Fixed)],
        digits in -4.0..1.0_f64,
        step_us in 100..5000_u64,
        hip in -0.6..0.6_f64,
        knee in -1.2..-0.1_f64,
    ) {
        let friction = libm::pow(10.0, digits);
        let outcome = run_passive(base, friction, step_us, [hip, knee, 0.05 - knee]);
        prop_assert!(outcome.is_ok(), "{:?}", outcome);
    }
}

#[test]
fn energy_balance_closes_in_a_trot_with_stiff_joints() {
    for friction in [1e-2, 1e-1] {
        let robot = with_joint_friction(friction);
        let mut setup = setup();
        setup.start = Trot::START.legs(&robot, &setup, 0.0).into();
        let mut harness = massless(&robot, &setup);
        for ms in 1..=600 {
            harness.trot(&robot, &setup, Trot::START, ms);
        }
        let balance = harness.energy();
        assert!(
            balance.dissipated > 0.0 && balance.exchanged > 1.0,
            "{balance:?}"
        );
        assert!(
            balance.residual.abs() < 1e-6 * balance.exchanged,
            "{friction}: {balance:?}"
        );
    }
}

#[test]
fn friction_that_generates_energy_is_a_fault() {
    // A robot file cannot contain negative friction; this simulates a defect.
    let step = SimDuration::from_millis(1);
    let mut plant = plant(&with_joint_friction(-1e-3), hanging(Base::Fixed, step));
    let fault = (1..100)
        .find_map(|k| plant.advance(at_ms(10 * k), &[]).err())
        .unwrap();
    assert!(
        fault.why.contains("friction has generated") && fault.part == "integrator",
        "{fault}"
    );
}
