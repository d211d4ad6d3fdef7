//! Live runs on plants of other engines, which save their state: branches are the runs of their
//! scenarios.

use twinrig::kernel::SimTime;
use twinrig::{Assembly, Execution, execute};
use twinrig_live::{SNAPSHOT_BYTES, Session};
use twinrig_tests::{scenarios, shipped};

use super::ENGINES;

fn ms(ms: u64) -> SimTime {
    SimTime::from_nanos(ms * 1_000_000)
}

/// Back, a change, on, back again with a ramp of another variable, and back to each branch.
#[test]
fn branches_are_runs_of_their_scenarios() {
    for plant in ENGINES {
        check(plant);
    }
}

fn check(plant: &str) {
    let registry = twinrig::registry();
    let settings = [
        ("plant.model", plant),
        ("until", "500 ms"),
        ("record", "{}"),
    ];
    let assembly = shipped(&registry, "trot.toml", &settings).unwrap();
    let mut session = Session::new(&assembly, SNAPSHOT_BYTES).unwrap();
    session.advance(ms(333), &mut ());
    session.seek(ms(150), &mut ()).unwrap();
    session.set("frequency", 3.3, None).unwrap();
    session.advance(ms(407), &mut ());
    session.seek(ms(255), &mut ()).unwrap();
    session.set("step_length", 0.12, Some(0.2)).unwrap();
    session.advance(ms(500), &mut ());
    assert_eq!(session.branches().len(), 3);
    let folder = scenarios();
    let mut fingerprints = Vec::new();
    for branch in [2, 0, 1] {
        session.select(branch, None, &mut ()).unwrap();
        session.advance(ms(500), &mut ());
        let text = session.text_of(branch, &folder).unwrap();
        let builder = Assembly::builder(&registry);
        let again = builder.text("branch.toml", &text, &folder).unwrap();
        let report = execute(&again, &Execution::default()).unwrap();
        let fingerprint = session.fingerprint().to_string();
        assert_eq!(report.fingerprint.as_ref(), Some(&fingerprint), "{text}");
        fingerprints.push(fingerprint);
    }
    fingerprints.sort();
    fingerprints.dedup();
    assert_eq!(fingerprints.len(), 3, "three futures are three runs");
}
