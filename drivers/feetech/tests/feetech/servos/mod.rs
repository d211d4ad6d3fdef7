//! Feetech servos: their firmware, their side of the bus, and the driver.

use twinrig_dynamixel::{
    DynamixelDriver, JointSignals, ProtocolVersion, ReadPattern, Request, Responder,
    ServoBusConfig, ServoBusWire, ServoConfig, ServoKind,
};
use twinrig_kernel::{BoardClock, SimDuration, SimTime};
use twinrig_runtime::Driver;
use twinrig_testing::wired_harness::WiredHarness;
use twinrig_wire::{FaultSchedule, Piece, UsbPreset, UsbTiming};

mod scs0009;
mod sts3215;

const BYTE_TIME: SimDuration = SimDuration::from_micros(10);

/// Passes a request to a servo, and returns its answer.
fn answer(servo: &mut Responder, now: &mut SimTime, request: Request<'_>, id: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    request
        .encode(ProtocolVersion::One, id, &mut bytes)
        .unwrap();
    let piece = Piece {
        first: *now + BYTE_TIME,
        spacing: BYTE_TIME,
        bytes: &bytes,
        framing_error: false,
    };
    servo.receive(piece);
    servo.handle(piece.last());
    *now = piece.last() + SimDuration::from_millis(10);
    let mut answer = Vec::new();
    servo.poll_transmit(&mut answer);
    answer
}

/// A bus of two servos.
fn bus(kind: &'static ServoKind, pattern: ReadPattern) -> ServoBusConfig {
    let servo = |(id, name): (u8, &str)| ServoConfig {
        name: name.to_owned(),
        kind,
        id,
        registers: Vec::new(),
        settings: Vec::new(),
        signals: JointSignals::of_joint(name),
        command: format!("{name}/command"),
        voltage: kind.voltage,
        temperature: 30.0,
        clock: BoardClock::IDEAL,
    };
    ServoBusConfig {
        name: "servos".to_owned(),
        servos: (1..).zip(["hip", "knee"]).map(servo).collect(),
        byte_time: BYTE_TIME,
        pattern,
        period: SimDuration::from_millis(20),
        timeout: SimDuration::from_millis(5),
        usb: UsbTiming::preset(UsbPreset::Earliest),
        turnaround: SimDuration::ZERO,
        faults: FaultSchedule::default(),
        seed: 1,
    }
}

fn harness(config: &ServoBusConfig) -> WiredHarness<DynamixelDriver, ServoBusWire> {
    let names: Vec<String> = config.servos.iter().map(|it| it.name.clone()).collect();
    WiredHarness::new(config.driver().unwrap(), config.wire().unwrap(), &names)
}

/// Checks that the driver prepares, commands and reads the servos without an error, and that they
/// reach their commands within an angle \[rad\].
fn check_commands(config: &ServoBusConfig, within: f64) {
    let mut harness = harness(config);
    harness.open().unwrap();
    harness.transfers(60, config.period, &[0.6, -0.3]);
    for (found, command) in harness.driver.to_process().iter().zip([0.6, -0.3]) {
        assert!((found - command).abs() < within, "{found} {command}");
    }
    for name in ["lost", "refused", "damaged", "unexpected", "garbage"] {
        assert_eq!(harness.diagnostic(&format!("servos/{name}")), 0.0, "{name}");
    }
    harness.close().unwrap();
    assert_eq!(harness.joints.inputs, [0.0; 4]);
}
