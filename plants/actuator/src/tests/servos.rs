//! Test bench of servos.

use twinrig_actuator::SetPoint;
use twinrig_actuator::drives::ServoBench;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::Servo;
use twinrig_runtime::Plant;

/// Similar to a Kondo KRS2350.
const SERVO: Servo = Servo {
    torque: 2.0,
    speed: 6.545,
    lag: 0.02,
    dead_band: 0.005,
    inertia: 1e-4,
};

fn bench(legs: &[&str]) -> ServoBench {
    let legs: Vec<String> = legs.iter().map(|leg| (*leg).to_owned()).collect();
    ServoBench::new(&legs, &SERVO, &|_| true).unwrap()
}

fn at(ms: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(ms)
}

#[test]
fn servos_reach_their_commands_within_the_speed_limit() {
    let mut bench = bench(&["LF", "RF"]);
    let mut positions = [0.0; 2];
    let mut before = positions;
    for ms in 1..=500 {
        bench.advance(at(ms), &[0.5, -0.2]).unwrap();
        bench.observe(&mut positions);
        for (now, previous) in positions.iter().zip(before) {
            assert!((now - previous).abs() <= 6.545e-3 + 1e-9);
        }
        before = positions;
    }
    // Within the dead band.
    assert!((positions[0] - 0.5).abs() <= 0.006 && (positions[1] + 0.2).abs() <= 0.006);
    assert!(bench.energy().residual.abs() < 1e-12 * bench.energy().exchanged);
    // At rest permanently: the positions do not change by a single bit.
    bench.advance(at(10_000), &[0.5, -0.2]).unwrap();
    bench.observe(&mut before);
    bench.advance(at(11_000), &[0.5, -0.2]).unwrap();
    bench.observe(&mut positions);
    assert_eq!((positions, bench.energy().kinetic), (before, 0.0));
}

#[test]
fn long_steps_are_divided_into_milliseconds() {
    let (mut one, mut many) = (bench(&["LF"]), bench(&["LF"]));
    one.advance(at(20), &[0.3]).unwrap();
    for ms in 1..=20 {
        many.advance(at(ms), &[0.3]).unwrap();
    }
    assert_eq!(one.save(), many.save());
    assert_eq!(one.work().steps, 20);
}

#[test]
fn torque_limit_bounds_the_acceleration() {
    let legs = ["LF".to_owned()];
    let weak = Servo {
        torque: 1e-3,
        ..SERVO
    };
    let mut bench = ServoBench::new(&legs, &weak, &|_| true).unwrap();
    bench.advance(at(10), &[1.0]).unwrap();
    let mut position = [0.0];
    bench.observe(&mut position);
    // ½ · 10 rad/s² · (10 ms)²
    assert!((position[0] - 5e-4).abs() < 1e-9, "{position:?}");
}

#[test]
fn restored_bench_continues_bit_for_bit() {
    let (mut one, mut two) = (bench(&["LF", "RH"]), bench(&["LF", "RH"]));
    one.advance(at(33), &[0.3, 0.1]).unwrap();
    two.restore(&one.save()).unwrap();
    for bench in [&mut one, &mut two] {
        bench.advance(at(70), &[-0.3, 0.2]).unwrap();
    }
    assert_eq!(one.save(), two.save());
    assert!(bench(&["LF"]).restore(&one.save()).is_err());
}

#[test]
fn non_finite_command_is_a_fault_that_names_its_port() {
    let mut bench = bench(&["LF", "RF"]);
    let fault = bench.advance(at(1), &[0.0, f64::NAN]).unwrap_err();
    assert_eq!(
        (fault.part.as_str(), fault.time),
        ("leg/RF/abduction/command", SimTime::ZERO)
    );
}

#[test]
fn only_requested_outputs_are_ports() {
    let legs = ["LF", "RF"].map(str::to_owned);
    let requested = |name: &str| name == "leg/RF/abduction/position";
    let bench = ServoBench::new(&legs, &SERVO, &requested).unwrap();
    assert_eq!(bench.ports().len(), 3);
    assert!(ServoBench::new(&["LF", "LF"].map(str::to_owned), &SERVO, &requested).is_err());
}

#[test]
fn linear_set_points_are_followed_with_the_lag_and_restored() {
    let period = SimDuration::from_micros(200_500);
    let linear = || bench(&["LF"]).with_set_point(SetPoint::Linear { period });
    let (mut one, mut two) = (linear(), linear());
    let mut position = [0.0];
    one.advance(at(180), &[0.4]).unwrap();
    one.observe(&mut position);
    // Behind the ramp by its lag, and by the dead band less at most.
    let behind = 0.4 / period.as_secs_f64() * (0.18 - SERVO.lag) - position[0];
    assert!(behind.abs() < SERVO.dead_band, "{behind} rad");
    two.restore(&one.save()).unwrap();
    for bench in [&mut one, &mut two] {
        bench.advance(at(190), &[0.4]).unwrap();
        bench.advance(at(400), &[-0.1]).unwrap();
    }
    assert_eq!(one.save(), two.save());
    assert!(bench(&["LF"]).restore(&one.save()).is_err(), "held");
}
