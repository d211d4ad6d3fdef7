//! The STS3215: its duty cycle against logs of a real servo, and its side of the bus.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use twinrig_dynamixel::{
    BridgeCommand, BulkReads, ProtocolVersion, ReadPattern, Registers, Request, Responder,
    ServoFirmware, ServoMeasurements, Span,
};
use twinrig_feetech::{FeetechFirmware, STS3215, register as r};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use super::{BYTE_TIME, answer, bus, check_commands, harness};

/// 12 V, room temperature.
const AT_REST: ServoMeasurements = ServoMeasurements {
    angle: 0.0,
    rate: 0.0,
    current: 0.0,
    voltage: 12.0,
    temperature: 30.0,
};

/// Runs the firmware at an angle, with a goal after the first period, for some periods; returns the
/// load that it reports.
fn load(gain: i32, angle: f64, goal: i32, periods: u32) -> i32 {
    let mut registers = Registers::new(STS3215.model);
    registers.set(r::P_COEFFICIENT, gain);
    let mut firmware = FeetechFirmware::sts();
    let measured = ServoMeasurements { angle, ..AT_REST };
    firmware.step(&mut registers, &measured, 0);
    registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
    firmware.step(&mut registers, &measured, 0);
    registers.set(r::GOAL_POSITION, goal);
    for _ in 0..periods {
        firmware.step(&mut registers, &measured, 0);
    }
    registers.get(r::PRESENT_LOAD)
}

/// Where position and goal have rested for eight samples, the duty cycle is that of the firmware,
/// exactly, in 99 % of the samples at least; in the others the goal rounds to a neighbouring count.
#[test]
fn duty_cycle_at_rest_is_that_of_a_real_servo() {
    const REST: usize = 8;
    let Some(folder) = std::env::var_os("SERVO_LOGS").map(PathBuf::from) else {
        eprintln!("skipped: no logs");
        return;
    };
    let (mut exact, mut all) = (0, 0);
    for entry in fs::read_dir(folder.join("sts3215")).unwrap() {
        let file = fs::File::open(entry.unwrap().path()).unwrap();
        let log: Value = serde_json::from_reader(flate2::read::GzDecoder::new(file)).unwrap();
        let gain = i32::try_from(log["kp"].as_i64().unwrap()).unwrap();
        let number = |entry: &Value, name: &str| entry[name].as_f64().unwrap();
        #[expect(clippy::cast_possible_truncation, reason = "within some turns")]
        let counts = |angle: f64| (angle / std::f64::consts::TAU * 4_096.0).round() as i32;
        #[expect(clippy::cast_possible_truncation, reason = "ten bits and a sign")]
        let samples: Vec<(i32, i32, i32, bool)> = log["entries"]
            .as_array()
            .unwrap()
            .iter()
            .map(|entry| {
                let word = (100.0 * number(entry, "torque")).round() as i32;
                let load = if word < 1_024 { word } else { 1_024 - word };
                let [position, goal] = ["position", "goal_position"].map(|it| number(entry, it));
                let enabled = entry["torque_enable"].as_bool().unwrap();
                (counts(position), counts(goal), load, enabled)
            })
            .collect();
        let mut last = None;
        for window in samples.windows(REST + 1) {
            let (position, goal, load_found, _) = window[REST];
            if window
                .iter()
                .any(|it| !it.3 || (it.0, it.1) != (position, goal))
            {
                continue;
            }
            let angle = f64::from(position) / 4_096.0 * std::f64::consts::TAU;
            let case = (position, goal);
            let ours = match last {
                Some((known, ours)) if known == case => ours,
                // Long enough for the set-point, at 3.25 counts a period.
                _ => load(
                    gain,
                    angle,
                    goal + 2_048,
                    (goal - position).unsigned_abs() / 3 + 10,
                ),
            };
            last = Some((case, ours));
            all += 1;
            exact += usize::from(ours == load_found);
        }
    }
    eprintln!("{exact} of {all} samples are exact");
    assert!(all > 9_000, "{all}");
    assert!(100 * exact >= 99 * all, "{exact} of {all}");
}

#[test]
fn set_point_has_the_greatest_speed_of_the_logs() {
    let mut registers = Registers::new(STS3215.model);
    let mut firmware = FeetechFirmware::sts();
    firmware.step(&mut registers, &AT_REST, 0);
    registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
    registers.set(r::GOAL_POSITION, 2_048 + 2_000);
    for _ in 0..400 {
        firmware.step(&mut registers, &AT_REST, 0);
    }
    // 3250 counts/s.
    let moved = registers.get(r::GOAL_POSITION_2) - 2_048;
    assert!((1_299..=1_301).contains(&moved), "{moved}");
}

#[test]
fn writes_are_limited_and_lost_at_a_restart_while_locked() {
    let (mut servo, mut now) = (Responder::new(STS3215.model, 1, BYTE_TIME), SimTime::ZERO);
    let ok = [0xff, 0xff, 1, 2, 0, 0xfc];
    let write = |address, data| Request::Write { address, data };
    let mut send = |servo: &mut Responder, request| answer(servo, &mut now, request, 1);
    // 5000 as the torque limit; a byte of the position; both accepted.
    assert_eq!(send(&mut servo, write(r::TORQUE_LIMIT, &[0x88, 0x13])), ok);
    assert_eq!(servo.registers().get(r::TORQUE_LIMIT), 1_000);
    assert_eq!(send(&mut servo, write(r::PRESENT_POSITION, &[1])), ok);
    assert_eq!(servo.registers().get(r::PRESENT_POSITION), 0);
    // Acceleration, position −100, time, speed, as one block.
    let block = [50, 100, 0x80, 0, 0, 0xf4, 1];
    assert_eq!(send(&mut servo, write(r::ACCELERATION, &block)), ok);
    let values = [r::ACCELERATION, r::GOAL_POSITION, r::GOAL_VELOCITY];
    assert_eq!(values.map(|it| servo.registers().get(it)), [50, -100, 500]);
    for (lock, kept) in [(&[1], 32), (&[0], 16)] {
        send(&mut servo, write(r::LOCK, lock));
        send(&mut servo, write(r::P_COEFFICIENT, &[16]));
        assert_eq!(servo.registers().get(r::P_COEFFICIENT), 16);
        send(&mut servo, Request::Reboot);
        assert_eq!(servo.registers().get(r::P_COEFFICIENT), kept);
    }
}

