//! The program `twin`, with the standard registry.

use std::process::ExitCode;

use twinrig::Registry;

fn main() -> ExitCode {
    twinrig::run(Registry::standard())
}
