//! The inner loops: the duty cycle against logs of a real servo, and the other modes as documented.

use twinrig_dynamixel::x::{XL330_M288, XM430_W350, register as r};
use twinrig_dynamixel::{BridgeCommand, Registers, ServoMeasurements};

/// 5 V, room temperature.
const AT_REST: ServoMeasurements = ServoMeasurements {
    angle: 0.0,
    rate: 0.0,
    current: 0.0,
    voltage: 5.0,
    temperature: 25.0,
};

/// Registers of a servo at rest with torque on in a mode, and some other values.
fn registers(mode: i32, values: &[(u16, i32)]) -> Registers {
    let mut registers = Registers::new(XL330_M288.model);
    registers
        .write(r::OPERATING_MODE, &mode.to_le_bytes()[..1])
        .unwrap();
    (XL330_M288.firmware)().step(&mut registers, &AT_REST, 0);
    registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
    for &(address, value) in values {
        registers.set(address, value);
    }
    registers
}

/// Returns the duty cycle after some periods at rest \[register\].
fn settled(registers: &mut Registers, goal: (u16, i32), periods: u32) -> f64 {
    let mut firmware = (XL330_M288.firmware)();
    firmware.step(registers, &AT_REST, 0);
    registers.set(goal.0, goal.1);
    let mut duty = 0.0;
    for _ in 0..periods {
        if let BridgeCommand::Duty(found) = firmware.step(registers, &AT_REST, 0) {
            duty = 885.0 * found;
        }
    }
    duty
}

mod logs {
    use std::fs;
    use std::path::PathBuf;

    use serde_json::Value;

    use super::*;

    /// Sample of a log.
    struct Sample {
        time: f64,
        position: f64,
        goal: f64,
        pwm: f64,
        enabled: bool,
    }

    fn samples(log: &Value) -> Vec<Sample> {
        let entries = log["entries"].as_array().unwrap().iter();
        let number = |entry: &Value, name: &str| entry[name].as_f64().unwrap();
        entries
            .map(|entry| {
                // An unsigned word.
                let load = number(entry, "load");
                Sample {
                    time: number(entry, "timestamp"),
                    position: number(entry, "position"),
                    goal: number(entry, "goal_position"),
                    pwm: if load > 32_767.0 {
                        load - 65_536.0
                    } else {
                        load
                    },
                    enabled: entry["torque_enable"].as_bool().unwrap(),
                }
            })
            .collect()
    }

    /// Median distance of the duty cycles of a log from those of the firmware at the positions that
    /// are read some seconds later \[register\].
    fn median_distance(gain: i32, samples: &[Sample], later: f64) -> f64 {
        let mut registers = registers(3, &[(r::POSITION_P_GAIN, gain), (r::PWM_SLOPE, 255)]);
        let mut distances = Vec::new();
        for pair in samples.windows(2) {
            let [sample, next] = pair else { continue };
            if !(sample.enabled && next.enabled) {
                continue;
            }
            let share = (later / (next.time - sample.time)).min(1.0);
            let angle = sample.position + share * (next.position - sample.position);
            let measured = ServoMeasurements {
                angle,
                voltage: 7.3,
                ..AT_REST
            };
            registers.set(r::MAX_VOLTAGE_LIMIT, 80);
            let mut firmware = (XL330_M288.firmware)();
            let counts = sample.goal / std::f64::consts::TAU * 4_096.0 + 2_048.0;
            #[expect(
                clippy::cast_possible_truncation,
                reason = "goals are within two turns"
            )]
            let goal = counts.round() as i32;
            // Long enough for the slope; the goal is overwritten in the first period.
            for period in 0..60 {
                firmware.step(&mut registers, &measured, 0);
                if period == 0 {
                    registers.set(r::GOAL_POSITION, goal);
                }
            }
            let found = f64::from(registers.get(r::PRESENT_PWM));
            distances.push((found - sample.pwm).abs());
        }
        distances.sort_by(f64::total_cmp);
        distances[distances.len() / 2]
    }

    /// PWM = gain · error / 256, clipped at 885, within 3 counts at the median of each log. The
    /// position that is read is 0 to 4 ms older than that of the controller. With the documented
    /// gain, `K/128`, the distance is the duty cycle itself.
    #[test]
    fn duty_cycle_is_that_of_real_servos() {
        let Some(folder) = std::env::var_os("SERVO_LOGS").map(PathBuf::from) else {
            eprintln!("skipped: no logs");
            return;
        };
        let mut logs = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if !name.starts_with("xl330") {
                continue;
            }
            logs += 1;
            let log: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
            let gain = i32::try_from(log["kp"].as_i64().unwrap()).unwrap();
            let samples = samples(&log);
            let best = |gain| {
                let delays = (0..=8).map(|half| 0.5e-3 * f64::from(half));
                let distances = delays.map(|delay| median_distance(gain, &samples, delay));
                distances.fold(f64::INFINITY, f64::min)
            };
            let (ours, documented) = (best(gain), best(2 * gain));
            eprintln!("{name}: {ours}, with the documented gain {documented}");
            assert!(ours <= 3.0, "{name}: {ours}");
            assert!(documented > 3.0 * ours, "{name}: {documented}");
        }
        assert_eq!(logs, 10);
    }
}

