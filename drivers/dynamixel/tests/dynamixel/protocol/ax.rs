//! AX-12A: errors as bits, the lock of the EEPROM, and the inner loops by the manual.

use twinrig_dynamixel::ax::{AX12A, register as r};
use twinrig_dynamixel::{
    BridgeCommand, ProtocolVersion, Registers, Request, Responder, ServoMeasurements, Span,
};
use twinrig_kernel::SimTime;

use super::support::{BYTE_TIME, piece};

const AT_REST: ServoMeasurements = ServoMeasurements {
    angle: 0.0,
    rate: 0.0,
    current: 0.0,
    voltage: 11.1,
    temperature: 25.0,
};

/// Returns the answer to bytes of protocol 1.0.
fn answer_to(servo: &mut Responder, now: &mut SimTime, bytes: &[u8]) -> Vec<u8> {
    let piece = piece(*now, bytes);
    *now = piece.last() + BYTE_TIME * 1_000;
    servo.receive(piece);
    servo.handle(piece.last());
    let mut answer = Vec::new();
    servo.poll_transmit(&mut answer);
    answer
}

/// Returns the error of the answer to a request.
fn error(servo: &mut Responder, now: &mut SimTime, request: Request<'_>) -> u8 {
    let mut bytes = Vec::new();
    let encoded = request.encode(ProtocolVersion::One, 1, &mut bytes);
    encoded.unwrap();
    answer_to(servo, now, &bytes)[4]
}

fn write(address: u16, data: &[u8]) -> Request<'_> {
    Request::Write { address, data }
}

#[test]
fn errors_are_bits() {
    let (mut servo, mut now) = (Responder::new(AX12A.model, 1, BYTE_TIME), SimTime::ZERO);
    let ping = [0xff, 0xff, 1, 2, 1, 0xfb];
    let found = answer_to(&mut servo, &mut now, &ping);
    assert_eq!(found, [0xff, 0xff, 1, 2, 0, 0xfc]);
    let damaged = [0xff, 0xff, 1, 2, 1, 0xfa];
    assert_eq!(answer_to(&mut servo, &mut now, &damaged)[4], 1 << 4);
    let unknown = [0xff, 0xff, 1, 2, 0x77, 0x85];
    assert_eq!(answer_to(&mut servo, &mut now, &unknown)[4], 1 << 6);
    let mut error = |request| error(&mut servo, &mut now, request);
    assert_eq!(error(Request::Action), 1 << 6);
    assert_eq!(error(Request::Reboot), 1 << 6);
    assert_eq!(error(write(r::TORQUE_ENABLE, &[2])), 1 << 3);
    assert_eq!(error(write(r::CCW_ANGLE_LIMIT, &[0x58, 0x02])), 0);
    // Goals of 600 and 601.
    assert_eq!(error(write(r::GOAL_POSITION, &[0x58, 0x02])), 0);
    assert_eq!(error(write(r::GOAL_POSITION, &[0x59, 0x02])), 1 << 1);
    // Without limits any goal of its range, of which 1024 is the first beyond.
    assert_eq!(error(write(r::CCW_ANGLE_LIMIT, &[0, 0])), 0);
    assert_eq!(error(write(r::GOAL_POSITION, &[0xff, 0x03])), 0);
    assert_eq!(error(write(r::GOAL_POSITION, &[0x00, 0x04])), 1 << 3);
    servo.registers_mut().set_alarms(1 << 2);
    let read = Request::Read(Span {
        address: 0,
        length: 2,
    });
    let mut bytes = Vec::new();
    read.encode(ProtocolVersion::One, 1, &mut bytes).unwrap();
    let found = answer_to(&mut servo, &mut now, &bytes);
    assert_eq!(found[4..7], [1 << 2, 12, 0]);
}

#[test]
fn the_lock_is_kept_until_a_restart() {
    let mut registers = Registers::new(AX12A.model);
    registers.write(3, &[7]).unwrap();
    registers.write(r::TORQUE_ENABLE, &[1]).unwrap();
    registers.write(3, &[8]).unwrap();
    registers.write(r::LOCK, &[1]).unwrap();
    assert!(registers.write(3, &[9]).is_err());
    assert!(registers.write(r::LOCK, &[0]).is_err());
    registers.restart();
    registers.write(3, &[9]).unwrap();
    assert_eq!(registers.get(3), 9);
}

