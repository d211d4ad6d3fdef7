//! A serial device, in a program with all commands of `twin`: messages (protocol.rs), the driver
//! that runs on the robot (driver.rs), the emulated device (device.rs), properties of the timing
//! (timing.rs), and the bus kind that makes them known to scenarios.

mod device;
mod driver;
mod protocol;
#[cfg(test)]
mod timing;

use std::process::ExitCode;

use twinrig::Registry;
use twinrig::bus::{
    AnalogSource, BuildError, BusContext, BusKind, FramedDriver, FramedNode, SimDuration, Wire,
};

use device::EmulatedRangeFinder;
use driver::RangeFinder;

/// Name of the bus in scenarios.
const NAME: &str = "template_name";
const BAUD: u32 = 115_200;
/// Start bit, eight data bits, stop bit.
const BYTE_TIME: SimDuration = SimDuration::from_nanos(10_000_000_000 / BAUD as u64);
/// Signal of the plant that the device measures.
const HEIGHT: &str = "body/position";

fn main() -> ExitCode {
    twinrig::run(registry())
}

/// All parts of `twin`, and this bus kind: description, driver, and wire with the emulated device.
fn registry() -> Registry {
    let about = "a serial device that measures the height of the trunk";
    let kind = BusKind::new(NAME, about, driver, wire)
        .at_baud(BAUD)
        .with_faults()
        .with_usb()
        .measuring(|_| vec![HEIGHT.to_owned()]);
    Registry::standard().with_bus(kind)
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use twinrig::{Assembly, Execution, execute};

    #[test]
    fn scenarios_meet_their_expectations_and_repeat() {
        for file in [&format!("{NAME}.toml"), "port.toml"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
            let registry = registry();
            let assembly = Assembly::builder(&registry).file(&path);
            let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
            let run = || {
                let report = execute(&assembly, &Execution::default());
                report.unwrap_or_else(|error| panic!("{error}"))
            };
            let (first, second) = (run(), run());
            for line in &first.expectations {
                assert!(line.holds(), "{:?}", line.outcome);
            }
            assert_eq!(first.fingerprint, second.fingerprint);
        }
    }
}