#[test]
fn torque_off_opens_the_bridge_and_reports_measurements() {
    let mut registers = registers(3, &[(r::TORQUE_ENABLE, 0)]);
    let measured = ServoMeasurements {
        angle: 0.5,
        rate: -2.0,
        current: 0.1,
        voltage: 5.04,
        temperature: 30.4,
    };
    let bridge = (XL330_M288.firmware)().step(&mut registers, &measured, 0);
    assert_eq!(bridge, BridgeCommand::Open);
    // 2048 + 0.5/2π · 4096; −2 rad/s of 0.02398 rad/s; mA; 0.1 V; °C.
    for (address, expected) in [
        (r::PRESENT_POSITION, 2_374),
        (r::PRESENT_VELOCITY, -83),
        (r::PRESENT_CURRENT, 100),
        (r::PRESENT_INPUT_VOLTAGE, 50),
        (r::PRESENT_TEMPERATURE, 30),
        (r::PRESENT_PWM, 0),
    ] {
        assert_eq!(registers.get(address), expected, "{address}");
    }
}

#[test]
fn position_loop_is_proportional_up_to_its_limits() {
    let goal = |counts| (r::GOAL_POSITION, 2_048 + counts);
    for mode in [3, 4, 5] {
        let at = |values: &[(u16, i32)], counts| {
            settled(&mut registers(mode, values), goal(counts), 100)
        };
        assert_eq!(at(&[], 100), 400.0 * 100.0 / 256.0);
        assert_eq!(at(&[], -1_000), -885.0);
        assert_eq!(at(&[(r::GOAL_PWM, 300)], 1_000), 300.0);
        assert_eq!(at(&[(r::POSITION_P_GAIN, 800)], 100), 800.0 * 100.0 / 256.0);
    }
}

/// In reverse mode the sign of positions and duty cycles changes, but the motor still turns towards
/// the goal.
#[test]
fn reverse_mode_turns_to_the_other_side() {
    let mut registers = registers(4, &[(r::DRIVE_MODE, 1)]);
    let duty = settled(&mut registers, (r::GOAL_POSITION, 2_048 + 100), 100);
    assert_eq!(duty, -400.0 * 100.0 / 256.0);
    assert_eq!(registers.get(r::PRESENT_PWM), 156);
}

/// 18 ms from 0 to 100 % at 5 V with the initial slope (manual, "PWM Slope Example").
#[test]
fn duty_cycle_rises_at_the_documented_slope() {
    let reached = |periods| settled(&mut registers(16, &[]), (r::GOAL_PWM, 885), periods);
    assert!(reached(17) < 885.0);
    assert_eq!(reached(19), 885.0);
}

