//! A serial device of one's own, in a program with all the commands:
//! `cargo run --release -p rangefinder -- run examples/rangefinder/rangefinder.toml`

mod device;
mod driver;
mod protocol;

use std::process::ExitCode;

use twinrig::kernel::SimDuration;
use twinrig::runtime::Wire;
use twinrig::{BuildError, BusKind, Hookup, Registry};
use twinrig_wire::{Duplex, HostEnd, Tap, Uart};

use device::EmulatedRangeFinder;
use driver::RangeFinder;

const BAUD: u32 = 115_200;
/// Start bit, eight data bits, stop bit.
const BYTE_TIME: SimDuration = SimDuration::from_nanos(86_806);
/// The signal of the plant that it measures.
const HEIGHT: &str = "body/position";

fn main() -> ExitCode {
    twinrig::run(Registry::standard().with_bus(range_finder()))
}

/// The kind that scenarios call `rangefinder`: what it is, its driver, its wire with the emulated device at the far end.
fn range_finder() -> BusKind {
    let about = "an example of a serial device: measures how high the trunk is";
    BusKind::new("rangefinder", about, driver, wire)
        .at_baud(BAUD)
        .measuring(|_| vec![HEIGHT.to_owned()])
}

#[expect(clippy::unnecessary_wraps, reason = "others may refuse")]
fn driver(hookup: &Hookup<'_>) -> Result<RangeFinder, BuildError> {
    Ok(RangeFinder::new(hookup.name))
}

#[expect(clippy::unnecessary_wraps, reason = "others may refuse")]
fn wire(hookup: &Hookup<'_>) -> Result<impl Wire + use<>, BuildError> {
    let height = Tap {
        signal: HEIGHT.to_owned(),
        component: 2,
        scale: 1.0,
        offset: 0.0,
    };
    let device = EmulatedRangeFinder::new(hookup.name, height);
    let line = Duplex::new(BYTE_TIME, device);
    Ok(HostEnd::new(Uart::new(BYTE_TIME, line)))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use twinrig::{Assembly, Execution, execute};

    #[test]
    fn the_scenario_does_what_it_expects() {
        let registry = Registry::standard().with_bus(range_finder());
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/rangefinder.toml"));
        let assembly = Assembly::of_file(&registry, path, &[]);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        let report = execute(&assembly, &Execution::default());
        let report = report.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(report.expectations.len(), 3);
        for line in &report.expectations {
            assert!(line.0.holds(), "{:?}", line.0);
        }
    }

    #[test]
    fn the_page_about_drivers_quotes_this_example() {
        let page = include_str!("../../../drivers/README.md");
        let sources = [
            include_str!("protocol.rs"),
            include_str!("driver.rs"),
            include_str!("device.rs"),
            include_str!("main.rs"),
            include_str!("../rangefinder.toml"),
        ];
        let blocks = page.split("```").skip(1).step_by(2);
        let code = blocks.filter(|block| block.starts_with("rust") || block.starts_with("toml"));
        let lines = code.flat_map(|block| block.lines().skip(1));
        let mut quoted = 0;
        for line in lines.filter(|line| !line.starts_with("// ")) {
            assert!(sources.iter().any(|source| source.contains(line)), "{line}");
            quoted += 1;
        }
        assert!(quoted > 100, "{quoted}");
    }
}
