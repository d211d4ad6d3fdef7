//! The laws of the driver and three servos STS3215 or SCS0009 on a bus.

use twinrig_dynamixel::{
    DynamixelDriver, JointSignals, ReadPattern, ServoBusConfig, ServoConfig, ServoKind, ServoNode,
};
use twinrig_feetech::{SCS0009, STS3215};
use twinrig_kernel::{BoardClock, Port, SimDuration, Unit};
use twinrig_testing::laws::{Detection, DeviceSetup};
use twinrig_wire::{FaultSchedule, UsbPreset, UsbTiming};

const BYTE_TIME: SimDuration = SimDuration::from_micros(10);
/// Length of an answer \[bytes\].
const ANSWER: usize = 8;

fn config(kind: &'static ServoKind, pattern: ReadPattern) -> ServoBusConfig {
    let servo = |id: u8| ServoConfig {
        name: format!("joint{id}"),
        kind,
        id,
        registers: Vec::new(),
        settings: Vec::new(),
        signals: JointSignals::of_joint(&format!("joint{id}")),
        command: format!("joint{id}/command"),
        voltage: kind.voltage,
        temperature: 25.0,
        clock: BoardClock::IDEAL,
    };
    ServoBusConfig {
        name: String::from("sts"),
        servos: (1..4).map(servo).collect(),
        byte_time: BYTE_TIME,
        pattern,
        period: SimDuration::from_millis(20),
        timeout: SimDuration::from_millis(3),
        usb: UsbTiming::preset(UsbPreset::Earliest),
        turnaround: SimDuration::ZERO,
        faults: FaultSchedule::default(),
        seed: 1,
    }
}

fn setup(kind: &'static ServoKind, pattern: ReadPattern) -> DeviceSetup<DynamixelDriver> {
    let config = config(kind, pattern);
    let signals = config.servos.iter().map(|servo| &servo.signals);
    let ports = signals.flat_map(|it| {
        [
            Port::output(&it.angle, Unit::Radian, 1),
            Port::output(&it.rate, Unit::RadianPerSecond, 1),
            Port::input(&it.duty, Unit::One, 1),
            Port::input(&it.bridge, Unit::One, 1),
        ]
    });
    let ports = ports.collect();
    let (emulated, deadline) = (config.clone(), SimDuration::from_millis(400));
    let nodes = move || {
        let servos = emulated.servos.iter();
        let nodes = servos.map(|servo| Box::new(ServoNode::new("sts", servo, BYTE_TIME)) as _);
        nodes.collect()
    };
    DeviceSetup::new(BYTE_TIME, ports, move || config.driver().unwrap(), nodes)
        .with_levels(|level, component| 0.05 * level as f64 + 0.01 * component as f64)
        .with_commands(|transfer, servo| 0.02 * (transfer + servo) as f64)
        .with_deadline(deadline)
        .with_detection(Detection::WrongBits, ANSWER)
}

mod read {
    twinrig_testing::laws!(super::setup(&super::STS3215, super::ReadPattern::Read));
}

mod sync_read {
    twinrig_testing::laws!(super::setup(&super::STS3215, super::ReadPattern::SyncRead));
}

mod high_byte_first {
    twinrig_testing::laws!(super::setup(&super::SCS0009, super::ReadPattern::Read));
}
