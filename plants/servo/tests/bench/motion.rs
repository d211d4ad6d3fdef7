//! Motion of motor and arm beside closed forms.

use twinrig_robot::serial::{Friction, Gear};
use twinrig_servo::BenchLoad;

use crate::{GRAVITY, OFF, Run, frictionless, ideal};

/// Complete elliptic integral of the first kind, by the arithmetic-geometric mean.
fn elliptic(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    while (a - b).abs() > 1e-15 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    core::f64::consts::FRAC_PI_2 / a
}

/// A mass at the end of a rod: inertia `J_m + (m + m_a/3) l²`, moment of gravity `(m + m_a/2) g l`.
#[test]
fn free_swing_without_friction_has_the_period_of_the_pendulum() {
    let mut servo = ideal();
    for (arm_mass, amplitude) in [(0.0, 0.1), (0.0, 1.0), (0.0, 2.5), (0.3, 1.0)] {
        servo.load.arm_mass = arm_mass;
        let BenchLoad { mass, length, .. } = servo.load;
        let inertia = servo.motor.inertia + (mass + arm_mass / 3.0) * length * length;
        let natural = ((mass + arm_mass / 2.0) * GRAVITY * length / inertia).sqrt();
        let period = 4.0 * elliptic(libm::sin(0.5 * amplitude)) / natural;
        // Of second order: where the steps are halved, the error falls to a quarter. At 1 ms the
        // phase lags by (ω h)²/24 in a radian, 2e-4 after three periods. The amplitude drifts with
        // the third power, which at 2.5 rad is as much.
        let error = |seconds: f64| {
            let mut servo = servo.clone();
            servo.controller.period = seconds;
            let outputs = ["servo/angle", "servo/rate"];
            let end = Run::new(&servo, &outputs, [amplitude, 0.0]).at(3.0 * period, OFF);
            libm::hypot(end[0] - amplitude, end[1] / natural)
        };
        let [coarse, fine] = [error(1e-3), error(0.5e-3)];
        assert!(coarse < 5e-4 * amplitude, "{amplitude}: {coarse}");
        let ratio = coarse / fine;
        assert!((3.4..6.0).contains(&ratio), "{amplitude}: {ratio}");
    }
}

/// A constant deceleration c/J ends after v J/c, at an angle of v² J/(2 c).
#[test]
fn shaft_under_coulomb_friction_stops_where_its_energy_is_spent() {
    let mut servo = ideal();
    servo.load.mass = 0.0;
    for (rate, coulomb) in [(1.0, 0.02), (-3.7, 0.031), (0.004, 0.05)] {
        servo.friction.coulomb = coulomb;
        let mut run = Run::new(&servo, &["servo/angle", "servo/rate"], [0.0, rate]);
        let stop = 0.5 * servo.motor.inertia * rate * rate.abs() / coulomb;
        let end = run.at(1.0, OFF);
        // The midpoint rule is exact; rounding adds up over 160 steps.
        assert!((end[0] - stop).abs() < 1e-14, "{} {stop}", end[0]);
        assert_eq!(end[1], 0.0);
    }
}

#[test]
fn coulomb_friction_takes_its_work_of_each_swing_and_holds_the_arm_at_the_end() {
    let mut servo = ideal();
    servo.friction.coulomb = 0.02;
    let weight = servo.load.mass * GRAVITY * 0.1;
    let mut run = Run::new(&servo, &["servo/angle", "servo/rate"], [1.2, 0.0]);
    let (mut turning, mut last_rate) = (vec![1.2_f64], 0.0);
    let mut angle = 1.2;
    for step in 1..8_000 {
        let outputs = run.at(f64::from(step) * 1e-3, OFF);
        let rate = outputs[1];
        if rate * last_rate < 0.0 || (rate == 0.0 && last_rate != 0.0) {
            turning.push(angle);
        }
        (angle, last_rate) = (outputs[0], rate);
    }
    assert!(turning.len() > 8, "{turning:?}");
    for pair in turning.windows(2) {
        let [one, other] = [pair[0].abs(), pair[1].abs()];
        let lost = weight * (libm::cos(other) - libm::cos(one));
        // Turning points are known to a sample: 1 ms at 40 rad/s² is 2e-5 rad.
        assert!((lost - 0.02 * (one + other)).abs() < 2e-4, "{turning:?}");
    }
    assert_eq!(last_rate, 0.0);
    assert!((weight * libm::sin(angle)).abs() <= 0.02);
}

/// The arm is held against a torque of gravity between that of a driven and that of a driving gear.
#[test]
fn gear_holds_the_arm_between_the_torques_of_both_directions() {
    let mut servo = ideal();
    servo.gear = Gear {
        driving: 0.3,
        static_driving: 0.2,
        driven: 0.1,
        static_driven: 0.4,
        ..Gear::IDEAL
    };
    let angle = 0.6;
    let gravity = servo.load.mass * GRAVITY * 0.1 * libm::sin(angle);
    let per_duty = servo.motor.torque_constant * servo.supply.voltage / servo.motor.resistance;
    let per_radian = 400.0 * servo.controller.duty_per_count * 4096.0 / core::f64::consts::TAU;
    let moves = |torque: f64| {
        let command = angle + torque / per_duty / per_radian;
        let mut run = Run::new(&servo, &["servo/rate"], [angle, 0.0]);
        run.at(2e-3, [command, 1.0])[0].partial_cmp(&0.0).unwrap() as i8
    };
    for (torque, direction) in [
        (1.5 * 1.001, 1),
        (1.5 * 0.999, 0),
        (1.0, 0),
        (0.5 * 1.001, 0),
        (0.5 * 0.999, -1),
        (0.0, -1),
    ] {
        assert_eq!(moves(torque * gravity), direction, "{torque}");
    }
}

