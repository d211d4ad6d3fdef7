//! The SCS0009: numbers with the high byte first, a potentiometer, and the driver.

use twinrig_dynamixel::{
    BridgeCommand, ReadPattern, Registers, Request, Responder, ServoFirmware, ServoMeasurements,
    Span,
};
use twinrig_feetech::{FeetechFirmware, SCS0009, register as r};
use twinrig_kernel::SimTime;

use super::{BYTE_TIME, answer, bus, check_commands};

const AT_REST: ServoMeasurements = ServoMeasurements {
    angle: 0.0,
    rate: 0.0,
    current: 0.0,
    voltage: 6.0,
    temperature: 30.0,
};

#[test]
fn numbers_have_the_high_byte_first() {
    let (mut servo, mut now) = (Responder::new(SCS0009.model, 1, BYTE_TIME), SimTime::ZERO);
    let mut send = |servo: &mut Responder, request| answer(servo, &mut now, request, 1);
    let span = |address, length| Request::Read(Span { address, length });
    // Model 1284, 0x0504.
    assert_eq!(
        send(&mut servo, span(3, 2)),
        [0xff, 0xff, 1, 4, 0, 5, 4, 0xf1]
    );
    // Position 258, time 0, speed 300, as one block.
    let data = &[1, 2, 0, 0, 1, 44][..];
    let address = r::GOAL_POSITION;
    send(&mut servo, Request::Write { address, data });
    let values = [r::GOAL_POSITION, r::GOAL_VELOCITY].map(|it| servo.registers().get(it));
    assert_eq!(values, [258, 300]);
    // Magnitude 500, and the sign in bit 10.
    servo.registers_mut().set(r::PRESENT_LOAD, -500);
    let load = send(&mut servo, span(r::PRESENT_LOAD, 2));
    assert_eq!(load[5..7], [0x05, 0xf4]);
    assert_eq!(servo.registers().get(r::PRESENT_LOAD), -500);
}

/// The potentiometer ends at 0 and 1023, 150° from the middle; the goal at the angle limits.
#[test]
fn positions_end_with_the_potentiometer() {
    let mut registers = Registers::new(SCS0009.model);
    let mut firmware = FeetechFirmware::scs();
    for (degrees, position) in [(0.0_f64, 511), (30.0, 613), (-30.0, 409), (170.0, 1_023)] {
        let angle = degrees.to_radians();
        firmware.step(&mut registers, &ServoMeasurements { angle, ..AT_REST }, 0);
        assert_eq!(registers.get(r::PRESENT_POSITION), position, "{degrees}");
    }
    registers.set(r::GOAL_POSITION, 1_023);
    registers.set(r::TORQUE_ENABLE, 1);
    let angle = (1_003.0 - 511.0) / 1_024.0 * 300.0_f64.to_radians();
    let at_limit = ServoMeasurements { angle, ..AT_REST };
    for _ in 0..1_000 {
        firmware.step(&mut registers, &at_limit, 0);
    }
    assert_eq!(registers.get(r::PRESENT_LOAD), 0);
}

/// With both angle limits at 0 the servo is a motor whose goal is a duty cycle, of a thousandth.
#[test]
fn without_angle_limits_the_goal_is_a_duty_cycle() {
    let mut registers = Registers::new(SCS0009.model);
    let mut firmware = FeetechFirmware::scs();
    for limit in [r::MIN_POSITION_LIMIT, r::MAX_POSITION_LIMIT] {
        registers.set(limit, 0);
    }
    registers.set(r::TORQUE_ENABLE, 1);
    registers.write(r::GOAL_TIME, &[0x04 | 0x01, 0x2c]).unwrap();
    let bridge = firmware.step(&mut registers, &AT_REST, 0);
    assert_eq!(bridge, BridgeCommand::Duty(-0.3));
}

/// It has no sync read.
#[test]
fn joints_reach_their_commands_on_a_bus() {
    // A dead zone of two counts of 5.1 mrad, and rounding.
    check_commands(&bus(&SCS0009, ReadPattern::Read), 13e-3);
    let error = bus(&SCS0009, ReadPattern::SyncRead).driver().err().unwrap();
    assert!(
        error
            .to_string()
            .ends_with("do not have the instruction `sync read`")
    );
}
