//! The laws of the template's driver and device.

use twinrig::bus::{AnalogSource, FramedDriver, FramedNode, Port, SimDuration, Unit};
use twinrig_testing::laws::{DeviceSetup, Traffic};

use crate::bus::{BYTE_TIME, HEIGHT, NAME};
use crate::device::EmulatedRangeFinder;
use crate::driver::RangeFinder;

fn setup() -> DeviceSetup<FramedDriver<RangeFinder>> {
    let source = || AnalogSource {
        signal: HEIGHT.to_owned(),
        component: 2,
        scale: 1.0,
        offset: 0.0,
    };
    let device = move || FramedNode::new(EmulatedRangeFinder::new(NAME, source()));
    let ports = vec![Port::output(HEIGHT, Unit::Meter, 3)];
    let driver = || FramedDriver::new(RangeFinder::new(NAME));
    DeviceSetup::new(BYTE_TIME, ports, driver, move || vec![Box::new(device())])
        .with_period(SimDuration::from_millis(60))
        .with_deadline(SimDuration::from_millis(150))
        .with_transfer_deadline(SimDuration::from_millis(50))
        .with_traffic(|driver, _| {
            Traffic::of_diagnostics(driver, [&["answers"], &["lost"], &["garbage"]])
        })
}

// Without checksum and numbers a wrong distance is accepted, and so is an answer that comes late:
// neither `values_were_sent` nor `traffic_adds_up` holds.
twinrig_testing::laws!(
    setup();
    cuts_change_nothing, looks_change_nothing, restores_in_mid_frame, recovers,
    queues_stay_bounded, meets_the_deadline
);
