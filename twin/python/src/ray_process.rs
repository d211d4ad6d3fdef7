//! Process of the Ray driver, and its frames (`_ray_frames.py` describes them).
#![expect(
    clippy::disallowed_methods,
    reason = "limits of wall time for another process; no result depends on them"
)]

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use pyo3::prelude::*;

use crate::interpreter::Interpreter;

/// Module of the driver.
const MODULE: &str = "twinrig._ray";
/// Time for the driver to leave the cluster, before it is killed.
const EXIT_LIMIT: Duration = Duration::from_secs(3);
/// Frames that wait for the observer.
const QUEUE: usize = 1024;
/// Lines of the driver's standard error that are kept.
const LINES: usize = 20;
/// Greatest length of a frame, against a stream that is none.
const FRAME_BYTES: u32 = 1 << 30;

/// Frame of the driver.
pub(crate) struct Frame {
    pub(crate) kind: u8,
    /// Number of the task.
    pub(crate) task: usize,
    pub(crate) contents: Vec<u8>,
}

/// Message of a process.
pub(crate) enum Next {
    Frame(Frame),
    /// Nothing in the time allowed.
    Silence,
    /// It has closed its output.
    End,
}

/// A running driver; it ends with this value.
pub(crate) struct DriverProcess {
    child: Child,
    frames: Receiver<Frame>,
    /// Its end closes the standard input.
    stop: Option<Sender<()>>,
    lines: Arc<Mutex<VecDeque<String>>>,
    heard: Instant,
}

impl DriverProcess {
    /// Starts the driver with frames for its standard input.
    pub(crate) fn start(input: Vec<Vec<u8>>) -> std::io::Result<Self> {
        let mut child = Python::attach(command)
            .map_err(|error| std::io::Error::other(error.to_string()))?
            .spawn()?;
        let (stop, stopped) = channel();
        let (sender, frames) = sync_channel(QUEUE);
        let lines = Arc::default();
        if let Some(stdin) = child.stdin.take() {
            thread("ray input", move || write_frames(stdin, &input, &stopped))?;
        }
        if let Some(stdout) = child.stdout.take() {
            thread("ray frames", move || {
                let mut stdout = BufReader::new(stdout);
                while let Some(frame) = read_frame(&mut stdout) {
                    if sender.send(frame).is_err() {
                        break;
                    }
                }
            })?;
        }
        if let Some(stderr) = child.stderr.take() {
            let lines = Arc::clone(&lines);
            thread("ray errors", move || keep_lines(stderr, &lines))?;
        }
        Ok(Self {
            child,
            frames,
            stop: Some(stop),
            lines,
            heard: Instant::now(),
        })
    }

    /// Returns the next frame, waiting for it for a time.
    pub(crate) fn next(&mut self, wait: Duration) -> Next {
        match self.frames.recv_timeout(wait) {
            Ok(frame) => {
                self.heard = Instant::now();
                Next::Frame(frame)
            }
            Err(RecvTimeoutError::Timeout) => Next::Silence,
            Err(RecvTimeoutError::Disconnected) => Next::End,
        }
    }

    /// Returns the time since the last frame.
    pub(crate) fn silent_for(&self) -> Duration {
        self.heard.elapsed()
    }

    /// Returns whether one of the last lines of its standard error has this word.
    pub(crate) fn reports(&self, word: &str) -> bool {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.iter().any(|line| line.contains(word))
    }

    /// Ends the process; returns its status and the last lines of its standard error.
    pub(crate) fn end(&mut self) -> (Option<ExitStatus>, Vec<String>) {
        self.stop = None;
        let asked = Instant::now();
        let mut status = None;
        while status.is_none() && asked.elapsed() < EXIT_LIMIT {
            status = self.child.try_wait().ok().flatten();
            // It may wait for room in the pipe.
            let _ = self.frames.recv_timeout(Duration::from_millis(10));
        }
        if status.is_none() {
            // It may have ended meanwhile.
            let _ = self.child.kill();
            status = self.child.wait().ok();
        }
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        (status, lines.iter().cloned().collect())
    }
}

impl Drop for DriverProcess {
    fn drop(&mut self) {
        self.end();
    }
}

/// Returns the command: this interpreter with this package, in a process group of its own, so that
/// Ctrl-C reaches the program alone.
fn command(py: Python<'_>) -> PyResult<Command> {
    let mut command = Interpreter::current(py)?.module(MODULE);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0);
    for (name, value) in ENVIRONMENT {
        if std::env::var_os(name).is_none() {
            command.env(name, value);
        }
    }
    Ok(command)
}

/// Variables of the driver, unless the user has set them: no telemetry, and an end of the process
/// soon after the loss of the cluster.
const ENVIRONMENT: [(&str, &str); 3] = [
    ("RAY_USAGE_STATS_ENABLED", "0"),
    ("RAY_gcs_rpc_server_reconnect_timeout_s", "20"),
    ("RAY_DEDUP_LOGS", "0"),
];

fn thread(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    Builder::new().name(name.to_owned()).spawn(work).map(drop)
}

/// Writes the frames, and keeps the stream open until `stopped` has no sender.
fn write_frames(stdin: ChildStdin, frames: &[Vec<u8>], stopped: &Receiver<()>) {
    let mut stream = std::io::BufWriter::new(stdin);
    let written = frames.iter().try_for_each(|frame| {
        stream.write_all(&(frame.len() as u64).to_le_bytes())?;
        stream.write_all(frame)
    });
    // A process that does not read has ended, which its output shows.
    if written.and_then(|()| stream.flush()).is_ok() {
        let _ = stopped.recv();
    }
}

/// Reads a frame; none at the end of the stream.
fn read_frame(stream: &mut BufReader<ChildStdout>) -> Option<Frame> {
    let mut head = [0; 9];
    stream.read_exact(&mut head).ok()?;
    let [kind, numbers @ ..] = head;
    let (task, length) = numbers.split_at(4);
    let number = |bytes: &[u8]| Some(u32::from_le_bytes(bytes.try_into().ok()?));
    let length = number(length).filter(|length| *length <= FRAME_BYTES)?;
    let mut contents = vec![0; usize::try_from(length).ok()?];
    stream.read_exact(&mut contents).ok()?;
    Some(Frame {
        kind,
        task: usize::try_from(number(task)?).ok()?,
        contents,
    })
}

/// Keeps the last lines of a stream.
fn keep_lines(stream: ChildStderr, lines: &Mutex<VecDeque<String>>) {
    for line in BufReader::new(stream).split(b'\n').map_while(Result::ok) {
        let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() == LINES {
            lines.pop_front();
        }
        lines.push_back(String::from_utf8_lossy(&line).into_owned());
    }
}
