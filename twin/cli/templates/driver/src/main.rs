//! A serial device, in a program with all commands of `twin`: messages (protocol.rs), the driver
//! that runs on the robot (driver.rs), the emulated device (device.rs), properties of the timing
//! (timing.rs), and the bus kind that makes them known to scenarios (bus.rs).

mod bus;
mod device;
mod driver;
mod protocol;
#[cfg(test)]
mod timing;

use std::process::ExitCode;

fn main() -> ExitCode {
    twinrig::run(bus::registry())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::bus::{NAME, registry};
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
