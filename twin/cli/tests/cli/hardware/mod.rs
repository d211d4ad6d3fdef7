//! Real-time runs: a controller on a port and a served twin at its other end, as separate
//! processes. Durations are not asserted, because the test machines may be slow and busy; only
//! termination is.

mod commands;
mod first_contact;
mod flood;
mod judging;
mod lockstep;
mod network;
mod servos;
mod termination;
mod trace;
mod unplugging;

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{Folder, json};

/// Scenario of a robot on a test stand with a bus of four boards and an open-loop controller.
/// Commands differ from step to step, and bus errors do not end the run.
pub const STAND: &str = r#"
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

/// Writes the scenario [`STAND`] with an unlimited duration.
pub fn endless(folder: &Folder) -> String {
    folder.file("endless.toml", &STAND.replace("1 s", "1000000 s"))
}

/// Time after which a test is considered hung.
pub const TIMEOUT: Duration = Duration::from_secs(60);

/// Running program, killed on drop.
pub struct Running {
    child: Child,
    out: String,
    err: String,
}

/// Errors of runs on an overloaded machine: boards do not respond in time during initialisation, or
/// the system delays bytes written to a PTY. Linux forwards them on a separate thread without
/// real-time priority; even a reader of the highest priority waits for it, for seconds if other
/// processes occupy both processors.
const OVERLOAD_ERRORS: [&str; 6] = [
    "does not answer",
    "failed during initialisation",
    "did not end its calibration",
    "took more than",
    "took no more bytes",
    "it is still running",
];

/// Exit code and output of a terminated program.
#[derive(Debug)]
pub struct EndReason {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Running {
    /// Starts `twin` with the arguments `words`; its output is written to files in `folder` that
    /// begin with `name`.
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

    /// Starts `twin serve` with the bus `sbcp` at `place`, a link or an address, and waits until it
    /// is ready.
    pub fn serve(folder: &Folder, scenario: &str, place: &str, words: &[&str]) -> Self {
        Self::serve_bus(folder, scenario, "sbcp", place, words)
    }

    /// Does the same with a bus of that name.
    pub fn serve_bus(
        folder: &Folder,
        scenario: &str,
        bus: &str,
        place: &str,
        words: &[&str],
    ) -> Self {
        let is_address = place.contains("://");
        let option = if is_address { "--listen" } else { "--pty" };
        let place = format!("{bus}={place}");
        let words = [&["serve", scenario, option, &place], words].concat();
        let mut served = Self::twin(folder, "serve", &words);
        wait_until("the twin is served", || {
            served.prints().contains("connect with: ") || served.has_ended()
        });
        assert!(!served.has_ended(), "{:?}", served.end());
        served
    }

    /// Starts `twin run` at `port` with recordings in the subfolder `out`.
    pub fn run(folder: &Folder, scenario: &str, port: &str, words: &[&str]) -> Self {
        let (port, out) = (format!("sbcp={port}"), folder.join("out"));
        let words = [&["run", scenario, "--port", &port, "--out", &out], words].concat();
        Self::twin(folder, "run", &words)
    }

    /// Returns the output so far.
    pub fn prints(&self) -> String {
        std::fs::read_to_string(&self.out).unwrap()
    }

    /// Returns the place at which `twin serve` serves the bus `sbcp`.
    pub fn place(&self) -> String {
        let out = self.prints();
        let place = out.lines().find_map(|line| line.strip_prefix("sbcp at "));
        place.unwrap().to_owned()
    }

    fn has_ended(&mut self) -> bool {
        self.child.try_wait().unwrap().is_some()
    }

    /// Returns the resident memory \[bytes\].
    pub fn memory(&self) -> u64 {
        let path = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(path).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kilobytes = line.unwrap().trim().trim_end_matches("kB").trim();
        kilobytes.parse::<u64>().unwrap() * 1024
    }

    /// Sends a signal, such as `-INT`.
    pub fn signal(&self, signal: &str) {
        let id = self.child.id().to_string();
        let status = Command::new("kill").args([signal, &id]).status();
        assert!(status.unwrap().success());
    }

