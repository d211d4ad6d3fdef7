//! Rows of studies on disk: engines, partitions, interruptions and later calls change no result.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

use crate::common::{Done, Folder, json, study_result, twin};
use crate::hardware::wait_until;

fn scenario(name: &str) -> String {
    format!("{}/../../scenarios/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// A study of each kind that keeps rows, with the number of its runs.
fn studies() -> Vec<(&'static str, usize, Vec<String>)> {
    let short = "--set duration='2 s' --set expect=[{body={fall=false}}]";
    let words = |kind, runs, text: String| (kind, runs, crate::common::shell_words(&text));
    let [trot, change, own, force] = [
        "trot.toml",
        "step-change.toml",
        "tegotae-trot.toml",
        "tegotae-force.toml",
    ]
    .map(scenario);
    vec![
        words(
            "transition",
            2,
            format!(
                "{trot} {short} --plateau 1s,2s \
                 --set 'change=[{{at=\"1 s\",set=\"step_length\",to=\"8 cm\"}}]'"
            ),
        ),
        words(
            "modulation",
            1 + 2 * 2,
            format!("{change} --by=-10mm,-20mm --points 2 --steps 1 --after 1s"),
        ),
        words(
            "loads",
            2 + 2 + 2,
            format!("{own} {force} {short} --after 1s --phases 1s --by=-10mm --points 1 --steps 1"),
        ),
        words(
            "gait",
            2 * 2,
            format!(
                "{trot} {short} --after 1s --frequency 3Hz,3.5Hz \
                 --step-length 8cm,10cm"
            ),
        ),
        words(
            "robustness",
            4 + 4,
            format!("{trot} {change} {short} --ensemble 4"),
        ),
    ]
}

fn command(kind: &str, words: &[String], out: &str, more: &[&str]) -> Vec<String> {
    let begin = ["study", kind, "--json", "--out", out].map(str::to_owned);
    let more = more.iter().map(|word| (*word).to_owned());
    begin
        .into_iter()
        .chain(words.iter().cloned())
        .chain(more)
        .collect()
}

fn study(kind: &str, words: &[String], out: &str, more: &[&str]) -> Done {
    let words = command(kind, words, out, more);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    twin(&words)
}

/// Returns everything that a study found.
fn found(done: &Done) -> Value {
    let mut found = study_result(done);
    // It names the folder.
    found.as_object_mut().unwrap().remove("command");
    found
}

/// Returns the files of the rows below a folder.
fn row_files(folder: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "jsonl") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn lines(path: &Path) -> usize {
    let text = std::fs::read(path).unwrap_or_default();
    text.split(|byte| *byte == b'\n').count() - 1
}

fn rows(folder: &str) -> usize {
    row_files(folder).iter().map(|path| lines(path)).sum()
}

#[test]
fn jobs_and_partitions_change_no_result() {
    let folder = Folder::new("study-rows");
    for (kind, runs, words) in studies() {
        let out = |name: &str| folder.join(&format!("{kind}-{name}"));
        let whole = found(&study(kind, &words, &out("one"), &["--jobs", "1"]));
        assert_eq!(rows(&out("one")), runs, "{kind}");
        let two = found(&study(kind, &words, &out("two"), &["--jobs", "2"]));
        assert_eq!(two, whole, "{kind}");
        let part = |part: &str| study(kind, &words, &out("parts"), &["--partition", part]);
        let first = part("1/2");
        assert_eq!((first.code, first.err.as_str()), (0, ""), "{}", first.out);
        let partial = json(&first.out).remove(0);
        assert_eq!(partial["verdict"], "partial");
        let missing = usize::try_from(partial["missing"].as_u64().unwrap()).unwrap();
        assert_eq!(rows(&out("parts")) + missing, runs, "{kind}");
        assert!((1..runs).contains(&missing), "{kind}");
        assert_eq!(found(&part("2/2")), whole, "{kind}");
        // Now the first one has the result, too, and runs nothing.
        let before = rows(&out("parts"));
        assert_eq!(found(&part("1/2")), whole, "{kind}");
        assert_eq!(rows(&out("parts")), before, "{kind}");
    }
}

/// As a process is killed within its write: the last line of each file is torn.
#[test]
fn torn_rows_are_repeated_and_the_others_are_kept() {
    let folder = Folder::new("study-torn");
    // One with two rounds, and one with a single one.
    let kinds = ["loads", "gait"];
    for (kind, runs, words) in studies().into_iter().filter(|it| kinds.contains(&it.0)) {
        let out = folder.join(kind);
        let whole = found(&study(kind, &words, &out, &[]));
        for path in row_files(&out) {
            let bytes = std::fs::read(&path).unwrap();
            std::fs::write(&path, &bytes[..bytes.len() - 5]).unwrap();
        }
        let left = rows(&out);
        assert!(left < runs, "{kind}");
        assert_eq!(found(&study(kind, &words, &out, &[])), whole, "{kind}");
        assert_eq!(rows(&out), runs, "{kind}");
        let changed = [&words[..], &["--set".to_owned(), "seed=7".to_owned()]].concat();
        found(&study(kind, &changed, &out, &[]));
        assert_eq!(
            rows(&out),
            2 * runs,
            "{kind}: a row of other settings is used"
        );
    }
}

#[test]
fn killed_study_continues_with_the_same_files() {
    let folder = Folder::new("study-killed");
    let (kind, runs, words) = studies().remove(4);
    let start = |out: &str| -> Child {
        Command::new(env!("CARGO_BIN_EXE_twin"))
            .args(command(kind, &words, &folder.join(out), &["--jobs", "1"]))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let csv = |out: &str| {
        let files = std::fs::read_dir(folder.join(out)).unwrap();
        let mut paths = files.map(|entry| entry.unwrap().path());
        let csv = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "csv");
        std::fs::read(paths.find(csv).unwrap()).unwrap()
    };
    assert!(start("whole").wait().unwrap().success());
    let mut child = start("parts");
    wait_until("a run is stored", || {
        rows(&folder.join("parts")) > 1 || child.try_wait().unwrap().is_some()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = rows(&folder.join("parts"));
    assert!((1..runs).contains(&kept), "{kept}");
    assert!(start("parts").wait().unwrap().success());
    assert_eq!(csv("parts"), csv("whole"));
    assert_eq!(rows(&folder.join("parts")), runs);
}

/// Studies that measure run times: kept rows are those of the start that measured them, bit for
/// bit, and the others are measured by the next start.
#[test]
fn killed_measurement_continues_with_the_rows_of_both_starts() {
    let folder = Folder::new("study-measured");
    let legs = scenario("passive-legs.toml");
    let out = folder.join("parts");
    let program = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twin"));
        command
            .args([
                "study",
                "precision",
                &legs,
                "--plant=massless,lcp",
                "--out",
                &out,
            ])
            .args(["--duration=10 ms", "--budget=3600 s"]);
        command
    };
    let mut json = program();
    json.arg("--json")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut child = json.spawn().unwrap();
    let mut continued = || {
        let output = json.stdout(Stdio::piped()).output().unwrap();
        let mut study: Value = serde_json::from_slice(&output.stdout).unwrap();
        // The load of the machine.
        study.as_object_mut().unwrap().remove("machine");
        study
    };
    // A line of the start, three of references, and rows.
    wait_until("rows are stored", || {
        rows(&out) > 6 || child.try_wait().unwrap().is_some()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    let before = std::fs::read(&row_files(&out)[0]).unwrap();
    let second = continued();
    let after = std::fs::read(&row_files(&out)[0]).unwrap();
    assert!(after.starts_with(&before));
    let measured = second["rows"].as_array().unwrap();
    let of_start = |start: u64| measured.iter().filter(move |row| row["start"] == start);
    assert!(of_start(1).count() >= 2, "{measured:?}");
    assert!(of_start(2).count() >= 1, "{measured:?}");
    let starts: Vec<&Value> = second["starts"].as_array().unwrap().iter().collect();
    let numbers = starts.iter().map(|start| start["start"].as_u64());
    assert_eq!(numbers.collect::<Vec<_>>(), [Some(1), Some(2)]);
    // The rows of the first start are those that it wrote.
    let before = String::from_utf8(before).unwrap();
    for row in of_start(1) {
        let run_time = format!("\"run_s_per_simulated_s\":{}", row["run_s_per_simulated_s"]);
        assert!(before.contains(&run_time), "{run_time}");
    }
    // A third start measures nothing.
    assert_eq!(continued(), second);
    let text = program().output().unwrap().stdout;
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains("parts of earlier starts: "), "{text}");
}
