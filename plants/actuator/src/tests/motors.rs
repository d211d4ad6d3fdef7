//! Test bench of motors: exact at any step length, independent of subdivision, and without
//! allocations.

use std::path::Path;

use proptest::prelude::*;
use twinrig_actuator::DcMotor;
use twinrig_actuator::drives::{BenchMotors, DrivesError, Load, MotorBench, Shaft};
use twinrig_kernel::{Direction, Layout, SimTime};
use twinrig_robot::{Motor, RobotFile};
use twinrig_runtime::Plant;

fn motor() -> Motor {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let robot = RobotFile::find("oncilla", root).unwrap().robot().unwrap();
    robot.motors.unwrap().hip
}

fn loaded(legs: &[&str], load: Load) -> BenchMotors {
    let shaft = Shaft {
        motor: motor(),
        load,
    };
    BenchMotors {
        legs: legs.iter().map(|leg| (*leg).to_owned()).collect(),
        hip: shaft,
        knee: Shaft::bare(motor()),
    }
}

fn bench(legs: &[&str], load: Load) -> MotorBench {
    MotorBench::new(&loaded(legs, load), &|_| true).unwrap()
}

fn at(nanos: u64) -> SimTime {
    SimTime::from_nanos(nanos)
}

fn read(bench: &mut MotorBench, signal: &str) -> Vec<f64> {
    let layout = Layout::of(&bench.ports(), Direction::Output);
    let mut outputs = vec![f64::NAN; layout.len()];
    bench.observe(&mut outputs);
    outputs[layout.find(signal).unwrap()].to_vec()
}

#[test]
fn step_response_is_the_exponential_of_the_data_sheet() {
    let (sheet, mut bench) = (
        DcMotor::new(&motor()).unwrap(),
        bench(&["LF"], Load::default()),
    );
    let tau = sheet.time_constant();
    let mut previous = 0.0;
    for ms in 1..=10 {
        bench
            .advance(at(1_000_000 * ms), &[12.0, 1.0, 0.0, 0.0])
            .unwrap();
        let time = ms as f64 * 1e-3;
        let rise = -libm::expm1(-time / tau);
        let (final_rate, rate) = (
            0.5 * sheet.no_load_rate(),
            read(&mut bench, "leg/LF/hip/rate")[0],
        );
        assert!((rate - final_rate * rise).abs() < 1e-12 * final_rate);
        let position = read(&mut bench, "leg/LF/hip/position")[0];
        assert!((position - final_rate * (time - tau * rise)).abs() < 1e-14);
        let torque = read(&mut bench, "leg/LF/hip/torque")[0];
        let mean = sheet.torque(12.0, 1.0, (position - previous) / 1e-3);
        assert!((torque - mean).abs() < 1e-9, "{torque} {mean}");
        previous = position;
        assert_eq!(read(&mut bench, "leg/LF/angles"), [position, 0.0, 0.0]);
    }
    assert_eq!(read(&mut bench, "leg/LF/knee/position"), [0.0]);
}

#[test]
fn inertia_lengthens_the_rise_and_friction_lowers_the_final_rate() {
    let load = Load {
        inertia: 1e-3,
        friction: 0.02,
    };
    let (sheet, mut bench) = (DcMotor::new(&motor()).unwrap(), bench(&["LF"], load));
    let damping = sheet.damping() + load.friction;
    let tau = (sheet.inertia() + load.inertia) / damping;
    bench
        .advance(at(20_000_000), &[24.0, 1.0, 0.0, 0.0])
        .unwrap();
    let exact = sheet.stall_torque() / damping * -libm::expm1(-20e-3 / tau);
    let rate = read(&mut bench, "leg/LF/hip/rate")[0];
    assert!((rate - exact).abs() < 1e-12 * exact, "{rate} {exact}");
}

#[test]
fn bare_shafts_coast_without_loss_and_brake_to_exactly_zero() {
    let mut bench = bench(&["LF"], Load::default());
    bench
        .advance(at(50_000_000), &[24.0, 1.0, 0.0, 0.0])
        .unwrap();
    let rate = read(&mut bench, "leg/LF/hip/rate");
    bench
        .advance(at(5_050_000_000), &[24.0, 0.0, 0.0, 0.0])
        .unwrap();
    assert_eq!(read(&mut bench, "leg/LF/hip/rate"), rate);
    assert_eq!(read(&mut bench, "leg/LF/hip/torque"), [0.0]);
    for ms in 0..1000 {
        bench
            .advance(at(5_051_000_000 + 1_000_000 * ms), &[0.0, 1.0, 0.0, 0.0])
            .unwrap();
    }
    assert_eq!(read(&mut bench, "leg/LF/hip/rate"), [0.0]);
}

