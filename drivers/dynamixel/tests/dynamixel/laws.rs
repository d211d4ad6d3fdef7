//! The laws of the driver and three servos on a bus, by each pattern of reading and by both
//! protocols.

use twinrig_dynamixel::ax::AX12A;
use twinrig_dynamixel::x::XL330_M288;
use twinrig_dynamixel::{
    DynamixelDriver, JointSignals, ReadPattern, ServoBusConfig, ServoConfig, ServoKind, ServoNode,
};
use twinrig_kernel::{BoardClock, Port, SimDuration, Unit};
use twinrig_testing::laws::{Detection, DeviceSetup};
use twinrig_wire::{FaultSchedule, UsbPreset, UsbTiming};

const BYTE_TIME: SimDuration = SimDuration::from_micros(10);
/// Length of an answer of protocol 1.0 \[bytes\].
const ANSWER: usize = 8;

fn config(kind: &'static ServoKind, voltage: f64, pattern: ReadPattern) -> ServoBusConfig {
    let servo = |id: u8| ServoConfig {
        name: format!("joint{id}"),
        kind,
        id,
        registers: Vec::new(),
        settings: Vec::new(),
        signals: JointSignals::of_joint(&format!("joint{id}")),
        command: format!("joint{id}/command"),
        voltage,
        temperature: 25.0,
        clock: BoardClock::IDEAL,
    };
    ServoBusConfig {
        name: String::from("dxl"),
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

fn setup(config: ServoBusConfig) -> DeviceSetup<DynamixelDriver> {
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
        let nodes = servos.map(|servo| Box::new(ServoNode::new("dxl", servo, BYTE_TIME)) as _);
        nodes.collect()
    };
    DeviceSetup::new(BYTE_TIME, ports, move || config.driver().unwrap(), nodes)
        .with_levels(|level, component| 0.05 * level as f64 + 0.01 * component as f64)
        .with_commands(|transfer, servo| 0.02 * (transfer + servo) as f64)
        .with_deadline(deadline)
}

/// Returns the setup of servos of protocol 2.0.
fn two(pattern: ReadPattern) -> DeviceSetup<DynamixelDriver> {
    setup(config(&XL330_M288, 5.0, pattern))
}

mod read {
    twinrig_testing::laws!(super::two(super::ReadPattern::Read));
}

mod sync_read {
    twinrig_testing::laws!(super::two(super::ReadPattern::SyncRead));
}

mod bulk_read {
    twinrig_testing::laws!(super::two(super::ReadPattern::BulkRead));
}

mod fast_sync_read {
    twinrig_testing::laws!(super::two(super::ReadPattern::FastSyncRead));
}

mod protocol_1 {
    use super::*;

    twinrig_testing::laws!(
        setup(config(&AX12A, 11.1, ReadPattern::Read)).with_detection(Detection::WrongBits, ANSWER)
    );
}
