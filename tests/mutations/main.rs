//! Every expectation of the repository's scenarios can fail.
//!
//! [`table.toml`](table.toml) names a disturbance for each of them: settings of the scene, as of `--set`, of a plausible size.
//! Under it the expectation fails, while another one of the same file still passes, so that it is this expectation that sees
//! the disturbance and not a run that has come to nothing. Being unobserved is not failing.
//!
//! ```console
//! $ cargo test --release -p twinrig-tests --features mujoco,rapier --test mutations -- --nocapture
//! ```

#![expect(
    clippy::disallowed_methods,
    reason = "runs side by side, and their durations; a run itself has neither threads nor a clock"
)]

mod table;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use table::{Disturbance, Table, expectations};
use twinrig::scenario::{Outcome, Setting, Verdict};
use twinrig::{Assembly, Execution, Registry, TwinError, execute};

/// Plants that are cargo features, and whether this build has them.
const FEATURES: [(&str, bool); 2] = [
    ("mujoco", cfg!(feature = "mujoco")),
    ("rapier", cfg!(feature = "rapier")),
];

fn in_this_build(plant: &str) -> bool {
    // A model file of MuJoCo is a plant of the feature of that name.
    let feature = if plant == "mjcf" { "mujoco" } else { plant };
    FEATURES.iter().all(|&(name, has)| name != feature || has)
}

#[test]
fn each_expectation_has_a_disturbance_or_a_reason_for_none() {
    let table = Table::read();
    let mut faults = table.misuses();
    for expectation in expectations() {
        let disturbed = table
            .disturbances
            .iter()
            .any(|one| one.breaks(&expectation));
        let excepted = table
            .exceptions
            .iter()
            .any(|one| one.is_about(&expectation));
        match (disturbed, excepted) {
            (false, false) => faults.push(format!("{expectation}: nothing disturbs it")),
            (true, true) => faults.push(format!("{expectation}: disturbed, and an exception")),
            _ => {}
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What becomes of the expectations of `scenario` under `settings`.
fn outcomes(scenario: &Path, settings: &[Setting]) -> Result<Vec<Outcome>, TwinError> {
    let registry = Registry::standard();
    let assembly = Assembly::of_file(&registry, scenario, settings)?;
    let report = execute(&assembly, &Execution::default())?;
    Ok(report.expectations.into_iter().map(|line| line.0).collect())
}

/// Runs `disturbance`, and says in which respects it is not as the table has it.
fn faults_of(disturbance: &Disturbance) -> Vec<String> {
    let scenario = disturbance.path();
    let settings: Vec<Setting> = disturbance.settings().collect();
    let mut faults = Vec::new();
    let mut are = |settings: &[Setting], wanted: Verdict| match outcomes(&scenario, settings) {
        Ok(outcomes) => {
            let verdict = |name: &String| {
                let outcome = outcomes.iter().find(|outcome| outcome.name == *name);
                outcome.map(|outcome| outcome.verdict)
            };
            let others = disturbance
                .fails
                .iter()
                .filter(|name| verdict(name) != Some(wanted));
            faults.extend(others.map(|name| {
                let found = verdict(name);
                format!("{disturbance}: `{name}` is {found:?}, not {wanted:?}")
            }));
            if outcomes
                .iter()
                .all(|outcome| outcome.verdict != Verdict::Pass)
            {
                faults.push(format!("{disturbance}: nothing passes"));
            }
        }
        Err(error) => faults.push(format!("{disturbance}: {error}")),
    };
    are(&settings, Verdict::Fail);
    if let Some(length) = disturbance.length() {
        are(&[length], Verdict::Pass);
    }
    faults
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "takes minutes without optimisation; ci/test runs it with --release"
)]
fn each_expectation_fails_under_its_disturbance() {
    let begin = Instant::now();
    let table = Table::read();
    let (wanted, left): (Vec<_>, Vec<_>) =
        (table.disturbances.iter()).partition(|one| in_this_build(&one.plant()));
    let next = AtomicUsize::new(0);
    let work = || {
        let mut faults = Vec::new();
        while let Some(disturbance) = wanted.get(next.fetch_add(1, Ordering::Relaxed)) {
            let begin = Instant::now();
            faults.extend(faults_of(disturbance));
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
        "{} disturbances, {} of plants that this build lacks, {:.1} s",
        wanted.len(),
        left.len(),
        begin.elapsed().as_secs_f64()
    );
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