/// Returns the duty cycle of a shaft in the middle for a goal, after some periods.
fn duty(values: &[(u16, i32)], goal: i32, periods: u32) -> f64 {
    let mut registers = Registers::new(AX12A.model);
    for &(address, value) in values {
        registers.set(address, value);
    }
    registers.set(r::TORQUE_ENABLE, 1);
    registers.set(r::GOAL_POSITION, goal);
    let mut firmware = (AX12A.firmware)();
    let mut bridge = BridgeCommand::Open;
    for _ in 0..periods {
        bridge = firmware.step(&mut registers, &AT_REST, 0);
    }
    match bridge {
        BridgeCommand::Duty(duty) => duty * 1_023.0,
        BridgeCommand::Open => f64::NAN,
    }
}

/// The figure of the section "Compliance Slope": nothing within the margin, the punch at its end,
/// from there in proportion to the greatest torque at the end of the slope.
#[test]
fn duty_cycle_has_margin_punch_and_slope() {
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    };
    let [slope, margin] = [r::CCW_COMPLIANCE_SLOPE, r::CCW_COMPLIANCE_MARGIN];
    close(duty(&[], 512, 1), 0.0);
    close(duty(&[], 513, 1), 0.0);
    close(duty(&[], 512 + 17, 1), 32.0 + 991.0 / 2.0);
    close(duty(&[], 512 - 17, 1), -32.0 - 991.0 / 2.0);
    close(duty(&[], 600, 1), 1_023.0);
    close(duty(&[(r::TORQUE_LIMIT, 300)], 600, 1), 300.0);
    // 25 counts as 16, and 3 as 2.
    close(duty(&[(slope, 25)], 512 + 9, 1), 32.0 + 991.0 / 2.0);
    close(duty(&[(slope, 3)], 512 + 2, 1), 32.0 + 991.0 / 2.0);
    close(duty(&[(margin, 9), (r::PUNCH, 200)], 512 + 9, 1), 0.0);
    close(
        duty(&[(margin, 9), (r::PUNCH, 200)], 512 + 10, 1),
        200.0 + 823.0 / 32.0,
    );
}

#[test]
fn the_set_point_has_the_moving_speed() {
    let values = [
        (r::CCW_COMPLIANCE_SLOPE, 128),
        (r::CCW_COMPLIANCE_MARGIN, 0),
        (r::MOVING_SPEED, 300),
    ];
    // 33.3 rev/min, which are 199.8 °/s, in units of 300/1024 °.
    let expected = libm::rint(0.1 * 199.8 * 1_024.0 / 300.0);
    let error = (duty(&values, 1_000, 100) - 32.0) / 991.0 * 128.0;
    assert!((error - expected).abs() < 1.5, "{error} {expected}");
}

#[test]
fn without_limits_the_moving_speed_is_the_duty_cycle() {
    let turning = |speed| duty(&[(r::CCW_ANGLE_LIMIT, 0), (r::MOVING_SPEED, speed)], 900, 2);
    assert_eq!(turning(512), 512.0);
    assert_eq!(turning(-512), -512.0);
}

#[test]
fn overheating_sets_the_torque_limit_to_0_and_low_voltage_does_not() {
    let mut registers = Registers::new(AX12A.model);
    registers.set(r::TORQUE_ENABLE, 1);
    registers.set(r::GOAL_POSITION, 600);
    let mut firmware = (AX12A.firmware)();
    let mut step = |registers: &mut Registers, voltage, temperature| {
        let measured = ServoMeasurements {
            voltage,
            temperature,
            ..AT_REST
        };
        firmware.step(registers, &measured, 0)
    };
    let full = BridgeCommand::Duty(1.0);
    assert_eq!(step(&mut registers, 5.0, 25.0), full);
    assert_eq!(registers.alarms(), 1);
    assert_eq!(step(&mut registers, 11.1, 71.0), BridgeCommand::Duty(0.0));
    assert_eq!(registers.alarms(), 1 << 2);
    // The limit has to be set again.
    assert_eq!(step(&mut registers, 11.1, 25.0), BridgeCommand::Duty(0.0));
    assert_eq!(registers.alarms(), 0);
    registers.set(r::TORQUE_LIMIT, 1_023);
    assert_eq!(step(&mut registers, 11.1, 25.0), full);
    // A shaft that does not move under the greatest torque is an overload, within a second or two.
    let overload = (0..2_000).find(|_| step(&mut registers, 11.1, 25.0) != full);
    assert!(overload.is_some());
    assert_eq!(registers.alarms(), 1 << 5);
}
