//! Properties of the bench as a plant.

use proptest::prelude::*;
use twinrig_kernel::SimDuration;
use twinrig_robot::serial::Gear;
use twinrig_runtime::Plant;
use twinrig_servo::{ServoBench, ServoBenchFile, ServoBenchParameters};

use crate::{OFF, Run, sound};

#[test]
fn energy_residual_falls_with_the_square_of_the_period() {
    let residual = |period: f64| {
        let mut servo = sound();
        servo.controller.period = period;
        servo.controller.quantized = false;
        let mut run = Run::new(&servo, &[], [1.3, 0.0]);
        run.at(0.1, OFF);
        run.at(0.3, OFF);
        run.bench.energy().residual.abs()
    };
    let [coarse, fine] = [residual(4e-3), residual(1e-3)];
    assert!(coarse < 1e-3 && fine < coarse / 8.0, "{coarse} {fine}");
}

/// A step is a bound of the substeps: half of it is a quarter of the residual, of a rule of order
/// 2.
#[test]
fn energy_residual_falls_with_the_square_of_the_substep() {
    let mut servo = sound();
    servo.controller.quantized = false;
    let residual = |substep: SimDuration| {
        let mut run = Run::new(&servo, &[], [1.3, 0.0]);
        run.bench = run.bench.with_substep(substep).unwrap();
        assert!(run.bench.substep() <= substep);
        run.at(0.1, OFF);
        run.bench.energy().residual.abs()
    };
    let [coarse, fine] = [500, 250].map(|micros| residual(SimDuration::from_micros(micros)));
    assert!((3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn substeps_get_no_longer_and_not_endlessly_short() {
    let bench = || ServoBench::new(&sound(), &|_| false).unwrap();
    let own = bench().substep();
    let longer = bench().with_substep(SimDuration::from_secs(1)).unwrap();
    assert_eq!(longer.substep(), own);
    let error = bench().with_substep(SimDuration::from_nanos(1));
    assert!(error.unwrap_err().to_string().contains("or longer"));
}

/// Parts that the file leaves out, and parts that have no effect, give the same bits.
#[test]
fn part_that_is_left_out_changes_no_bit() {
    let whole = include_str!("../../../../benches/xl330.toml");
    let (before, behind) = whole.split_once("[gear]").unwrap();
    let (_, controller) = behind.split_once("[controller]").unwrap();
    let without = format!("{before}[controller]{controller}");
    let read = |text: &str| {
        ServoBenchFile::parse("xl330.toml", text)
            .unwrap()
            .bench()
            .unwrap()
    };
    let left_out = read(&without);
    let mut without_effect = left_out.clone();
    without_effect.gear.driving_rate = 7.0;
    without_effect.friction.stribeck_rate = 7.0;
    without_effect.friction.stribeck_exponent = 1.5;
    without_effect.motor.current_limit = Some(1e3);
    let trajectory = |servo: &ServoBenchParameters| {
        let mut run = Run::new(servo, &["servo/angle", "servo/rate"], [0.3, 0.0]);
        let steps = 1..300_u32;
        let goal = |step: u32| {
            [
                libm::sin(f64::from(step) * 0.05),
                f64::from(u8::from(step < 200)),
            ]
        };
        steps
            .map(|step| run.at(f64::from(step) * 5e-3, goal(step)))
            .collect::<Vec<_>>()
    };
    assert_eq!(trajectory(&left_out), trajectory(&without_effect));
    assert_ne!(trajectory(&left_out), trajectory(&read(whole)));
}

#[test]
fn stiff_motor_is_refused() {
    let mut servo = sound();
    servo.motor.inertia = 1e-8;
    servo.load.mass = 0.0;
    servo.motor.resistance = 1e-3;
    assert!(ServoBench::new(&servo, &|_| true).is_err());
}

proptest! {
    #[test]
    fn trajectory_depends_neither_on_observation_nor_on_saving(
        cuts in proptest::collection::vec(0.0_f64..1.0, 1..20), goal in -1.5_f64..1.5,
        delay in 0.0_f64..0.004,
    ) {
        let mut servo = sound();
        servo.controller.command_delay = delay;
        let goals = |step: u32| [goal * libm::sin(f64::from(step)), f64::from(u8::from(step % 7 != 6))];
        let mut once = Run::new(&servo, &["servo/position", "servo/duty"], [0.1, 0.0]);
        let mut split = Run::new(&servo, &["servo/position", "servo/duty"], [0.1, 0.0]);
        for step in 1..40_u32 {
            let from = f64::from(step - 1) * 5.3e-3;
            let mut instants: Vec<f64> = cuts.iter().map(|cut| from + cut * 5.2e-3 + 1e-6).collect();
            instants.sort_by(f64::total_cmp);
            instants.dedup();
            for instant in instants {
                split.at(instant, goals(step));
            }
            let saved = split.bench.save();
            let mut restored = Run::new(&servo, &["servo/position", "servo/duty"], [0.0, 0.0]);
            restored.bench.restore(&saved).unwrap();
            split = restored;
            let to = f64::from(step) * 5.3e-3;
            prop_assert_eq!(once.at(to, goals(step)), split.at(to, goals(step)));
            prop_assert_eq!(once.bench.state(), split.bench.state());
        }
    }

    /// Whatever the parameters, friction only takes energy.
    #[test]
    fn friction_takes_energy_only(
        shares in proptest::array::uniform4(0.0_f64..0.9), driving_square in 0.0_f64..5.0,
        coulomb in 0.0_f64..0.1,
        stribeck in 0.0_f64..0.1, start in -3.0_f64..3.0, goal in -3.0_f64..3.0,
    ) {
        let mut servo = sound();
        let [driving, driven, static_driving, static_driven] = shares;
        servo.gear = Gear {
            driving, driven, static_driving, driving_square, static_driven, ..Gear::IDEAL
        };
        servo.friction.coulomb = coulomb;
        servo.friction.stribeck = stribeck;
        let mut run = Run::new(&servo, &["servo/angle"], [start, 0.0]);
        let mut before = 0.0;
        for step in 1..60 {
            run.at(f64::from(step) * 10e-3, [goal, f64::from(u8::from(step < 30))]);
            let dissipated = run.bench.energy().dissipated;
            prop_assert!(dissipated >= before);
            before = dissipated;
        }
    }
}
