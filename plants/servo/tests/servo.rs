//! Motion of a servo on its bench beside closed forms, and its properties as a plant.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Plant;
use twinrig_servo::{
    BenchLoad, Friction, GearLoss, Heating, ServoBench, ServoBenchFile, ServoBenchParameters,
};

const GRAVITY: f64 = 9.80665;

fn sound() -> ServoBenchParameters {
    let file = ServoBenchFile::find("xl330", "".as_ref()).unwrap().unwrap();
    file.bench().unwrap()
}

/// The servo without friction, losses, heating, delays and quantisation.
fn ideal() -> ServoBenchParameters {
    let mut servo = sound();
    servo.friction = frictionless();
    servo.gear = GearLoss::NONE;
    servo.motor.heating = None;
    servo.supply.resistance = 0.0;
    servo.load.offset = 0.0;
    (
        servo.controller.command_delay,
        servo.controller.reading_delay,
    ) = (0.0, 0.0);
    servo.controller.quantized = false;
    servo
}

fn frictionless() -> Friction {
    Friction {
        viscous: 0.0,
        coulomb: 0.0,
        stribeck: 0.0,
        stribeck_rate: 0.1,
        stribeck_exponent: 1.0,
        motor_load: 0.0,
        external_load: 0.0,
        stribeck_motor_load: 0.0,
        stribeck_external_load: 0.0,
        motor_load_square: 0.0,
        external_load_square: 0.0,
    }
}

/// A bench with some outputs, from a state of angle and rate.
struct Run {
    bench: ServoBench,
    outputs: Vec<f64>,
}

impl Run {
    fn new(servo: &ServoBenchParameters, outputs: &[&str], [angle, rate]: [f64; 2]) -> Self {
        let names: Vec<String> = outputs.iter().map(|&name| name.to_owned()).collect();
        let mut bench = ServoBench::new(servo, &|name| names.iter().any(|it| it == name)).unwrap();
        let state = bench.state().unwrap();
        let state = state
            .with("servo/angle", &[angle])
            .with("servo/rate", &[rate]);
        bench.resume_from(&state).unwrap();
        Self {
            bench,
            outputs: vec![0.0; outputs.len()],
        }
    }

    /// Outputs at an instant \[s\], with the inputs until then.
    fn at(&mut self, seconds: f64, inputs: [f64; 2]) -> Vec<f64> {
        let time = SimTime::ZERO + SimDuration::try_from_secs_f64(seconds).unwrap();
        self.bench.advance(time, &inputs).unwrap();
        self.bench.observe(&mut self.outputs);
        self.outputs.clone()
    }
}

const OFF: [f64; 2] = [0.0, 0.0];

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