#[test]
fn only_requested_outputs_are_ports() {
    let bench_motors = loaded(&["LF", "RH"], Load::default());
    let bench = MotorBench::new(&bench_motors, &|name| name == "leg/RH/knee/position").unwrap();
    let names: Vec<String> = bench.ports().into_iter().map(|port| port.name).collect();
    assert_eq!(names.len(), 9);
    assert_eq!(names[1], "leg/LF/hip/bridge");
    assert_eq!(names[6], "leg/RH/knee/voltage");
    assert_eq!(names[8], "leg/RH/knee/position");
}

#[test]
fn invalid_benches_are_rejected() {
    let error_of =
        |bench_motors: &BenchMotors| MotorBench::new(bench_motors, &|_| true).unwrap_err();
    let duplicate = loaded(&["LF", "LF"], Load::default());
    assert_eq!(
        error_of(&duplicate),
        DrivesError::DuplicateLeg("LF".to_owned())
    );
    let negative = Load {
        inertia: -1.0,
        friction: 0.0,
    };
    assert!(matches!(
        error_of(&loaded(&["LF"], negative)),
        DrivesError::Load {
            drive: "hip",
            what: "inertia",
            ..
        }
    ));
    let mut without_resistance = loaded(&["LF"], Load::default());
    without_resistance.knee.motor.resistance = 0.0;
    assert!(matches!(
        error_of(&without_resistance),
        DrivesError::Motor { drive: "knee", .. }
    ));
}

#[test]
fn non_finite_input_is_a_fault_that_leaves_the_bench_unchanged() {
    let mut bench = bench(&["LF"], Load::default());
    bench
        .advance(at(1_000_000), &[24.0, 1.0, 0.0, 0.0])
        .unwrap();
    let saved = bench.save();
    let fault = bench
        .advance(at(2_000_000), &[24.0, 1.0, 0.0, f64::NAN])
        .unwrap_err();
    assert_eq!(
        (fault.part.as_str(), fault.time),
        ("leg/LF/knee/bridge", at(1_000_000))
    );
    assert_eq!(bench.save(), saved);
}

/// Steps \[ns\] with the inputs of two motors.
fn motions() -> impl Strategy<Value = Vec<(u64, [f64; 4])>> {
    let bridge = || prop_oneof![Just(0.0), Just(1.0), 0.0..1.0];
    let inputs = (-30.0..30.0, bridge(), -30.0..30.0, bridge());
    let inputs = inputs.prop_map(|(a, b, c, d)| [a, b, c, d]);
    prop::collection::vec((1..3_000_000_u64, inputs), 1..60)
}

fn load() -> impl Strategy<Value = Load> {
    (0.0..1e-3, prop_oneof![Just(0.0), 0.0..0.1])
        .prop_map(|(inertia, friction)| Load { inertia, friction })
}

proptest! {
    #[test]
    fn energy_balance_closes_to_rounding(motion in motions(), load in load()) {
        let (mut bench, mut now) = (bench(&["LF"], load), 0);
        for (step, inputs) in motion {
            now += step;
            bench.advance(at(now), &inputs).unwrap();
        }
        let balance = bench.energy();
        prop_assert!(balance.residual.abs() <= 1e-11 * balance.exchanged, "{:?}", balance);
        prop_assert!(balance.dissipated >= -1e-12 * balance.exchanged);
    }

    #[test]
    fn subdivided_steps_give_the_same_motion(motion in motions(), load in load(), share in 0.0..1.0_f64) {
        let (mut single, mut split, mut now) = (bench(&["LF"], load), bench(&["LF"], load), 0);
        for (step, inputs) in motion {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of milliseconds")]
            let part = (share * step as f64) as u64;
            if part > 0 && part < step {
                split.advance(at(now + part), &inputs).unwrap();
            }
            now += step;
            single.advance(at(now), &inputs).unwrap();
            split.advance(at(now), &inputs).unwrap();
        }
        for signal in ["leg/LF/hip/position", "leg/LF/hip/rate", "leg/LF/knee/rate"] {
            let [a, b] = [read(&mut single, signal)[0], read(&mut split, signal)[0]];
            prop_assert!((a - b).abs() < 1e-10, "{}: {} {}", signal, a, b);
        }
    }

    #[test]
    fn restored_bench_continues_bit_for_bit(
        before in motions(), after in motions(), other in motions(), load in load(),
    ) {
        let run = |bench: &mut MotorBench, mut now: u64, motion: &[(u64, [f64; 4])]| {
            for (step, inputs) in motion {
                now += step;
                bench.advance(at(now), inputs).unwrap();
            }
            now
        };
        let (mut one, mut two) = (bench(&["LF"], load), bench(&["LF"], load));
        let now = run(&mut one, 0, &before);
        run(&mut two, 0, &other);
        two.restore(&one.save()).unwrap();
        // Continues with the same inputs, and then with others.
        let (_, held) = before[before.len() - 1];
        let after = [vec![(777, held)], after].concat();
        run(&mut one, now, &after);
        run(&mut two, now, &after);
        prop_assert_eq!(one.save(), two.save());
    }
}

