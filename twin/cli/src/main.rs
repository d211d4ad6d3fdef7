//! The program `twin`.

use std::process::ExitCode;

use twinrig::Registry;

fn main() -> ExitCode {
    twinrig::run(Registry::standard())
}
