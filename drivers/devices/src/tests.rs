//! Tests of all devices alike.

use std::fmt::Debug;

use proptest::collection::vec;
use proptest::prelude::*;
use twinrig_kernel::{Port, Unit};
use twinrig_runtime::Rig;
use twinrig_testing::framing::{check_arbitrary_bytes, check_message, check_wrong_bit};
use twinrig_testing::laws::DeviceSetup;
use twinrig_testing::rig_harness::{RecordingPlant, rig, run};
use twinrig_wire::{FaultSchedule, FramedDriver, FramedMessage, crc16};

use crate::FramedDevice;

/// Returns a frame of this content and its CRC.
pub(crate) fn framed(content: &[u8]) -> Vec<u8> {
    [content, &crc16(content).to_le_bytes()].concat()
}

/// Checks that messages are decoded identically amid garbage, that a wrong bit is detected, and
/// that a stream of such bytes has the same frames in any pieces.
pub(crate) fn check_frames<M: FramedMessage + Debug + PartialEq>(
    messages: impl Strategy<Value = M>,
    bytes: impl Strategy<Value = u8>,
) {
    let (garbage, bytes) = (vec(any::<u8>(), 0..60), vec(bytes, 0..400));
    proptest!(|(message in messages, garbage in garbage, bit in any::<usize>())| {
        check_message(&message, &garbage);
        check_wrong_bit(&message, bit);
    });
    proptest!(|(bytes in bytes, cuts in vec(0..400_usize, 0..20))| {
        check_arbitrary_bytes::<M>(&bytes, cuts);
    });
}

/// Returns a plant with a force of three components as a function of time \[s\].
pub(crate) fn force_plant(force: fn(f64, usize) -> f64) -> RecordingPlant {
    let port = Port::output("leg/LF/foot/force", Unit::Newton, 3);
    RecordingPlant::new(vec![port], force)
}

/// Builds a rig of a device, with a process that commands it at a period \[ms\].
pub(crate) fn wired<D: FramedDevice>(
    device: &D,
    faults: &FaultSchedule,
    process: (u64, fn(u64) -> f64),
    plant: RecordingPlant,
) -> Rig {
    let wire = device.wire(faults).unwrap();
    rig(device.driver().unwrap(), wire, process, plant)
}

/// Returns a device and its driver for the laws, at a plant of these ports.
pub(crate) fn under_laws<D: FramedDevice + Clone>(
    device: D,
    ports: Vec<Port>,
) -> DeviceSetup<FramedDriver<D::Protocol>> {
    let emulated = device.clone();
    let nodes = move || vec![Box::new(emulated.node().unwrap()) as _];
    let driver = move || device.driver().unwrap();
    DeviceSetup::new(D::BYTE_TIME, ports, driver, nodes).with_numbered_answers()
}

/// Checks that a device at a dead wire is an error that names its bus, with a remedy.
pub(crate) fn check_missing(mut rig: Rig, bus: &str) {
    let message = run(&mut rig, 1000).1.unwrap_err().to_string();
    assert!(
        message.contains(bus) && message.contains("check the connection"),
        "{message}"
    );
}

#[test]
fn examples_are_valid_and_have_names_of_their_own() {
    let drivers = crate::drivers().unwrap();
    let names: std::collections::BTreeSet<_> = drivers.iter().map(|driver| driver.name()).collect();
    assert_eq!(names.len(), drivers.len());
}
