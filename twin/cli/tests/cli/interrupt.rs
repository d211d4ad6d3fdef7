//! Ctrl-C, or a plain kill, ends a run with a verdict and a whole recording.

use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use twinrig_record::Recording;

use crate::common::{Folder, json, twin};

/// Longer than anybody waits.
const ENDLESS: &str = r#"
robot = "cheetah-cub"
duration = "1000000 s"
plant = { model = "massless", base = "fixed" }
controller = { kind = "stand", period = "2 ms" }
expect = [{ body = { fall = false } }]
"#;

#[test]
fn an_interrupted_run_leaves_a_verdict_and_a_whole_recording() {
    ends_well("-INT");
}

#[test]
fn a_run_that_is_told_to_end_leaves_a_verdict_and_a_whole_recording() {
    ends_well("-TERM");
}

fn ends_well(signal: &str) {
    let folder = Folder::new(&format!("interrupt{signal}"));
    let scenario = folder.file("endless.toml", ENDLESS);
    let child = Command::new(env!("CARGO_BIN_EXE_twin"))
        .args(["run", &scenario, "--json", "--out", &folder.join("out")])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let path = folder.join("out/endless-seed1.mcap");
    #[expect(clippy::disallowed_methods, reason = "the test does not wait for ever")]
    let started = Instant::now();
    // Past the first flush the run is under way and its handler listens.
    while std::fs::metadata(&path).map_or(0, |file| file.len()) < 100_000 {
        assert!(
            started.elapsed() < Duration::from_secs(60),
            "nothing is recorded"
        );
        sleep(Duration::from_millis(10));
    }
    let interrupt = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(interrupt.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let report = &json(&String::from_utf8(output.stdout).unwrap())[0];
    assert_eq!(report["verdict"], "error");
    assert!(
        report["error"].as_str().unwrap().contains("interrupted at"),
        "{report}"
    );
    assert_eq!(report["expectations"][0]["verdict"], "unobserved");
    let recording = Recording::open(path.as_ref()).unwrap();
    assert!(recording.is_complete());
    assert_eq!(recording.fingerprint(), report["fingerprint"].as_str());
    let replayed = twin(&["replay", &path, "--json"]);
    assert_eq!(replayed.code, 0, "{replayed:?}");
    let replayed = &json(&replayed.out)[0];
    assert_eq!(replayed["fingerprint"], report["fingerprint"]);
    assert_eq!(replayed["cut_off_s"], report["simulated_s"]);
}
