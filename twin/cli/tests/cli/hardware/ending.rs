//! Ctrl-C, or a plain kill, ends runs and twins as it should.

use twinrig_record::Recording;

use super::trace::{COAST, MODES, requests, story, written};
use super::{BENCH, Ended, Pair, Running, endless, patiently};
use crate::common::{Folder, twin};

/// Motors of the four boards.
const MOTORS: usize = 8;

#[test]
fn an_interrupted_run_lets_the_motors_coast() {
    let folder = Folder::new("coast");
    let scenario = endless(&folder);
    let link = folder.join("bus");
    for signal in ["-INT", "-TERM"] {
        let recording = Pair::under_way(&folder, &scenario, &link, |mut pair| {
            pair.run.signal(signal);
            let done = pair.run.end().in_time("")?;
            is_interrupted(&done, &pair.recording);
            // Whoever served it sees that the program is gone, and goes, too.
            let served = pair.served.end();
            assert_eq!(served.code, Some(0), "{served:?}");
            assert!(!is_there(&link));
            Ok(pair.recording)
        });
        let requests = requests(&story(&recording));
        // What had to be repeated stands there more than once.
        let last = requests.iter().rev().map_while(|request| written(request));
        let coasting =
            last.take_while(|(register, mode)| MODES.contains(register) && *mode == COAST);
        assert!(coasting.count() >= MOTORS);
    }
}

fn is_interrupted(done: &Ended, recording: &str) {
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

fn is_there(link: &str) -> bool {
    std::fs::symlink_metadata(link).is_ok()
}

#[test]
fn a_twin_that_is_told_to_end_leaves_no_link_behind() {
    let folder = Folder::new("serve-ends");
    let scenario = folder.file("bench.toml", BENCH);
    let link = folder.join("bus");
    for signal in ["-INT", "-TERM"] {
        let mut served = Running::serve(&folder, &scenario, &link, &[]);
        assert!(is_there(&link));
        let how = format!("now, elsewhere: twin run {scenario} --port sbcp={link}\n");
        assert!(served.prints().ends_with(&how), "{}", served.prints());
        served.signal(signal);
        let served = served.end();
        assert_eq!(served.code, Some(0), "{served:?}");
        assert!(served.out.contains("later than its instant"), "{served:?}");
        assert!(!is_there(&link));
    }
}

#[test]
fn a_name_at_which_a_twin_is_served_is_refused_until_that_is_over() {
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
    assert!(is_there(&link));
    first.signal("-TERM");
    assert_eq!(first.end().code, Some(0));
    let mut second = Running::serve(&folder, &bench, &link, &[]);
    second.signal("-TERM");
    assert_eq!(second.end().code, Some(0));
}

#[test]
fn a_twin_that_is_to_stay_serves_one_run_after_the_other() {
    let folder = Folder::new("keep");
    let scenario = folder.file("bench.toml", BENCH);
    let link = folder.join("bus");
    let mut served = Running::serve(&folder, &scenario, &link, &["--keep"]);
    for _ in 0..2 {
        let done = patiently(|| {
            let run = Running::run(&folder, &scenario, &link, &["--json"]).end();
            run.in_time("")
        });
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    served.signal("-INT");
    assert_eq!(served.end().code, Some(0));
}

#[test]
fn a_twin_of_high_priority_serves_or_says_that_it_may_not() {
    let folder = Folder::new("priority");
    let scenario = folder.file("bench.toml", BENCH);
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
fn a_link_that_a_killed_twin_has_left_is_taken_over() {
    let folder = Folder::new("left");
    let scenario = folder.file("bench.toml", BENCH);
    let link = folder.join("bus");
    let mut killed = Running::serve(&folder, &scenario, &link, &[]);
    killed.signal("-KILL");
    killed.end();
    assert!(is_there(&link));
    let mut served = Running::serve(&folder, &scenario, &link, &[]);
    served.signal("-TERM");
    assert_eq!(served.end().code, Some(0));
}