/// A driving gear that loses κ τ² lets the arm move where the torque exceeds that of gravity and
/// its loss; where it moves, both equations of the gear hold with one transmitted torque.
#[test]
fn gear_loses_the_square_of_the_torque_that_it_transmits() {
    let mut servo = ideal();
    let (driving, square) = (0.2, 1.5);
    servo.gear = Gear {
        driving,
        driving_square: square,
        ..Gear::IDEAL
    };
    let angle = 0.9;
    let arm = servo.load.mass * 0.01;
    let gravity = servo.load.mass * GRAVITY * 0.1 * libm::sin(angle);
    let per_duty = servo.motor.torque_constant * servo.supply.voltage / servo.motor.resistance;
    let per_radian = 400.0 * servo.controller.duty_per_count * 4096.0 / core::f64::consts::TAU;
    let holding = gravity + (driving + square * gravity) * gravity;
    for (share, moves) in [(0.999, false), (1.001, true), (1.2, true)] {
        let torque = share * holding;
        let command = angle + torque / per_duty / per_radian;
        let mut run = Run::new(&servo, &["servo/rate"], [angle, 0.0]);
        let seconds = 0.1e-3;
        let rate = run.at(1e-3, [command, 1.0])[0] * (seconds / 1e-3);
        assert_eq!(rate > 0.0, moves, "{share}");
        if moves {
            let acceleration = rate / seconds;
            let transmitted = arm * acceleration + gravity;
            let loss = (driving + square * transmitted) * transmitted;
            let left = torque - transmitted - loss - servo.motor.inertia * acceleration;
            // The induced voltage at the end of 1 ms takes 5 % of the excess.
            assert!(left.abs() < 0.06 * (torque - holding), "{left}");
        }
    }
}

/// Each law is the one before it with more parameters: the numbers are those of the formula.
#[test]
fn laws_of_friction_are_those_of_their_formula() {
    let (motor, external) = (0.3, -0.2);
    let mut law = Friction {
        viscous: 0.01,
        coulomb: 0.02,
        ..frictionless()
    };
    let mut expected = 0.02 + 0.01 * 0.5;
    let close = |law: &Friction, expected: f64| {
        for rate in [0.5, -0.5] {
            let found = law.torque(rate, motor, external);
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    };
    close(&law, expected);
    (law.motor_load, law.external_load) = (0.1, 0.1);
    expected += 0.1 * 0.5;
    close(&law, expected);
    (law.motor_load, law.external_load) = (0.1, 0.3);
    expected += 0.3 * 0.2 - 0.1 * 0.2;
    close(&law, expected);
    (law.motor_load_square, law.external_load_square) = (0.5, 0.25);
    expected += 0.5 * 0.09 + 0.25 * 0.04;
    close(&law, expected);
    (law.stribeck, law.stribeck_rate, law.stribeck_exponent) = (0.04, 0.25, 2.0);
    (law.stribeck_motor_load, law.stribeck_external_load) = (0.2, 0.4);
    close(&law, expected + libm::exp(-4.0) * (0.04 + 0.06 + 0.08));
    // At rest, and far above the rate of Stribeck.
    let rest = expected - 0.01 * 0.5 + 0.18;
    assert!((law.torque(0.0, motor, external) - rest).abs() < 1e-15);
    assert!((law.torque(50.0, motor, external) - (expected + 0.01 * 49.5)).abs() < 1e-12);
}

/// The torque of the motor under which a held arm starts to rise shows the friction at rest.
#[test]
fn arm_starts_where_the_motor_exceeds_gravity_and_friction() {
    let mut servo = ideal();
    servo.friction.coulomb = 0.01;
    servo.friction.stribeck = 0.03;
    servo.friction.external_load = 0.25;
    let angle = 0.6;
    let gravity = servo.load.mass * GRAVITY * 0.1 * libm::sin(angle);
    let per_duty = servo.motor.torque_constant * servo.supply.voltage / servo.motor.resistance;
    let per_radian = 400.0 * servo.controller.duty_per_count * 4096.0 / core::f64::consts::TAU;
    let hold = 0.04 + 0.25 * gravity;
    let rate = |torque: f64| {
        let command = angle + torque / per_duty / per_radian;
        Run::new(&servo, &["servo/rate"], [angle, 0.0]).at(2e-3, [command, 1.0])[0]
    };
    assert_eq!(rate(gravity + 0.999 * hold), 0.0);
    assert!(rate(gravity + 1.001 * hold) > 0.0);
    assert_eq!(rate(gravity - 0.999 * hold), 0.0);
    assert!(rate(gravity - 1.001 * hold) < 0.0);
}
