//! Scenarios of thousands of expectations are read in proportion to their length.

mod common;

use common::{parse, text};

/// What it takes to read a scenario of so many expectations \[allocations\].
fn allocations(count: usize, expectation: &str) -> u64 {
    let more = format!("[[expect]]\n{expectation}\n").repeat(count);
    let text = text(&more);
    let mut read = None;
    let info = allocation_counter::measure(|| {
        read = Some(parse(&text).map_err(|error| error.to_string()));
    });
    let found = match read.unwrap() {
        Ok(scenario) => {
            let names = scenario.expectations.iter().map(|one| one.name.as_str());
            let mut names: Vec<&str> = names.collect();
            names.sort_unstable();
            names.dedup();
            names.len()
        }
        Err(error) => error.matches("error: ").count(),
    };
    assert!(
        found >= count,
        "{found}: each has a name of its own, or is a mistake"
    );
    info.count_total
}

#[test]
fn twice_the_expectations_take_twice_the_work() {
    for expectation in [
        "body = { fall = false }",
        "body = { fal = false }",
        "signal = { name = 'leg/*/hip/position', always = { min = '-3 rad' } }",
    ] {
        let (once, twice) = (
            allocations(500, expectation),
            allocations(1_000, expectation),
        );
        assert!(
            twice as f64 <= 2.5 * once as f64,
            "{expectation}: {once} and {twice} allocations"
        );
    }
}

/// Naming a thousand alike took half a million attempts, and telling the line of each mistake, reading all lines before it.
#[test]
#[expect(
    clippy::disallowed_methods,
    reason = "what is not in proportion takes minutes"
)]
fn ten_thousand_are_no_matter() {
    let started = std::time::Instant::now();
    for expectation in ["body = { fall = false }", "body = { fal = false }"] {
        allocations(10_000, expectation);
    }
    assert!(started.elapsed() < std::time::Duration::from_secs(60));
}
