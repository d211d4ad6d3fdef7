//! Real time: a controller at a port, and a twin at the other end of it, each a process of its own. The machines that run
//! this are slow and busy, so nothing is asserted of how long anything takes, but that it ends.

mod commands;
mod ending;
mod exchange;
mod flood;
mod judging;
mod trace;
mod unplugging;

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{Folder, json};

/// A bus of four boards with a robot on its stand, for a controller that knows beforehand what it wants. Commands differ from
/// step to step, and errors end nothing.
pub const BENCH: &str = r#"
name = "bench"
robot = "oncilla"
duration = "1 s"
seed = 1
plant = { model = "drives", base = "fixed" }
actuator = { kind = "motor" }
bus = { kind = "sbcp", error_threshold = -1 }
record = { bytes = true, frames = "0 Hz" }

[controller]
kind = "script"
period = "2 ms"
shape = { hip = "triangle", knee = "sine" }
amplitude = { hip = "0.5 rad", knee = "0.3 rad" }
offset = { knee = "0.6 rad" }
frequency = { hip = "0.11 Hz", knee = "1.3 Hz" }
"#;

/// The same, longer than anybody waits.
pub fn endless(folder: &Folder) -> String {
    folder.file("endless.toml", &BENCH.replace("1 s", "1000000 s"))
}

/// So long nothing takes that is not hung.
pub const HUNG: Duration = Duration::from_secs(60);

/// A program that runs, and is killed with the test.
pub struct Running {
    child: Child,
    out: String,
    err: String,
}

/// How runs end on a machine that is too busy: boards do not answer in time while they are made ready, or the system does not
/// pass on what is written to a PTY. Linux does so on a thread of its own without any priority, and lets even one of the
/// highest that looks whether there is anything to read wait for it, for seconds if others keep both processors.
const LATE: [&str; 6] = [
    "does not answer",
    "while it was made ready",
    "did not end its calibration",
    "took more than",
    "took no more bytes",
    "it is still at it",
];

