//! Currents, voltages and heat of the motor beside closed forms.

use twinrig_robot::serial::Heating;
use twinrig_runtime::Plant;
use twinrig_servo::ServoBenchParameters;

use crate::{OFF, Run, ideal};

#[test]
fn rate_under_full_duty_approaches_its_limit_with_the_time_constant_of_the_motor() {
    let mut servo = ideal();
    servo.load.mass = 0.0;
    servo.friction.viscous = 0.002;
    servo.controller.gain = 1e5;
    let motor = servo.motor;
    let damping = motor.torque_constant * motor.torque_constant / motor.resistance + 0.002;
    let stall = motor.torque_constant * servo.supply.voltage / motor.resistance;
    let mut run = Run::new(&servo, &["servo/rate", "servo/duty"], [0.0, 0.0]);
    for step in 1..100 {
        let seconds = f64::from(step) * 1.7e-3;
        let outputs = run.at(seconds, [1e4, 1.0]);
        let exact = stall / damping * -libm::expm1(-seconds * damping / motor.inertia);
        assert_eq!(outputs[1], 1.0);
        // The midpoint rule at 1 ms, of a time constant of 29 ms: (h/τ)²/6 is 2e-4, to which the
        // cubic between two steps adds as much.
        let error = (outputs[0] - exact).abs() / (stall / damping);
        assert!(error < 4e-4, "{seconds} {error}");
    }
}

/// A shaft without load that is turned faster than the supply: the diodes brake it to the rate at
/// which it induces the voltage of supply and diodes.
#[test]
fn open_bridge_conducts_what_is_induced_above_the_supply() {
    let mut servo = ideal();
    servo.load.mass = 0.0;
    servo.motor.diode_voltage = Some(1.4);
    let motor = servo.motor;
    let limit = (servo.supply.voltage + 1.4) / motor.torque_constant;
    let damping = motor.torque_constant * motor.torque_constant / motor.resistance;
    for (direction, start) in [(1.0, 1.5), (-1.0, 1.5), (1.0, 0.99)] {
        let start = direction * start * limit;
        let mut run = Run::new(&servo, &["servo/rate", "servo/supply"], [0.0, start]);
        for step in 1..60 {
            let seconds = f64::from(step) * 1.3e-3;
            let outputs = run.at(seconds, OFF);
            let excess = (start.abs() - limit).max(0.0);
            let excess = excess * libm::exp(-seconds * damping / motor.inertia);
            let exact = direction * (limit.min(start.abs()) + excess);
            // As for the full duty cycle.
            assert!((outputs[0] - exact).abs() < 2e-4 * limit, "{seconds}");
        }
    }
    servo.motor.diode_voltage = None;
    let mut run = Run::new(&servo, &["servo/rate"], [0.0, 1.5 * limit]);
    assert_eq!(run.at(0.1, OFF), [1.5 * limit]);
}

#[test]
fn supply_sags_and_current_is_limited() {
    let mut servo = ideal();
    servo.load.mass = 1e3 / 20.0;
    servo.supply.resistance = 0.5;
    servo.controller.gain = 1e5;
    let outputs = ["servo/supply", "servo/current"];
    // An arm that does not move in the first milliseconds.
    let stalled =
        |servo: &ServoBenchParameters| Run::new(servo, &outputs, [0.0, 0.0]).at(1e-3, [3.0, 1.0]);
    let [volts, winding] = [servo.supply.voltage, servo.motor.resistance];
    let at_rest = volts / (winding + 0.5);
    let free = stalled(&servo);
    assert!((free[1] / at_rest - 1.0).abs() < 1e-3, "{free:?}");
    assert!((free[0] - (volts - 0.5 * free[1])).abs() < 1e-12);
    servo.motor.current_limit = Some(1.0);
    assert_eq!(stalled(&servo), [volts - 0.5, 1.0]);
}

/// Iron that saturates takes half of the torque at its current, whatever the direction.
#[test]
fn torque_saturates_with_the_current() {
    let mut servo = ideal();
    servo.friction.coulomb = 10.0;
    servo.controller.gain = 1e5;
    let outputs = ["servo/current", "servo/torque"];
    let held = |servo: &ServoBenchParameters, command: f64| {
        Run::new(servo, &outputs, [0.0, 0.0]).at(5e-3, [command, 1.0])
    };
    let stall = servo.supply.voltage / servo.motor.resistance;
    for (current, share) in [(stall, 0.5), (3.0 * stall, 0.75), (stall / 4.0, 0.2)] {
        servo.motor.saturation_current = Some(current);
        let torque = share * servo.motor.torque_constant * stall;
        let [up, down] = [3.0, -3.0].map(|command| held(&servo, command));
        assert!((up[0] - stall).abs() < 1e-12 && (up[1] - torque).abs() < 1e-12);
        assert_eq!(down, [-up[0], -up[1]]);
    }
}

/// A held arm: the current of a constant duty cycle falls as its power heats the winding.
#[test]
fn winding_heats_up_by_its_power_and_cools_exponentially() {
    let mut servo = ideal();
    servo.friction.coulomb = 10.0;
    let heating = Heating {
        capacity: 0.5,
        cooling: Some(2.0),
    };
    servo.motor.heating = Some(heating);
    servo.controller.gain = 1e5;
    let mut run = Run::new(&servo, &["servo/current"], [0.0, 0.0]);
    let cold = servo.supply.voltage / servo.motor.resistance;
    let current = run.at(60.0, [3.0, 1.0])[0];
    let winding = servo.supply.voltage / current;
    let rise = (winding / servo.motor.resistance - 1.0) / 3.93e-3;
    let power = servo.supply.voltage * current;
    assert!(current < cold);
    assert!((rise - power * 2.0 / 0.5).abs() < 1e-3, "{rise} K");
    let heat = |run: &Run| {
        run.bench
            .state()
            .unwrap()
            .get("servo/winding/temperature_rise")
            .unwrap()[0]
    };
    let before = heat(&run);
    run.at(62.0, OFF);
    // The command to open the bridge is in force within a period.
    assert!((heat(&run) / before - libm::exp(-1.0)).abs() < 1e-3);
}
