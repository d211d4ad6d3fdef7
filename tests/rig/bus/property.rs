//! Execution of a property test.

use proptest::prelude::*;
use proptest::test_runner::{Config, TestCaseError, TestRunner};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::Following;

use crate::bus::bus_scenario::BusScenario;
use crate::bus::harness::{Commands, GRID, Harness};

/// Number of cases for which the counts of the properties are stated; `PROPTEST_CASES` defaults to
/// it.
const BASE_CASES: u32 = 256;

/// Checks a property for `cases` scenarios, scaled by `PROPTEST_CASES`.
pub fn check_property(
    cases: u32,
    scenarios: impl Strategy<Value = BusScenario>,
    property: impl Fn(&BusScenario) -> Result<(), String>,
) {
    let default_cases = Config::default().cases;
    let cases = (u64::from(cases) * u64::from(default_cases)).div_ceil(u64::from(BASE_CASES));
    let config = Config {
        cases: u32::try_from(cases).unwrap_or(u32::MAX),
        failure_persistence: None,
        max_shrink_iters: 400,
        ..Config::default()
    };
    let mut runner = TestRunner::new(config);
    let outcome = runner.run(&scenarios, |scenario| {
        let scenario = with_opening_time(scenario);
        property(&scenario)
            .map_err(|why| TestCaseError::fail(format!("{why}\n\nThe scenario:\n\n{scenario}")))
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

/// Determines the time at which the boards of the scenario are ready.
pub fn with_opening_time(scenario: BusScenario) -> BusScenario {
    let quiet = BusScenario {
        timed_faults: Vec::new(),
        ..scenario.clone()
    };
    let mut harness = Harness::new(&quiet.config(), &quiet.process_config(Commands::Random));
    let opened = harness.open().unwrap();
    BusScenario { opened, ..scenario }
}

/// Creates a harness whose commands are unique (plain following) or never clipped by the boards
/// (smooth following).
pub fn harness_for(scenario: &BusScenario) -> Harness {
    let commands = match scenario.following {
        Following::Plain => Commands::Random,
        Following::Smooth => scenario.random_walk(),
    };
    Harness::new(&scenario.config(), &scenario.process_config(commands))
}

/// Time of the last observation before the control step at or after `to`.
pub fn before_step(scenario: &BusScenario, to: SimTime) -> SimTime {
    let period = scenario.period.as_nanos();
    let steps = to.as_nanos().div_ceil(period);
    SimTime::from_nanos(steps * period - GRID.as_nanos())
}

/// Runs the scenario until `extension` after its last fault.
pub fn run(scenario: &BusScenario, extension: SimDuration) -> Result<Harness, String> {
    let mut harness = harness_for(scenario);
    harness.run_until(before_step(scenario, scenario.last_fault() + extension))?;
    Ok(harness)
}
