//! Reading time is linear in the number of expectations.

use crate::common::{parse, text};

/// Returns the allocations for reading a scenario with `count` expectations.
fn allocations(count: usize, expectation: &str) -> u64 {
    let more = format!("[[expect]]\n{expectation}\n").repeat(count);
    let text = text(&more);
    let mut read = None;
    let info = allocation_counter::measure(|| {
        read = Some(parse(&text).map_err(|error| (error.problems.len(), error.to_string())));
    });
    let found = match read.unwrap() {
        Ok(scenario) => {
            let names = scenario.expectations.iter().map(|one| one.name.as_str());
            let mut names: Vec<&str> = names.collect();
            names.sort_unstable();
            names.dedup();
            names.len()
        }
        Err((problems, _)) => problems,
    };
    assert!(
        found >= count,
        "{found}: each has a distinct name, or is an error"
    );
    info.count_total
}

#[test]
fn allocations_are_linear_in_the_expectations() {
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

/// Regression test: numbering of equal names and line lookup of errors were quadratic in the number
/// of expectations.
#[test]
#[expect(
    clippy::disallowed_methods,
    reason = "a quadratic reader takes minutes"
)]
fn ten_thousand_expectations_are_read_within_a_minute() {
    let started = std::time::Instant::now();
    for expectation in ["body = { fall = false }", "body = { fal = false }"] {
        allocations(10_000, expectation);
    }
    assert!(started.elapsed() < std::time::Duration::from_secs(60));
}
