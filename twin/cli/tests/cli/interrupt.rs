//! SIGINT and SIGTERM end a run with a verdict and a complete recording.

use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use twinrig_record::Recording;

use crate::common::{Folder, json, twin};
use crate::hardware::{is_longer, wait_until};

/// Scenario with an unlimited duration.
const ENDLESS: &str = r#"
robot = "cheetah-cub"
duration = "1000000 s"
plant = { model = "massless", base = "fixed" }
controller = { kind = "stand", period = "2 ms" }
expect = [{ body = { fall = false } }]
"#;

#[test]
fn sigint_ends_run_with_verdict_and_complete_recording() {
    ends_with_recording("-INT");
}

#[test]
fn sigterm_ends_run_with_verdict_and_complete_recording() {
    ends_with_recording("-TERM");
}

fn ends_with_recording(signal: &str) {
    let folder = Folder::new(&format!("interrupt{signal}"));
    let scenario = folder.file("endless.toml", ENDLESS);
    let child = Command::new(env!("CARGO_BIN_EXE_twin"))
        .args(["run", &scenario, "--json", "--out", &folder.join("out")])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let path = folder.join("out/endless-seed1.mcap");
    // After the first flush the run is under way and the handler is installed.
    wait_until("data are recorded", || is_longer(&path, 100_000));
    kill(signal, &child);
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

fn kill(signal: &str, child: &Child) {
    let id = child.id().to_string();
    let killed = Command::new("kill").args([signal, &id]).status();
    assert!(killed.unwrap().success());
}

/// Returns the output of `twin` with the arguments `words`, which receives one signal soon after
/// the file at `path` exists.
fn ends_after_one(signal: &str, words: &[&str], path: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_twin"))
        .args(words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_until("it has begun", || std::fs::exists(path).unwrap());
    sleep(Duration::from_millis(200));
    kill(signal, &child);
    wait_until("it ends", || child.try_wait().unwrap().is_some());
    child.wait_with_output().unwrap()
}

/// With steps, periods and observations of 1 ns, a check per simulated slice alone would take an
/// hour.
#[test]
fn one_signal_ends_run_with_steps_of_a_nanosecond() {
    let folder = Folder::new("interrupt-steps");
    let scenario = folder.file("endless.toml", ENDLESS);
    let settings: [&[&str]; 5] = [
        &["plant.step=1 ns", "observe.period=20 ms"],
        &["plant.step=1 ns", "plant.model=lcp", "observe.period=20 ms"],
        &["controller.period=1 ns"],
        &["observe.period=1 ns"],
        &["plant.coupling={ grid = \"1 ns\" }", "observe.period=20 ms"],
    ];
    for (n, settings) in settings.into_iter().enumerate() {
        let out = folder.join(&format!("out{n}"));
        let set = settings.iter().flat_map(|setting| ["--set", setting]);
        let signal = if n % 2 == 0 { "-INT" } else { "-TERM" };
        let mut words = vec!["run", &scenario, "--json", "--out", &out];
        words.extend(set);
        let output = ends_after_one(signal, &words, &out);
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(2), "{settings:?}: {text}");
        let report = &json(&text)[0];
        let error = report["error"].as_str().unwrap();
        assert!(error.contains("interrupted at"), "{settings:?}: {error}");
        let recording = Recording::open(report["recording"].as_str().unwrap().as_ref()).unwrap();
        assert!(recording.is_complete(), "{settings:?}");
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn one_signal_ends_study() {
    let folder = Folder::new("interrupt-study");
    let scenario = folder.file("endless.toml", ENDLESS);
    let out = folder.join("out");
    let words = ["study", "precision", &scenario, "--json", "--out", &out];
    let output = ends_after_one(
        "-INT",
        &[&words[..], &["--duration", "300 s"]].concat(),
        &out,
    );
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let error = json(&text)[0]["error"].as_str().unwrap().to_owned();
    // In a part of the study, or while the commands of the scenario are recorded.
    assert!(error.contains("interrupted a"), "{error}");
}

/// A blocking system call does not poll the interrupt flag.
#[test]
fn one_signal_ends_blocked_program() {
    let folder = Folder::new("interrupt-pipe");
    let pipe = folder.join("pipe.toml");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let output = ends_after_one("-TERM", &["run", &pipe], &pipe);
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("error: interrupted"), "{message}");
}
