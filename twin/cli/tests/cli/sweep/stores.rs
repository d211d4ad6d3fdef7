use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use twinrig::kernel::stream;
use twinrig::runtime::interrupt::Token;

use super::{SEEDS, STAND, Sweep};
use crate::hardware::wait_until;

/// Sixty runs.
const MANY: &str = "[[dimension]]\nkey = 'seed'\nfrom = 1\nto = 60\n\
                    [[share]]\nof = 'stands'\nmin = 0.5\n";

impl Sweep {
    /// Starts the program, so that it can be killed.
    fn start(&self, out: &str, more: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_twin"))
            .args(["sweep", &self.scenario, &self.spec, "--out"])
            .arg(self.folder.join(out))
            .args(more)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    }

    /// Number of bytes in the store.
    fn stored(&self, out: &str) -> u64 {
        let path = self.folder.join(&format!("{out}/rows/all.jsonl"));
        std::fs::metadata(path).map_or(0, |metadata| metadata.len())
    }
}

/// Killed at instants chosen at random and in the middle of its runs, it continues and gives the
/// same files, byte for byte.
#[test]
fn killed_sweep_continues_with_the_same_results() {
    let sweep = Sweep::new("killed", STAND, MANY);
    let whole = sweep.start("whole", &[]).wait().unwrap();
    assert_eq!(whole.code(), Some(0));
    let end = sweep.stored("whole");
    let mut numbers = stream(1, "kill");
    let mut interrupted = 0;
    for part in 1..=4 {
        let mut child = sweep.start("parts", &["--jobs", "2"]);
        // Once a further part is stored, after a random part of the time of a run.
        wait_until("runs are stored", || {
            sweep.stored("parts") > end * (part - 1) / 5 || child.try_wait().unwrap().is_some()
        });
        sleep(Duration::from_micros(numbers.between(0, 20_000)));
        child.kill().unwrap();
        child.wait().unwrap();
        interrupted += u64::from(sweep.stored("parts") < end);
    }
    assert!(interrupted >= 2, "{interrupted}");
    let ended = sweep.start("parts", &[]).wait().unwrap();
    assert_eq!(ended.code(), Some(0));
    assert_eq!(sweep.files("parts"), sweep.files("whole"));
}

#[test]
fn signal_ends_the_sweep_which_the_same_command_continues() {
    let sweep = Sweep::new("signal", STAND, &MANY.replace("60", "600"));
    let mut child = sweep.start("out", &[]);
    wait_until("runs are stored", || sweep.stored("out") > 0);
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success());
    assert_eq!(child.wait().unwrap().code(), Some(2));
    assert!(!std::fs::exists(sweep.folder.join("out/rows.csv")).unwrap());
    assert_eq!(sweep.start("out", &[]).wait().unwrap().code(), Some(0));
    let rows = &sweep.files("out")[0];
    assert_eq!(rows.lines().count(), 601);
}

/// As of a host program with several users: the token of the calling thread.
#[test]
fn token_of_the_caller_interrupts_the_sweep() {
    let sweep = Sweep::new("token", STAND, SEEDS);
    let token = Token::new();
    token.request();
    let result = token.scope(|| sweep.json(2, "out", &[]));
    assert_eq!(result["verdict"], "interrupted");
    assert_eq!(result["counts"]["missing"], 12);
    assert!(result["hash"].is_null());
    let error = result["error"].as_str().unwrap();
    assert!(error.contains("the same command continues"), "{error}");
    assert_eq!(sweep.json(0, "out", &[])["verdict"], "pass");
}

#[test]
fn partitions_together_are_the_whole() {
    let sweep = Sweep::new("partitions", STAND, SEEDS);
    let whole = sweep.json(0, "whole", &[]);
    let partition = |code, part: &str| sweep.json(code, "parts", &["--partition", part]);
    let first = partition(0, "1/3");
    assert_eq!(first["verdict"], "partial");
    assert_eq!(first["counts"]["missing"], 8);
    let indices: Vec<u64> = first["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["index"].as_u64().unwrap())
        .collect();
    assert_eq!(indices, [0, 3, 6, 9]);
    partition(0, "3/3");
    assert!(!std::fs::exists(sweep.folder.join("parts/rows.csv")).unwrap());
    // The last one has the result of all.
    let last = partition(0, "2/3");
    assert_eq!(last, whole);
    assert_eq!(sweep.files("parts"), sweep.files("whole"));
    // A call without partitions merges, and runs nothing.
    let merged = sweep.run("parts", &[]);
    assert!(merged.out.contains("12 of earlier calls"), "{}", merged.out);
    assert_eq!(sweep.files("parts"), sweep.files("whole"));
}

#[test]
fn damaged_row_is_run_again() {
    let sweep = Sweep::new("damaged", STAND, SEEDS);
    sweep.json(0, "out", &[]);
    let files = sweep.files("out");
    let path = sweep.folder.join("out/rows/all.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    // A verdict that no run has.
    let forged = text.replacen("\"pass\"", "\"fail\"", 1);
    std::fs::write(&path, forged).unwrap();
    let done = sweep.run("out", &[]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.err.contains("1 damaged line in"), "{}", done.err);
    assert!(done.out.contains("11 of earlier calls"), "{}", done.out);
    assert_eq!(sweep.files("out"), files);
    // The line stays, and no longer matters.
    assert_eq!(sweep.run("out", &[]).err, "");
}