    /// Waits for the termination.
    pub fn end(&mut self) -> EndReason {
        wait_until("the program ends", || self.has_ended());
        EndReason {
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

impl EndReason {
    /// Returns an error if the program ended because of an overloaded machine instead of the
    /// `expected` error.
    pub fn in_time(self, expected: &str) -> Result<Self, Self> {
        let is_late = OVERLOAD_ERRORS.iter().any(|late| self.out.contains(late));
        let is_expected = !expected.is_empty() && self.out.contains(expected);
        if self.code == Some(2) && is_late && !is_expected {
            return Err(self);
        }
        Ok(self)
    }

    /// Returns the report printed by `--json`.
    pub fn report(&self) -> serde_json::Value {
        assert!(!self.out.is_empty(), "{self:?}");
        json(&self.out).remove(0)
    }
}

/// Waits until `holds` returns true; panics after [`TIMEOUT`].
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let started = now();
    while !holds() {
        assert!(started.elapsed() < TIMEOUT, "hung before {what}");
        sleep(Duration::from_millis(5));
    }
}

#[expect(clippy::disallowed_methods, reason = "timeout of real-time tests")]
pub fn now() -> Instant {
    Instant::now()
}

/// Run under way, and the served twin that it is connected to.
pub struct Pair {
    pub served: Running,
    pub run: Running,
    /// Path of the recording.
    pub recording: String,
}

/// Size of the recording of a run under way, past the initialisation of the boards \[bytes\].
pub const WELL_RECORDED: u64 = 40_000;

impl Pair {
    /// Serves `scenario`, whose file must be named `endless.toml`, at `link`, starts a run of it
    /// and calls `action` when it is under way. Repeated if the machine was overloaded.
    pub fn under_way<T>(
        folder: &Folder,
        scenario: &str,
        link: &str,
        mut action: impl FnMut(Self) -> Result<T, EndReason>,
    ) -> T {
        let recording = folder.join("out/endless-seed1.mcap");
        with_retries(|| {
            let _ = std::fs::remove_file(&recording);
            let served = Running::serve(folder, scenario, link, &[]);
            let mut run = Running::run(folder, scenario, link, &["--json"]);
            wait_until("it is recorded", || {
                is_longer(&recording, WELL_RECORDED) || run.has_ended()
            });
            if run.has_ended() {
                let ended = run.end().in_time("")?;
                panic!("it ended early: {ended:?}");
            }
            let pair = Self {
                served,
                run,
                recording: recording.clone(),
            };
            action(pair)
        })
    }
}

/// Serves `scenario` at `link` and runs it there to its end.
pub fn run_on_twin(folder: &Folder, scenario: &str, link: &str, words: &[&str]) -> [EndReason; 2] {
    with_retries(|| {
        let mut served = Running::serve(folder, scenario, link, &[]);
        let run = Running::run(folder, scenario, link, words).end();
        Ok([run.in_time("")?, served.end()])
    })
}

/// Repeats an attempt that failed because of an overloaded machine; attempts of different tests are
/// serialised.
pub fn with_retries<T>(mut attempt: impl FnMut() -> Result<T, EndReason>) -> T {
    static EXCLUSIVE: Mutex<()> = Mutex::new(());
    for attempts in 1..=20 {
        // A failed attempt leaves no relevant state.
        let guard = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
        match attempt() {
            Ok(done) => return done,
            Err(ended) => println!("too late: {ended:?}"),
        }
        drop(guard);
        sleep(Duration::from_millis(100) * attempts);
    }
    panic!("this machine is too busy to initialise the boards");
}

/// Returns whether a line is unobserved because the bus was late or silent for a time, as on an
/// overloaded machine.
pub fn bus_was_late(line: &serde_json::Value) -> bool {
    let detail = line["detail"].as_str().unwrap_or_default();
    line["verdict"] == "unobserved"
        && (detail.contains(" silent for ") || detail.ends_with(" were not in time"))
}

pub fn is_longer(path: &str, bytes: u64) -> bool {
    Path::new(path)
        .metadata()
        .is_ok_and(|file| file.len() > bytes)
}