#[test]
fn snapshot_of_another_bench_is_rejected() {
    let other = bench(&["LF", "RF"], Load::default()).save();
    assert!(bench(&["LF"], Load::default()).restore(&other).is_err());
}

#[test]
fn steps_and_observations_allocate_nothing() {
    let mut bench = bench(&["LF", "RF", "LH", "RH"], Load::default());
    let layout = Layout::of(&bench.ports(), Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    let mut inputs = [0.0; 16];
    let counted = allocation_counter::measure(|| {
        for step in 1..5000_u64 {
            let n = usize::try_from(step % 16).unwrap();
            inputs[n] = if n % 2 == 0 { 7.0 - n as f64 } else { 1.0 };
            bench.advance(at(step * 123_457), &inputs).unwrap();
            bench.observe(&mut outputs);
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn bench_resumed_from_a_state_moves_bit_for_bit() {
    let legs = ["LF", "RH"];
    let inputs = [12.0, 1.0, -6.0, 1.0, 3.0, 1.0, 0.0, 0.0];
    let mut first = bench(&legs, Load::default());
    first.advance(at(3_000_000), &inputs).unwrap();
    // The state of a run is that of an observation.
    read(&mut first, "leg/LF/hip/position");
    let mut resumed = bench(&legs, Load::default());
    let state = first.state().unwrap();
    assert_eq!(resumed.resume_from(&state), Ok(Vec::new()));
    assert_eq!(resumed.energy().kinetic, first.energy().kinetic);
    for bench in [&mut first, &mut resumed] {
        bench.advance(at(5_000_000), &inputs).unwrap();
    }
    for name in [
        "leg/LF/hip/position",
        "leg/LF/knee/rate",
        "leg/RH/hip/position",
    ] {
        assert_eq!(read(&mut first, name), read(&mut resumed, name));
    }
    let unknown = state.with("leg/XX/hip/position", &[0.0]);
    assert_eq!(resumed.resume_from(&unknown).unwrap().len(), 1);
}

/// A board reads its own motors only: what others do, and when, changes no bit of theirs.
#[test]
fn motion_of_a_leg_does_not_depend_on_the_instants_of_others() {
    let position = |bench: &mut MotorBench, leg: &str| {
        let layout = Layout::of(&bench.ports(), Direction::Output);
        let signal = layout.find(&format!("leg/{leg}/hip/position")).unwrap();
        let mut outputs = vec![f64::NAN; layout.len()];
        let all = bench.observe_signals(signal.clone(), &mut outputs);
        assert!(!all && outputs.iter().filter(|value| value.is_finite()).count() == 1);
        outputs[signal.start].to_bits()
    };
    let (mut alone, mut beside) = (
        bench(&["LF"], Load::default()),
        bench(&["LF", "RH"], Load::default()),
    );
    let mut inputs = [0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0];
    for tick in 1..200_u64 {
        let now = at(tick * 1_000_000);
        beside
            .advance(at(now.as_nanos() - 331_700), &inputs)
            .unwrap();
        position(&mut beside, "RH");
        inputs[4] = 24.0 - 0.1 * tick as f64;
        alone.advance(now, &inputs[..4]).unwrap();
        beside.advance(now, &inputs).unwrap();
        assert_eq!(
            position(&mut alone, "LF"),
            position(&mut beside, "LF"),
            "tick {tick}"
        );
        inputs[0] = 12.0 - 0.1 * tick as f64;
    }
}
