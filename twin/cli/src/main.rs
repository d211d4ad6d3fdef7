//! The program `twin`, with the parts of this build.

use std::process::ExitCode;

fn main() -> ExitCode {
    twinrig::run(twinrig::registry())
}