/// The profile takes t₁ = 64 V/A ms to its velocity (manual, "What is the Profile"), and reaches
/// the goal after the distance over the velocity, and t₁.
#[test]
fn profiles_have_the_documented_times() {
    let [velocity, acceleration, distance] = [200, 100, 1_000];
    let mut registers = registers(4, &[]);
    let mut firmware = (XL330_M288.firmware)();
    firmware.step(&mut registers, &AT_REST, 0);
    for (address, value) in [
        (r::PROFILE_VELOCITY, velocity),
        (r::PROFILE_ACCELERATION, acceleration),
        (r::GOAL_POSITION, 2_048 + distance),
    ] {
        registers.set(address, value);
    }
    let (mut fast, mut reached) = (0, 0);
    for period in 1..2_000 {
        firmware.step(&mut registers, &AT_REST, 0);
        if fast == 0 && registers.get(r::VELOCITY_TRAJECTORY) == velocity {
            fast = period;
        }
        if fast > 0 && registers.get(r::VELOCITY_TRAJECTORY) == 0 {
            reached = period;
            break;
        }
    }
    assert_eq!(registers.get(r::POSITION_TRAJECTORY), 2_048 + distance);
    let counts_per_ms = 0.229 * f64::from(velocity) / 60.0 * 4.096;
    let expected = f64::from(distance) / counts_per_ms + 128.0;
    assert!((126..=129).contains(&fast), "{fast}");
    assert!(
        (f64::from(reached) - expected).abs() < 3.0,
        "{reached} {expected}"
    );
}

#[test]
fn velocity_and_current_loops_approach_their_goals() {
    // A motor without load: 0.3 V·s/rad at 5 V, 3.4 Ω.
    let ends = |mode, goal: (u16, i32)| {
        let mut registers = registers(mode, &[]);
        let mut firmware = (XL330_M288.firmware)();
        let mut measured = AT_REST;
        registers.set(goal.0, goal.1);
        for _ in 0..5_000 {
            let BridgeCommand::Duty(duty) = firmware.step(&mut registers, &measured, 0) else {
                panic!("the torque is on");
            };
            measured.current = (5.0 * duty - 0.3 * measured.rate) / 3.4;
            if mode == 1 {
                measured.rate += 1e-3 * (0.3 * measured.current - 2e-3 * measured.rate) / 1.5e-3;
            }
        }
        [r::PRESENT_VELOCITY, r::PRESENT_CURRENT].map(|it| registers.get(it))
    };
    let [velocity, _] = ends(1, (r::GOAL_VELOCITY, 100));
    assert!((99..=101).contains(&velocity), "{velocity}");
    let [_, current] = ends(0, (r::GOAL_CURRENT, -400));
    assert!((-402..=-398).contains(&current), "{current}");
}

#[test]
fn silence_of_the_bus_stops_the_servo() {
    let mut registers = registers(3, &[(r::BUS_WATCHDOG, 2)]);
    let mut firmware = (XL330_M288.firmware)();
    for period in 0..200 {
        // An instruction every 30 ms.
        firmware.step(&mut registers, &AT_REST, period / 30);
    }
    assert_eq!(registers.get(r::BUS_WATCHDOG), 2);
    firmware.step(&mut registers, &AT_REST, 7);
    let stopped = (1..100).find(|_| {
        firmware.step(&mut registers, &AT_REST, 7);
        registers.get(r::BUS_WATCHDOG) == 0xff
    });
    // 2 units of 20 ms, and up to a period of the loops at either end.
    assert!((39..=42).contains(&stopped.unwrap()), "{stopped:?}");
}

/// Also where the goal is a duty cycle or a current.
#[test]
fn silence_of_the_bus_ends_duty_cycles_and_currents() {
    for (mode, goal) in [(16, r::GOAL_PWM), (0, r::GOAL_CURRENT)] {
        let mut registers = registers(mode, &[(goal, 500), (r::BUS_WATCHDOG, 2)]);
        let mut firmware = (XL330_M288.firmware)();
        let mut duty = 0.0;
        for period in 0..200 {
            let measured = ServoMeasurements {
                current: duty,
                ..AT_REST
            };
            let bridge = firmware.step(&mut registers, &measured, 0);
            if let BridgeCommand::Duty(found) = bridge {
                duty = found;
            }
            assert!(period != 30 || duty > 0.1, "mode {mode}: {duty}");
        }
        assert_eq!(registers.get(r::BUS_WATCHDOG), 0xff);
        assert!(duty.abs() < 1e-3, "mode {mode}: {duty}");
    }
}

