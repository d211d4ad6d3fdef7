//! Termination of runs and served twins by signals.

use twinrig_record::Recording;

use super::trace::{COAST, MODES, requests, trace_of, written};
use super::{EndReason, Pair, Running, STAND, endless, with_retries};
use crate::common::{Folder, twin};

/// Number of motors of the four boards.
const MOTORS: usize = 8;

#[test]
fn interrupted_run_sets_motors_to_coast() {
    let folder = Folder::new("coast");
    let scenario = endless(&folder);
    let link = folder.join("bus");
    for signal in ["-INT", "-TERM"] {
        let recording = Pair::under_way(&folder, &scenario, &link, |mut pair| {
            pair.run.signal(signal);
            let done = pair.run.end().in_time("")?;
            is_interrupted(&done, &pair.recording);
            // The served twin detects the closed port and terminates.
            let served = pair.served.end();
            assert_eq!(served.code, Some(0), "{served:?}");
            assert!(!exists(&link));
            Ok(pair.recording)
        });
        let requests = requests(&trace_of(&recording));
        // Repeated requests occur several times.
        let last = requests.iter().rev().map_while(|request| written(request));
        let coasting =
            last.take_while(|(register, mode)| MODES.contains(register) && *mode == COAST);
        assert!(coasting.count() >= MOTORS);
    }
}

fn is_interrupted(done: &EndReason, recording: &str) {
    let report = done.report();
    assert_eq!(done.code, Some(2), "{done:?}");
    assert_eq!(report["verdict"], "error");
    let error = report["error"].as_str().unwrap();
    assert!(error.contains("interrupted at"), "{error}");
    assert!(report["real_time"]["iterations"].as_u64().unwrap() > 0);
    let recording = Recording::open(recording.as_ref()).unwrap();
    assert!(recording.is_complete());
    assert_eq!(recording.fingerprint(), report["fingerprint"].as_str());
}

fn exists(link: &str) -> bool {
    std::fs::symlink_metadata(link).is_ok()
}

#[test]
fn terminated_twin_removes_its_link() {
    let folder = Folder::new("serve-ends");
    let scenario = folder.file("bench.toml", STAND);
    let link = folder.join("bus");
    for signal in ["-INT", "-TERM"] {
        let mut served = Running::serve(&folder, &scenario, &link, &[]);
        assert!(exists(&link));
        let command = format!("connect with: twin run {scenario} --port sbcp={link}\n");
        assert!(served.prints().ends_with(&command), "{}", served.prints());
        served.signal(signal);
        let served = served.end();
        assert_eq!(served.code, Some(0), "{served:?}");
        assert!(
            served.out.contains("lag of the events behind the clock"),
            "{served:?}"
        );
        assert!(!exists(&link));
    }
}

#[test]
fn link_of_running_twin_is_refused() {
    let folder = Folder::new("taken");
    let (bench, link) = (endless(&folder), folder.join("boards"));
    let mut first = Running::serve(&folder, &bench, &link, &[]);
    let pty = format!("sbcp={link}");
    let refused = twin(&["serve", &bench, "--pty", &pty]);
    assert_eq!(refused.code, 2, "{refused:?}");
    assert!(
        refused.err.contains("another twin is served"),
        "{refused:?}"
    );
    assert!(exists(&link));
    first.signal("-TERM");
    assert_eq!(first.end().code, Some(0));
    let mut second = Running::serve(&folder, &bench, &link, &[]);
    second.signal("-TERM");
    assert_eq!(second.end().code, Some(0));
}

#[test]
fn twin_with_keep_serves_successive_runs() {
    let folder = Folder::new("keep");
    let scenario = folder.file("bench.toml", STAND);
    let link = folder.join("bus");
    let mut served = Running::serve(&folder, &scenario, &link, &["--keep"]);
    for _ in 0..2 {
        let done = with_retries(|| {
            let run = Running::run(&folder, &scenario, &link, &["--json"]).end();
            run.in_time("")
        });
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    served.signal("-INT");
    assert_eq!(served.end().code, Some(0));
}

#[test]
fn missing_privilege_for_priority_is_reported() {
    let folder = Folder::new("priority");
    let scenario = folder.file("bench.toml", STAND);
    let link = folder.join("bus");
    let mut served = Running::serve(&folder, &scenario, &link, &["--priority", "1"]);
    served.signal("-TERM");
    let served = served.end();
    assert_eq!(served.code, Some(0), "{served:?}");
    let mut notes = served.err.lines();
    let refused = |note: &str| note.starts_with("note: ") && note.contains("raise the limit");
    assert!(notes.all(refused), "{served:?}");
    let refused = twin(&["serve", &scenario, "--priority", "100"]);
    assert!(
        refused.code == 2 && refused.err.contains("1..=99"),
        "{refused:?}"
    );
}

#[test]
fn stale_link_of_killed_twin_is_replaced() {
    let folder = Folder::new("left");
    let scenario = folder.file("bench.toml", STAND);
    let link = folder.join("bus");
    let mut killed = Running::serve(&folder, &scenario, &link, &[]);
    killed.signal("-KILL");
    killed.end();
    assert!(exists(&link));
    let mut served = Running::serve(&folder, &scenario, &link, &[]);
    served.signal("-TERM");
    assert_eq!(served.end().code, Some(0));
}