/// How it ended.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Running {
    /// Starts `twin` with `words`; what it prints goes to files in `folder` that begin with `name`.
    pub fn twin(folder: &Folder, name: &str, words: &[&str]) -> Self {
        let (out, err) = (
            folder.join(&format!("{name}.out")),
            folder.join(&format!("{name}.err")),
        );
        let child = Command::new(env!("CARGO_BIN_EXE_twin"))
            .args(words)
            .stdin(Stdio::null())
            .stdout(File::create(&out).unwrap())
            .stderr(File::create(&err).unwrap())
            .spawn()
            .unwrap();
        Self { child, out, err }
    }

    /// Starts `twin serve` with the bus `sbcp` at `link`, and waits until it is there.
    pub fn serve(folder: &Folder, scenario: &str, link: &str, words: &[&str]) -> Self {
        let pty = format!("sbcp={link}");
        let words = [&["serve", scenario, "--pty", &pty], words].concat();
        let mut served = Self::twin(folder, "serve", &words);
        eventually("the twin is served", || {
            served.prints().contains("now, elsewhere: ") || served.has_ended()
        });
        assert!(!served.has_ended(), "{:?}", served.end());
        served
    }

    /// Starts `twin run` at `port`, with recordings in `out` of `folder`.
    pub fn run(folder: &Folder, scenario: &str, port: &str, words: &[&str]) -> Self {
        let (port, out) = (format!("sbcp={port}"), folder.join("out"));
        let words = [&["run", scenario, "--port", &port, "--out", &out], words].concat();
        Self::twin(folder, "run", &words)
    }

    /// What it has printed by now.
    pub fn prints(&self) -> String {
        std::fs::read_to_string(&self.out).unwrap()
    }

    fn has_ended(&mut self) -> bool {
        self.child.try_wait().unwrap().is_some()
    }

    /// How much memory it has \[bytes\].
    pub fn memory(&self) -> u64 {
        let path = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(path).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kilobytes = line.unwrap().trim().trim_end_matches("kB").trim();
        kilobytes.parse::<u64>().unwrap() * 1024
    }

    /// Sends it a signal: `-INT`.
    pub fn signal(&self, signal: &str) {
        let id = self.child.id().to_string();
        let status = Command::new("kill").args([signal, &id]).status();
        assert!(status.unwrap().success());
    }

    /// Waits for its end.
    pub fn end(&mut self) -> Ended {
        eventually("the program ends", || self.has_ended());
        Ended {
            code: self.child.wait().unwrap().code(),
            out: self.prints(),
            err: std::fs::read_to_string(&self.err).unwrap(),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Ended {
    /// This, unless a machine that is too busy ended it, and not what was to: `expected`.
    pub fn in_time(self, expected: &str) -> Result<Self, Self> {
        let late = LATE.iter().any(|late| self.out.contains(late));
        let meant = !expected.is_empty() && self.out.contains(expected);
        if self.code == Some(2) && late && !meant {
            return Err(self);
        }
        Ok(self)
    }

    /// What `--json` printed.
    pub fn report(&self) -> serde_json::Value {
        assert!(!self.out.is_empty(), "{self:?}");
        json(&self.out).remove(0)
    }
}

/// Waits until `holds`, which it does before anything is called hung.
pub fn eventually(what: &str, mut holds: impl FnMut() -> bool) {
    let started = now();
    while !holds() {
        assert!(started.elapsed() < HUNG, "hung before {what}");
        sleep(Duration::from_millis(5));
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "tests of real time do not wait for ever"
)]
pub fn now() -> Instant {
    Instant::now()
}

/// A run that is well past opening, and the twin that it talks to.
pub struct Pair {
    pub served: Running,
    pub run: Running,
    /// Path of the recording.
    pub recording: String,
}

/// A run is well past opening when it has recorded so many bytes.
pub const WELL_RECORDED: u64 = 40_000;

impl Pair {
    /// Serves `scenario`, which is to be in a file `endless.toml`, at `link`, begins a run of it, and does `what` is to be
    /// done then: again, if the machine was too busy.
    pub fn under_way<T>(
        folder: &Folder,
        scenario: &str,
        link: &str,
        mut what: impl FnMut(Self) -> Result<T, Ended>,
    ) -> T {
        let recording = folder.join("out/endless-seed1.mcap");
        patiently(|| {
            let _ = std::fs::remove_file(&recording);
            let served = Running::serve(folder, scenario, link, &[]);
            let mut run = Running::run(folder, scenario, link, &["--json"]);
            eventually("it is recorded", || {
                is_longer(&recording, WELL_RECORDED) || run.has_ended()
            });
            if run.has_ended() {
                let ended = run.end().in_time("")?;
                panic!("it did not wait: {ended:?}");
            }
            let pair = Self {
                served,
                run,
                recording: recording.clone(),
            };
            what(pair)
        })
    }
}

/// Serves `scenario` at `link`, and runs it there to its end.
pub fn run_at_a_twin(folder: &Folder, scenario: &str, link: &str, words: &[&str]) -> [Ended; 2] {
    patiently(|| {
        let mut served = Running::serve(folder, scenario, link, &[]);
        let run = Running::run(folder, scenario, link, words).end();
        Ok([run.in_time("")?, served.end()])
    })
}

/// Tries again where the machine was too busy, but not at the same time as another test.
pub fn patiently<T>(mut attempt: impl FnMut() -> Result<T, Ended>) -> T {
    static ALONE: Mutex<()> = Mutex::new(());
    for attempts in 1..=20 {
        // One that failed leaves nothing behind that matters.
        let standalone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        match attempt() {
            Ok(done) => return done,
            Err(ended) => println!("too late: {ended:?}"),
        }
        drop(standalone);
        sleep(Duration::from_millis(100) * attempts);
    }
    panic!("this machine is too busy to get boards ready");
}

pub fn is_longer(path: &str, bytes: u64) -> bool {
    Path::new(path)
        .metadata()
        .is_ok_and(|file| file.len() > bytes)
}
