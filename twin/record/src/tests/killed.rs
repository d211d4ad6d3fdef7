//! A process killed during a run leaves a readable file.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use super::common::*;
use twinrig_record::Recording;
use twinrig_runtime::Group;

const FILE_VARIABLE: &str = "TWINRIG_TEST_KILLED_FILE";

#[test]
#[ignore = "not a test: child process of killed_process_leaves_a_readable_file"]
fn record_until_killed() {
    let Some(file) = std::env::var_os(FILE_VARIABLE) else {
        return;
    };
    let out = std::io::BufWriter::new(std::fs::File::create(file).unwrap());
    let slowly = |_: Group, step: u64, _: &mut [f64]| {
        if step.is_multiple_of(10) {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    record(out, u64::MAX, &|_| true, &slowly).unwrap();
}

#[test]
fn killed_process_leaves_a_readable_file() {
    let file: PathBuf =
        std::env::temp_dir().join(format!("twinrig-killed-{}.mcap", std::process::id()));
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "tests::killed::record_until_killed"])
        .env(FILE_VARIABLE, &file)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    for _ in 0..1000 {
        std::thread::sleep(Duration::from_millis(10));
        if std::fs::metadata(&file).is_ok_and(|data| data.len() > 400_000) {
            break;
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let recording = Recording::open(&file).unwrap();
    std::fs::remove_file(&file).unwrap();
    assert!(!recording.is_complete());
    assert_eq!(
        recording.attachment("scenario.toml"),
        Some(&b"name = \"test\"\n"[..])
    );
    let plant = recording.group("plant").unwrap();
    assert!(plant.len() > 500, "{} samples", plant.len());
    for (step, sample) in (0..).zip(recording.samples(plant)) {
        assert_eq!(sample.all().collect::<Vec<_>>(), plant_values(step));
    }
}
