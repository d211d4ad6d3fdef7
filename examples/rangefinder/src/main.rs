//! A custom serial device, in a program with all commands: `cargo run --release -p rangefinder --
//! run examples/rangefinder/rangefinder.toml`

#[cfg(test)]
mod checked;
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
const NAME: &str = "rangefinder";
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
    let about = "an example of a serial device: measures the height of the trunk";
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
    use std::io::{BufRead, BufReader};
    use std::path::Path;
    use std::process::{Command, Stdio};
    use std::time::Duration;

    use super::*;
    use twinrig::bus::{Device, DeviceError, Pty};
    use twinrig::{Assembly, Execution, execute};

    #[test]
    fn scenario_meets_its_expectations() {
        let registry = registry();
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/rangefinder.toml"));
        let assembly = Assembly::builder(&registry).file(path);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        let report = execute(&assembly, &Execution::default());
        let report = report.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(report.expectations.len(), 3);
        for line in &report.expectations {
            assert!(line.holds(), "{:?}", line.outcome);
        }
    }

    /// Answers `R138` to every `R` at the far end of a port, until the port is closed.
    fn answer(mut device: Pty) {
        let mut requests = Vec::new();
        loop {
            match device.read(Duration::from_millis(20), &mut requests) {
                Ok(()) => {}
                Err(DeviceError::HungUp { .. }) if requests.is_empty() => continue,
                Err(_) => return,
            }
            for _ in requests.drain(..) {
                if device.write(b"R138\n").is_err() {
                    return;
                }
            }
        }
    }

    #[test]
    fn driver_measures_at_a_port_and_unconnected_commands_are_noted() {
        let registry = registry();
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/rangefinder.toml"));
        let assembly = Assembly::builder(&registry).file(path).unwrap();
        let device = Pty::open().unwrap();
        let ports = vec![("rangefinder".to_owned(), device.path().to_owned())];
        #[expect(
            clippy::disallowed_methods,
            reason = "the other side of a port is another program"
        )]
        std::thread::spawn(|| answer(device));
        let execution = Execution {
            ports,
            ..Execution::default()
        };
        let report = execute(&assembly, &execution).unwrap();
        assert_eq!(report.error, None);
        // The number of answers depends on the machine, their content does not.
        let height = &report.expectations[2];
        assert!(height.holds(), "{:?}", height.outcome);
        assert_eq!(height.outcome.measured, Some(0.138));
        let notes = report.real_time.unwrap().notes;
        let note =
            "no bus carries leg/*/hip/command, leg/*/knee/command: the commands are discarded";
        assert!(notes.iter().any(|found| found == note), "{notes:?}");
    }

    /// Regenerate with `UPDATE_SCHEMA=1 cargo test -p rangefinder schema`.
    #[test]
    fn schema_matches_this_program() {
        let registry = registry();
        let mut schema = Vec::new();
        let code = twinrig::run_with(&registry, ["schema"], &mut schema, &mut Vec::new());
        assert_eq!(code, 0);
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario.schema.json");
        if std::env::var_os("UPDATE_SCHEMA").is_some() {
            std::fs::write(path, &schema).unwrap();
        }
        assert!(
            std::fs::read(path).unwrap() == schema,
            "run UPDATE_SCHEMA=1 cargo test -p rangefinder schema"
        );
    }

    #[test]
    fn tutorials_quote_this_example() {
        let pages = [
            (include_str!("../../../drivers/README.md"), 100),
            (include_str!("../../../docs/tutorial-serial-device.md"), 60),
            (include_str!("../../../docs/tutorial-timing-tests.md"), 100),
        ];
        let sources = [
            include_str!("protocol.rs"),
            include_str!("driver.rs"),
            include_str!("device.rs"),
            include_str!("main.rs"),
            include_str!("checked.rs"),
            include_str!("timing.rs"),
            include_str!("../rangefinder.toml"),
        ];
        for (page, quoted_min) in pages {
            let blocks = page.split("```").skip(1).step_by(2);
            let code = blocks
                .filter(|block| block.starts_with("rust") || block.starts_with("toml\n[bus]"));
            let lines = code.flat_map(|block| block.lines().skip(1));
            let mut quoted = 0;
            for line in lines.filter(|line| !line.starts_with("// ")) {
                assert!(sources.iter().any(|source| source.contains(line)), "{line}");
                quoted += 1;
            }
            assert!(quoted > quoted_min, "{quoted}");
        }
    }

    /// A second implementation of the device, in Python, answers the driver at a port.
    #[test]
    fn driver_measures_at_the_device_of_the_tutorial() {
        let folder = std::env::temp_dir().join(format!("twinrig-sonar-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let link = folder.join("port");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/examples/sonar.py");
        let mut sonar = Command::new("python3")
            .arg(script)
            .arg(&link)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut printed = BufReader::new(sonar.stdout.take().unwrap()).lines();
        assert!(printed.next().unwrap().unwrap().starts_with("connect with"));
        let registry = registry();
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/rangefinder.toml"));
        let assembly = Assembly::builder(&registry).file(path).unwrap();
        let execution = Execution {
            ports: vec![("rangefinder".to_owned(), link)],
            ..Execution::default()
        };
        let report = execute(&assembly, &execution).unwrap();
        drop(sonar.stdin.take());
        sonar.wait().unwrap();
        std::fs::remove_dir(&folder).unwrap();
        assert_eq!(report.error, None);
        let measured = report.expectations[2].outcome.measured.unwrap();
        assert!((0.12..=0.14).contains(&measured), "{measured}");
        let answers = printed.next().unwrap().unwrap();
        assert!(
            answers.ends_with(" answers") && answers != "0 answers",
            "{answers}"
        );
    }
}
