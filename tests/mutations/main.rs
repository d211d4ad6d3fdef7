//! Every expectation of the repository's scenarios can fail.
//!
//! [`table.toml`](table.toml) contains a disturbance for each of them: settings of the scenario, as
//! of `--set`, of plausible size. Under its disturbance the expectation must fail while another one
//! of the same file passes, so that the failure is specific and not that of an invalid run. Being
//! unobserved does not count as failing.
//!
//! ```console
//! $ cargo test --release -p twinrig-tests --features mujoco,rapier --test mutations -- --nocapture
//! ```

#![expect(
    clippy::disallowed_methods,
    reason = "concurrent runs and their durations; a run itself uses neither threads nor a clock"
)]

mod table;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use table::{Disturbance, Table, expectations};
use twinrig::scenario::{Outcome, Setting, Verdict};
use twinrig::{Assembly, Execution, TwinError, execute};

/// Plants that are cargo features, with their availability in this build.
const FEATURES: [(&str, bool); 2] = [
    ("mujoco", cfg!(feature = "mujoco")),
    ("rapier", cfg!(feature = "rapier")),
];

fn in_this_build(plant: &str) -> bool {
    // Models in MuJoCo's file format require the feature `mujoco`.
    let feature = if plant == "mjcf" { "mujoco" } else { plant };
    FEATURES.iter().all(|&(name, has)| name != feature || has)
}

#[test]
fn each_expectation_has_a_disturbance_or_an_exception() {
    let table = Table::read();
    let mut faults = table.invalid_entries();
    for expectation in expectations() {
        let disturbed = table
            .disturbances
            .iter()
            .any(|one| one.is_detected_by(&expectation));
        let excepted = table.exceptions.iter().any(|one| one.covers(&expectation));
        match (disturbed, excepted) {
            (false, false) => faults.push(format!("{expectation}: no disturbance")),
            (true, true) => faults.push(format!("{expectation}: both disturbance and exception")),
            _ => {}
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Returns the outcomes of the expectations of `scenario` under `settings`.
fn outcomes(scenario: &Path, settings: &[Setting]) -> Result<Vec<Outcome>, TwinError> {
    let registry = twinrig::registry();
    let assembly = Assembly::builder(&registry)
        .settings(settings)
        .file(scenario)?;
    let report = execute(&assembly, &Execution::default())?;
    Ok(report
        .expectations
        .into_iter()
        .map(|line| line.outcome)
        .collect())
}

/// Runs `disturbance` and returns its deviations from the table.
fn deviations(disturbance: &Disturbance) -> Vec<String> {
    let scenario = disturbance.path();
    let settings: Vec<Setting> = disturbance.settings().collect();
    let mut faults = Vec::new();
    let mut check = |settings: &[Setting], expected: Verdict| match outcomes(&scenario, settings) {
        Ok(outcomes) => {
            let verdict = |name: &String| {
                let outcome = outcomes.iter().find(|outcome| outcome.name == *name);
                outcome.map(|outcome| outcome.verdict)
            };
            let others = disturbance
                .fails
                .iter()
                .filter(|name| verdict(name) != Some(expected));
            faults.extend(others.map(|name| {
                let found = verdict(name);
                format!("{disturbance}: `{name}` is {found:?}, not {expected:?}")
            }));
            if outcomes
                .iter()
                .all(|outcome| outcome.verdict != Verdict::Pass)
            {
                faults.push(format!("{disturbance}: no expectation passes"));
            }
        }
        Err(error) => faults.push(format!("{disturbance}: {error}")),
    };
    check(&settings, Verdict::Fail);
    if let Some(length) = disturbance.length() {
        check(&[length], Verdict::Pass);
    }
    faults
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "takes minutes; section `mutations` of ci/test runs it"
)]
fn each_expectation_fails_under_its_disturbance() {
    let begin = Instant::now();
    let table = Table::read();
    let (available, skipped): (Vec<_>, Vec<_>) =
        (table.disturbances.iter()).partition(|one| in_this_build(&one.plant()));
    let next = AtomicUsize::new(0);
    let work = || {
        let mut faults = Vec::new();
        while let Some(disturbance) = available.get(next.fetch_add(1, Ordering::Relaxed)) {
            let begin = Instant::now();
            faults.extend(deviations(disturbance));
            println!("{:6.2} s  {disturbance}", begin.elapsed().as_secs_f64());
        }
        faults
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let faults: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let faults = threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap());
        faults.collect()
    });
    println!(
        "{} disturbances, {} of plants not in this build, {:.1} s",
        available.len(),
        skipped.len(),
        begin.elapsed().as_secs_f64()
    );
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