/// At power-on, and when position control begins, the position is within one turn; in extended
/// position control it counts turns.
#[test]
fn positions_are_within_one_turn_where_they_should_be() {
    let far = ServoMeasurements {
        angle: 4.0,
        ..AT_REST
    };
    // 4/2π · 4096, and the middle.
    let counts = 2_608 + 2_048;
    for (mode, expected) in [(3, counts - 4_096), (4, counts)] {
        let mut registers = Registers::new(XL330_M288.model);
        registers.write(r::OPERATING_MODE, &[mode]).unwrap();
        let mut firmware = (XL330_M288.firmware)();
        firmware.step(&mut registers, &AT_REST, 0);
        firmware.step(&mut registers, &far, 0);
        registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
        let bridge = firmware.step(&mut registers, &far, 0);
        assert_eq!(bridge, BridgeCommand::Duty(0.0));
        let found = [r::PRESENT_POSITION, r::GOAL_POSITION].map(|it| registers.get(it));
        assert_eq!(found, [expected; 2]);
        firmware.clear_turns();
        let bridge = firmware.step(&mut registers, &far, 0);
        assert_eq!(bridge, BridgeCommand::Duty(0.0));
        assert_eq!(registers.get(r::PRESENT_POSITION), counts - 4_096);
    }
}

#[test]
fn supply_outside_of_its_limits_shuts_the_servo_down_until_it_restarts() {
    let mut registers = registers(3, &[]);
    let mut firmware = (XL330_M288.firmware)();
    let low = ServoMeasurements {
        voltage: 3.4,
        ..AT_REST
    };
    assert_eq!(firmware.step(&mut registers, &low, 0), BridgeCommand::Open);
    registers.set(r::TORQUE_ENABLE, 1);
    assert_eq!(
        firmware.step(&mut registers, &AT_REST, 0),
        BridgeCommand::Open
    );
    registers.restart();
    firmware.step(&mut registers, &AT_REST, 0);
    registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
    assert_eq!(
        firmware.step(&mut registers, &AT_REST, 0),
        BridgeCommand::Duty(0.0)
    );
}

#[test]
fn a_stalled_motor_at_its_limit_is_an_overload() {
    let mut registers = registers(3, &[]);
    let goal = (r::GOAL_POSITION, 4_000);
    settled(&mut registers, goal, 900);
    assert_eq!(registers.get(r::TORQUE_ENABLE), 1);
    settled(&mut registers, goal, 1_100);
    assert_eq!(registers.get(r::TORQUE_ENABLE), 0);
    assert_eq!(registers.get(r::HARDWARE_ERROR_STATUS), 0x20);
}

/// Goals are refused after silence, until the watchdog is reset.
#[test]
fn goals_are_refused_after_silence() {
    let mut registers = registers(3, &[]);
    registers.set(r::BUS_WATCHDOG, 0xff);
    let goal = 2_100_i32.to_le_bytes();
    let refused = registers.write(r::GOAL_POSITION, &goal);
    assert_eq!(refused, Err(twinrig_dynamixel::ErrorNumber::DATA_RANGE));
    registers.write(r::BUS_WATCHDOG, &[0]).unwrap();
    registers.write(r::GOAL_POSITION, &goal).unwrap();
}

#[test]
fn xm430_has_the_gains_and_the_unit_of_currents_of_its_manual() {
    let mut registers = Registers::new(XM430_W350.model);
    let mut firmware = (XM430_W350.firmware)();
    let measured = ServoMeasurements {
        voltage: 12.0,
        current: 0.269,
        ..AT_REST
    };
    registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
    firmware.step(&mut registers, &measured, 0);
    let goal = registers.get(r::PRESENT_POSITION) + 32;
    registers
        .write(r::GOAL_POSITION, &goal.to_le_bytes())
        .unwrap();
    // 800/128 · 32 = 200 of 885, at once: the model has no slope of the duty cycle.
    let bridge = firmware.step(&mut registers, &measured, 0);
    assert_eq!(bridge, BridgeCommand::Duty(200.0 / 885.0));
    assert_eq!(registers.get(r::PRESENT_PWM), 200);
    // 269 mA in units of 2.69 mA.
    assert_eq!(registers.get(r::PRESENT_CURRENT), 100);
    // It is no state of another model.
    let mut other = (XL330_M288.firmware)();
    assert!(other.restore(&firmware.save()).is_err());
}