/// It does not answer what it does not execute: a wrong checksum, a bulk read, a read beyond its
/// table.
#[test]
fn instructions_that_are_not_executed_are_not_answered() {
    let (mut servo, mut now) = (Responder::new(STS3215.model, 1, BYTE_TIME), SimTime::ZERO);
    servo.registers_mut().set(r::TORQUE_ENABLE, 1);
    // Torque off; the checksum would be CF.
    let damaged = [0xff, 0xff, 1, 4, 3, 40, 0, 0xce];
    let piece = Piece {
        first: now + BYTE_TIME,
        spacing: BYTE_TIME,
        bytes: &damaged,
        framing_error: false,
    };
    servo.receive(piece);
    servo.handle(piece.last());
    assert_eq!(servo.poll_transmit(&mut Vec::new()), None);
    assert_eq!(servo.registers().get(r::TORQUE_ENABLE), 1);
    now = piece.last() + SimDuration::from_millis(200);
    let mut send = |request| answer(&mut servo, &mut now, request, 1).len();
    assert_eq!(
        send(Request::Read(Span {
            address: 80,
            length: 20
        })),
        0
    );
    assert_eq!(
        send(Request::BulkRead(BulkReads::new(
            ProtocolVersion::One,
            &[2, 1, 56]
        ))),
        0
    );
    assert_eq!(send(Request::Ping), 6);
}

/// Positions are within one turn, and so is the middle that is set on demand.
#[test]
fn positions_do_not_count_turns() {
    let mut registers = Registers::new(STS3215.model);
    let mut firmware = FeetechFirmware::sts();
    let far = ServoMeasurements {
        angle: 4.0,
        ..AT_REST
    };
    firmware.step(&mut registers, &far, 0);
    // 4/2π · 4096, and the middle, less a turn.
    assert_eq!(registers.get(r::PRESENT_POSITION), 2_608 + 2_048 - 4_096);
    registers.set(r::TORQUE_ENABLE, 128);
    firmware.step(&mut registers, &far, 0);
    assert_eq!(registers.get(r::PRESENT_POSITION), 2_048);
}

#[test]
fn the_status_level_leaves_reads_and_pings() {
    let (mut servo, mut now) = (Responder::new(STS3215.model, 1, BYTE_TIME), SimTime::ZERO);
    servo.registers_mut().set(8, 0);
    let mut send = |request| answer(&mut servo, &mut now, request, 1).len();
    assert_eq!(send(Request::Ping), 6);
    let model = Span {
        address: 3,
        length: 2,
    };
    assert_eq!(send(Request::Read(model)), 8);
    let (address, data) = (r::LOCK, &[0][..]);
    assert_eq!(send(Request::Write { address, data }), 0);
}

#[test]
fn the_position_becomes_the_middle_on_demand() {
    let mut registers = Registers::new(STS3215.model);
    let mut firmware = FeetechFirmware::sts();
    let measured = ServoMeasurements {
        angle: 0.5,
        ..AT_REST
    };
    registers.set(r::TORQUE_ENABLE, 128);
    assert_eq!(
        firmware.step(&mut registers, &measured, 0),
        BridgeCommand::Open
    );
    assert_eq!(registers.get(r::PRESENT_POSITION), 2_048);
    assert_eq!(registers.get(r::TORQUE_ENABLE), 0);
    assert_eq!(registers.get(r::HOMING_OFFSET), 326);
}

/// After 2 s above 80 % the duty cycle is limited to 20 %, and the status reports it.
#[test]
fn an_overload_limits_the_torque() {
    let [before, after] = [1_900, 2_100].map(|periods| load(254, 0.0, 4_000, periods));
    assert_eq!([before, after], [-1_000, -200]);
}

/// The driver of Dynamixel servos prepares, commands and reads those of this series, by single and
/// sync reads; protocol 1.0 has no fast sync read.
#[test]
fn joints_reach_their_commands_on_a_bus() {
    let mut config = bus(&STS3215, ReadPattern::SyncRead);
    for pattern in [ReadPattern::SyncRead, ReadPattern::Read] {
        config.pattern = pattern;
        // A dead zone of one count, and rounding.
        check_commands(&config, 3.1e-3);
    }
    // A servo in overload is not opened.
    config.servos[0].registers = vec![(r::STATUS, 0x20)];
    config.pattern = ReadPattern::SyncRead;
    let error = harness(&config).open().unwrap_err();
    assert!(
        error.starts_with("hip (id 1): it reports a hardware error"),
        "{error}"
    );
    config.pattern = ReadPattern::FastSyncRead;
    let error = config.driver().err().unwrap().to_string();
    assert!(
        error.contains("protocol 1.0 has no fast sync read"),
        "{error}"
    );
}
