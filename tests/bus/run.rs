//! How a property is asked.

use proptest::prelude::*;
use proptest::test_runner::{Config, TestCaseError, TestRunner};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::Following;

use crate::bench::{Bench, Commands, GRID};
use crate::setting::Setting;

/// What is asked of a property at 256 cases, which is `PROPTEST_CASES` where it is not set.
const USUAL: u32 = 256;

/// Asks it of so many settings, or in proportion to `PROPTEST_CASES`.
pub fn ask(
    cases: u32,
    settings: impl Strategy<Value = Setting>,
    property: impl Fn(&Setting) -> Result<(), String>,
) {
    let asked = Config::default().cases;
    let cases = (u64::from(cases) * u64::from(asked)).div_ceil(u64::from(USUAL));
    let config = Config {
        cases: u32::try_from(cases).unwrap_or(u32::MAX),
        failure_persistence: None,
        max_shrink_iters: 400,
        ..Config::default()
    };
    let mut runner = TestRunner::new(config);
    let outcome = runner.run(&settings, |setting| {
        let setting = ready(setting);
        property(&setting)
            .map_err(|why| TestCaseError::fail(format!("{why}\n\nThe scenario:\n\n{setting}")))
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

/// The same, knowing when its boards are ready.
pub fn ready(setting: Setting) -> Setting {
    let quiet = Setting {
        troubles: Vec::new(),
        ..setting.clone()
    };
    let mut bench = Bench::new(&quiet.config(), &quiet.drive(Commands::Random));
    let opened = bench.open().unwrap();
    Setting { opened, ..setting }
}

/// A bench of it whose commands can be told apart, if they are followed plainly, or are never clipped, if smoothly.
pub fn bench_of(setting: &Setting) -> Bench {
    let commands = match setting.following {
        Following::Plain => Commands::Random,
        Following::Smooth => setting.walk(),
    };
    Bench::new(&setting.config(), &setting.drive(commands))
}

/// The last look before the control step at or after `to`.
pub fn before_step(setting: &Setting, to: SimTime) -> SimTime {
    let period = setting.period.as_nanos();
    let steps = to.as_nanos().div_ceil(period);
    SimTime::from_nanos(steps * period - GRID.as_nanos())
}

/// Runs it so much longer than the last of its faults.
pub fn run(setting: &Setting, longer: SimDuration) -> Result<Bench, String> {
    let mut bench = bench_of(setting);
    bench.run_until(before_step(setting, setting.last_fault() + longer))?;
    Ok(bench)
}
