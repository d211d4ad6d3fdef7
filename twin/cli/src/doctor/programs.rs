//! Other programs: the tool chain of Rust, and Python.

use super::build::VERSION;
use super::item::Item;
use super::system::{Output, System};

/// Oldest Rust that builds crates against this one.
const RUST: &str = env!("CARGO_PKG_RUST_VERSION");
/// Purpose of the tool chain.
const OWN: &str = "building controllers, drivers and plants of your own; runs do not need it";
/// Purpose of the Python package.
const PYTHON: &str = "import twinrig in Python; this program does not need it";

pub(super) fn items(system: &dyn System) -> Vec<Item> {
    let tools = ["cargo", "rustc"].map(|tool| toolchain(system, tool));
    tools.into_iter().chain([python(system)]).collect()
}

fn toolchain(system: &dyn System, tool: &str) -> Item {
    let install = "install Rust as on https://rustup.rs";
    match system.output(tool, &["--version"]) {
        Output::Line(line) => {
            let version = line.split(' ').nth(1).unwrap_or_default().to_owned();
            if is_older(&version, RUST) {
                Item::notice(tool, format!("{version}, older than {RUST}"))
                    .affecting(OWN, "rustup update stable")
            } else {
                Item::ok(tool, version)
            }
        }
        Output::Failed(error) => {
            Item::notice(tool, format!("fails: {error}")).affecting(OWN, install)
        }
        Output::Missing => Item::notice(tool, "not found").affecting(OWN, install),
    }
}

/// Returns whether a version, by its numbers before a `-`, is lower than another.
fn is_older(version: &str, than: &str) -> bool {
    let numbers = |text: &str| -> Vec<u32> {
        let plain = text.split('-').next().unwrap_or_default();
        plain
            .split('.')
            .map(|part| part.parse().unwrap_or(0))
            .collect()
    };
    numbers(version) < numbers(than)
}

fn python(system: &dyn System) -> Item {
    const NAME: &str = "Python package";
    let script = "import twinrig; print(twinrig.__version__)";
    match system.output("python3", &["-c", script]) {
        Output::Line(version) if version == VERSION => Item::ok(NAME, version),
        Output::Line(version) => {
            let finding = format!("version {version}, this program is {VERSION}");
            Item::problem(NAME, finding).affecting(PYTHON, "pip install . in the repository")
        }
        Output::Failed(error) if error.contains("No module named 'twinrig'") => {
            Item::notice(NAME, "not installed for python3")
                .affecting(PYTHON, "pip install . in the repository")
        }
        Output::Failed(error) => Item::problem(NAME, format!("cannot be imported: {error}"))
            .affecting(PYTHON, "pip install --force-reinstall . in the repository"),
        Output::Missing => Item::notice(NAME, "there is no python3")
            .affecting(PYTHON, "install Python 3.10 or newer"),
    }
}
