//! The bus kind: the name in scenarios, the baud rate, and the connection of driver and device.

use twinrig::Registry;
use twinrig::bus::{
    AnalogSource, BuildError, BusContext, BusKind, FramedDriver, FramedNode, SimDuration, Wire,
};

use crate::device::EmulatedRangeFinder;
use crate::driver::RangeFinder;

/// Name of the bus in scenarios.
pub const NAME: &str = "template_name";
const BAUD: u32 = 115_200;
/// Start bit, eight data bits, stop bit.
pub const BYTE_TIME: SimDuration = SimDuration::from_nanos(10_000_000_000 / BAUD as u64);
/// Signal of the plant that the device measures.
pub const HEIGHT: &str = "body/position";

/// All parts of `twin`, and this bus kind: description, driver, and wire with the emulated device.
pub fn registry() -> Registry {
    let about = "a serial device that measures the height of the trunk";
    let kind = BusKind::new(NAME, about, driver, wire)
        .at_baud(BAUD)
        .with_faults()
        .with_usb()
        .measuring(|_| vec![HEIGHT.to_owned()]);
    twinrig::registry().with_bus(kind)
}

#[expect(clippy::unnecessary_wraps, reason = "drivers of other kinds may fail")]
fn driver(context: &BusContext<'_>) -> Result<FramedDriver<RangeFinder>, BuildError> {
    Ok(FramedDriver::new(RangeFinder::new(context.name)))
}

fn wire(context: &BusContext<'_>) -> Result<Box<dyn Wire>, BuildError> {
    let height = AnalogSource {
        signal: HEIGHT.to_owned(),
        component: 2,
        scale: 1.0,
        offset: 0.0,
    };
    let device = EmulatedRangeFinder::new(context.name, height);
    context.device_wire(BYTE_TIME, FramedNode::new(device))
}