/// The arm is held against a torque of gravity between that of a driven and that of a driving gear.
#[test]
fn gear_holds_the_arm_between_the_torques_of_both_directions() {
    let mut servo = ideal();
    servo.gear = GearLoss {
        driving: 0.3,
        static_driving: 0.2,
        driven: 0.1,
        static_driven: 0.4,
        ..GearLoss::NONE
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
    servo.gear = GearLoss {
        driving,
        driving_square: square,
        ..GearLoss::NONE
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

/// The duty cycle is zero within the dead zone, jumps to its start beyond, and grows from there.
#[test]
fn duty_cycle_begins_behind_the_dead_zone() {
    let mut servo = ideal();
    servo.friction.coulomb = 10.0;
    servo.controller.quantized = true;
    servo.controller.gain = 32.0;
    servo.controller.duty_per_count = 1.0 / 4000.0;
    servo.controller.dead_zone = 1.0;
    servo.controller.starting_duty = 0.016;
    let per_count = core::f64::consts::TAU / 4096.0;
    // Error in counts, duty cycle in per mille.
    for (error, duty) in [
        (0, 0.0),
        (1, 0.0),
        (2, 24.0),
        (9, 80.0),
        (-2, -24.0),
        (200, 1000.0),
    ] {
        let mut run = Run::new(&servo, &["servo/duty"], [0.0, 0.0]);
        let found = run.at(2e-3, [f64::from(error) * per_count, 1.0])[0];
        assert!((found - duty * 1e-3).abs() < 1e-12, "{error}: {found}");
    }
}

/// A controller that knows counts rounds command and position; another one knows both exactly.
#[test]
fn error_of_position_is_in_whole_counts() {
    let mut servo = ideal();
    servo.friction.coulomb = 10.0;
    let per_count = core::f64::consts::TAU / 4096.0;
    // Position, command, and the error that the controller sees, all in counts.
    for (position, command, seen) in [(0.0, 0.4, 0.0), (0.0, 0.6, 1.0), (0.6, 1.4, 0.0)] {
        for (quantized, error) in [(true, seen), (false, command - position)] {
            servo.controller.quantized = quantized;
            let mut run = Run::new(&servo, &["servo/duty"], [position * per_count, 0.0]);
            let found = run.at(2e-3, [command * per_count, 1.0])[0];
            let duty = error * servo.controller.gain * servo.controller.duty_per_count;
            assert!((found - duty).abs() < 1e-12, "{command}: {found}");
        }
    }
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

#[test]
fn command_is_in_force_from_the_first_step_after_its_delay() {
    let mut servo = ideal();
    servo.controller.command_delay = 2.3e-3;
    let mut run = Run::new(&servo, &["servo/duty"], [0.0, 0.0]);
    run.at(0.5e-3, [0.0, 1.0]);
    // It arrives at 0.5 ms and is in force from the step at 3 ms.
    assert_eq!(run.at(2.999e-3, [0.5, 1.0]), [0.0]);
    assert!(run.at(3.001e-3, [0.5, 1.0])[0] > 0.0);
}

#[test]
fn position_is_read_in_counts_and_after_its_delay() {
    let mut servo = ideal();
    servo.controller.reading_delay = 3e-3;
    let names = ["servo/angle", "servo/reading", "servo/position"];
    let mut run = Run::new(&servo, &names, [1.0, 0.0]);
    let count = core::f64::consts::TAU / 4096.0;
    let earlier = run.at(0.1, OFF)[0];
    let [_, reading, position] = run.at(0.103, OFF)[..] else {
        unreachable!("three outputs");
    };
    assert!((reading - earlier).abs() < 1e-12);
    assert!((position / count - (earlier / count).round()).abs() < 1e-9);
}

#[test]
fn profile_obeys_its_limits_and_ends_at_the_command() {
    let mut servo = ideal();
    // A stiff controller shows the set-point, 0.02 rad below it under gravity.
    servo.controller.gain = 1e4;
    servo.controller.profile_speed = Some(2.0);
    servo.controller.profile_acceleration = Some(10.0);
    let mut run = Run::new(&servo, &["servo/angle", "servo/rate"], [0.0, 0.0]);
    let mut fastest: f64 = 0.0;
    for step in 1..1500 {
        let outputs = run.at(f64::from(step) * 1e-3, [1.0, 1.0]);
        fastest = fastest.max(outputs[1]);
    }
    let angle = run.at(2.0, [1.0, 1.0])[0];
    assert!((angle - 1.0).abs() < 0.03, "{angle}");
    assert!((1.8..2.5).contains(&fastest), "{fastest}");
    // 0.2 s of acceleration, 0.3 s of speed, 0.2 s of deceleration.
    let mut run = Run::new(&servo, &["servo/angle"], [0.0, 0.0]);
    let half = run.at(0.35, [1.0, 1.0])[0];
    assert!((half - 0.5).abs() < 0.05, "{half}");
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

/// Parts that the file leaves out, and parts that have no effect, give the same bits.
#[test]
fn part_that_is_left_out_changes_no_bit() {
    let whole = include_str!("../files/xl330.toml");
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
        servo.gear = GearLoss {
            driving, driven, static_driving, driving_square, static_driven, ..GearLoss::NONE
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
