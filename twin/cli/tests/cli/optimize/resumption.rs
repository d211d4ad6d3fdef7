use std::fs::OpenOptions;
use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use twinrig::kernel::stream;
use twinrig::runtime::interrupt::Token;

use super::{Optimization, SPACE, WALK};
use crate::hardware::wait_until;

impl Optimization {
    /// Starts the program, so that it can be killed.
    fn start(&self, out: &str, more: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_twin"))
            .args(["optimize", &self.scenario, "--space", &self.space, "--out"])
            .arg(self.folder.join(out))
            .args(more)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    }

    fn rows(&self, out: &str) -> String {
        self.folder.join(&format!("{out}/rows/all.jsonl"))
    }

    /// Number of bytes of the rows.
    fn stored(&self, out: &str) -> u64 {
        std::fs::metadata(self.rows(out)).map_or(0, |metadata| metadata.len())
    }
}

/// Killed at instants chosen at random, in the midst of generations, and once with a torn row, it
/// continues and gives the same files, byte for byte.
#[test]
fn killed_optimisation_continues_with_the_same_answer() {
    let optimization = Optimization::new("killed", WALK, SPACE);
    let whole = optimization
        .start("whole", &["--jobs", "1"])
        .wait()
        .unwrap();
    assert_eq!(whole.code(), Some(0));
    let end = optimization.stored("whole");
    let mut numbers = stream(1, "kill");
    let mut interrupted = 0;
    for part in 1..=4 {
        let jobs = part.to_string();
        let mut child = optimization.start("parts", &["--jobs", &jobs]);
        // Once a further part is stored, after a random part of the time of a run.
        wait_until("runs are stored", || {
            optimization.stored("parts") > end * (part - 1) / 5
                || child.try_wait().unwrap().is_some()
        });
        sleep(Duration::from_micros(numbers.between(0, 20_000)));
        child.kill().unwrap();
        child.wait().unwrap();
        interrupted += u64::from(optimization.stored("parts") < end);
        if part == 2 {
            let path = optimization.rows("parts");
            let mut file = OpenOptions::new().append(true).open(path).unwrap();
            file.write_all(b"{\"check\":\"0123").unwrap();
        }
    }
    assert!(interrupted >= 2, "{interrupted}");
    let ended = optimization.start("parts", &[]).wait().unwrap();
    assert_eq!(ended.code(), Some(0));
    assert_eq!(optimization.files("parts"), optimization.files("whole"));
}

#[test]
fn signal_ends_the_optimisation_which_the_same_command_continues() {
    let optimization = Optimization::new("signal", WALK, &SPACE.replace("= 4", "= 12"));
    let mut child = optimization.start("out", &[]);
    wait_until("runs are stored", || optimization.stored("out") > 0);
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success());
    assert_eq!(child.wait().unwrap().code(), Some(2));
    assert!(!std::fs::exists(optimization.folder.join("out/best.toml")).unwrap());
    // The rows that are there are used.
    let before = optimization.stored("out");
    assert_eq!(
        optimization.start("out", &[]).wait().unwrap().code(),
        Some(0)
    );
    assert!(optimization.stored("out") > before);
}

/// As of a host program with several users: the token of the calling thread.
#[test]
fn token_of_the_caller_interrupts_the_optimisation() {
    let optimization = Optimization::new("token", WALK, SPACE);
    let token = Token::new();
    token.request();
    let done = token.scope(|| optimization.run("out", &[]));
    assert_eq!(done.code, 2);
    let expected = "INTERRUPTED  the same command continues";
    assert!(done.out.contains(expected), "{}", done.out);
    assert_eq!(optimization.run("out", &[]).code, 0);
}

/// A forged row is not used: its run is repeated.
#[test]
fn damaged_row_is_run_again() {
    let optimization = Optimization::new("damaged", WALK, SPACE);
    optimization.json(0, "out", &[]);
    let files = optimization.files("out");
    let path = optimization.rows("out");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(
        &path,
        text.replacen("\"measured\":0.", "\"measured\":9.", 1),
    )
    .unwrap();
    let done = optimization.run("out", &[]);
    assert!(done.err.contains("1 damaged line in"), "{}", done.err);
    assert!(done.out.contains("1 run in"), "{}", done.out);
    assert_eq!(optimization.files("out"), files);
}
