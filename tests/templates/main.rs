//! The driver that `twin new driver` makes, at ports and in the tutorials. `ci/templates` runs the
//! tests of all crates that it makes.

#[path = "../../twin/cli/templates/driver/src/bus.rs"]
mod bus;
mod checked;
#[path = "../../twin/cli/templates/driver/src/device.rs"]
mod device;
#[path = "../../twin/cli/templates/driver/src/driver.rs"]
mod driver;
mod laws;
#[path = "../../twin/cli/templates/driver/src/protocol.rs"]
mod protocol;
#[path = "../../twin/cli/templates/driver/src/timing.rs"]
mod timing;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use twinrig::bus::{Device, DeviceError, Pty};
use twinrig::{Assembly, Execution, Report, execute};
use twinrig_testing::folder::Folder;

use bus::{NAME, registry};

/// Runs the scenario of the template, at a port or in virtual time.
fn run(port: Option<PathBuf>) -> Report {
    let folder = Folder::new("templates");
    let scenario = include_str!("../../twin/cli/templates/driver/scenario.toml");
    let file = folder.file("template.toml", scenario);
    let registry = registry();
    let assembly = Assembly::builder(&registry).file(Path::new(&file));
    let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
    let execution = Execution {
        ports: port
            .map(|port| (NAME.to_owned(), port))
            .into_iter()
            .collect(),
        ..Execution::default()
    };
    let report = execute(&assembly, &execution);
    let report = report.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.error, None);
    assert_eq!(report.expectations.len(), 3);
    report
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
fn scenario_meets_its_expectations() {
    for line in &run(None).expectations {
        assert!(line.holds(), "{:?}", line.outcome);
    }
}

#[test]
fn driver_measures_at_a_port_and_unconnected_commands_are_noted() {
    let device = Pty::open().unwrap();
    let port = device.path().to_owned();
    #[expect(
        clippy::disallowed_methods,
        reason = "the other side of a port is another program"
    )]
    std::thread::spawn(|| answer(device));
    let report = run(Some(port));
    // The number of answers depends on the machine, their content does not.
    let height = &report.expectations[2];
    assert!(height.holds(), "{:?}", height.outcome);
    assert_eq!(height.outcome.measured, Some(0.138));
    let notes = report.real_time.unwrap().notes;
    let note = "no bus carries leg/*/hip/command, leg/*/knee/command: the commands are discarded";
    assert!(notes.iter().any(|found| found == note), "{notes:?}");
}

/// A second implementation of the device, in Python, answers the driver at a port.
#[test]
fn driver_measures_at_the_device_of_the_tutorial() {
    let folder = Folder::new("sonar");
    let link = folder.path().join("port");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/sonar.py");
    let mut sonar = Command::new("python3")
        .arg(script)
        .arg(&link)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut printed = BufReader::new(sonar.stdout.take().unwrap()).lines();
    assert!(printed.next().unwrap().unwrap().starts_with("connect with"));
    let report = run(Some(link));
    drop(sonar.stdin.take());
    sonar.wait().unwrap();
    let measured = report.expectations[2].outcome.measured.unwrap();
    assert!((0.12..=0.14).contains(&measured), "{measured}");
    let answers = printed.next().unwrap().unwrap();
    assert!(
        answers.ends_with(" answers") && answers != "0 answers",
        "{answers}"
    );
}

#[test]
fn tutorials_quote_the_template() {
    let pages = [
        (include_str!("../../drivers/README.md"), 100),
        (include_str!("../../docs/tutorial-serial-device.md"), 60),
        (include_str!("../../docs/tutorial-timing-tests.md"), 100),
    ];
    let template = [
        include_str!("../../twin/cli/templates/driver/src/protocol.rs"),
        include_str!("../../twin/cli/templates/driver/src/driver.rs"),
        include_str!("../../twin/cli/templates/driver/src/device.rs"),
        include_str!("../../twin/cli/templates/driver/src/bus.rs"),
        include_str!("../../twin/cli/templates/driver/src/main.rs"),
        include_str!("../../twin/cli/templates/driver/src/timing.rs"),
        include_str!("../../twin/cli/templates/driver/scenario.toml"),
        include_str!("checked.rs"),
    ];
    let sources = template.map(|text| text.replace(NAME, "rangefinder"));
    for (page, quoted_min) in pages {
        let blocks = page.split("```").skip(1).step_by(2);
        let code =
            blocks.filter(|block| block.starts_with("rust") || block.starts_with("toml\n[bus]"));
        let lines = code.flat_map(|block| block.lines().skip(1));
        let mut quoted = 0;
        for line in lines.filter(|line| !line.starts_with("// ")) {
            assert!(sources.iter().any(|source| source.contains(line)), "{line}");
            quoted += 1;
        }
        assert!(quoted > quoted_min, "{quoted}");
    }
}
