//! A worker in a process of its own, and the frames of its pipes.
#![expect(
    clippy::disallowed_methods,
    reason = "the limit of a call that does not return; no result depends on it"
)]

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use pyo3::prelude::*;
use twinrig::kernel::SimDuration;
use twinrig::runtime::interrupt;

use crate::exceptions::Exceptions;
use crate::fmu::failure::Failure;
use crate::fork::Generation;
use crate::interpreter::Interpreter;

/// Wall time between two checks for a request to end, while a reply is awaited.
const PATIENCE: Duration = Duration::from_millis(50);

/// Wall time that a worker has for ending its FMU.
const FAREWELL: Duration = Duration::from_secs(2);

/// Kept end of the output of an FMU \[bytes\].
const OUTPUT_MAX: usize = 1000;

/// Size of the head of a frame: a byte with the kind or the status, four with the size.
const HEAD: usize = 5;

/// A process that serves one worker. It does not outlive this value, nor this process.
pub(super) struct Process {
    child: Child,
    requests: Option<ChildStdin>,
    replies: ChildStdout,
    errors: ChildStderr,
    output: Output,
    /// Failure after which the process is not asked any more.
    ended: Option<Failure>,
    generation: Generation,
    exceptions: Exceptions,
}

impl Process {
    /// Starts a worker in `folder`, in which it also runs.
    pub fn start(
        interpreter: &Interpreter,
        folder: &Path,
        exceptions: &Exceptions,
    ) -> Result<Self, Failure> {
        let started = interpreter
            .module("twinrig._fmu")
            .arg(folder)
            .current_dir(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C is a matter of this process.
            .process_group(0)
            .spawn();
        let mut child = started.map_err(|error| Failure::io("cannot be started", &error))?;
        let no_pipe = || Failure::Worker("has no pipes".to_owned());
        Ok(Self {
            requests: child.stdin.take(),
            replies: child.stdout.take().ok_or_else(no_pipe)?,
            errors: child.stderr.take().ok_or_else(no_pipe)?,
            child,
            output: Output::default(),
            ended: None,
            generation: Generation::current(),
            exceptions: exceptions.clone(),
        })
    }

    /// Sends a request and returns status and content of the reply.
    pub fn call(
        &mut self,
        kind: u8,
        payload: &[u8],
        limit: Duration,
    ) -> Result<(u8, Vec<u8>), Failure> {
        if let Some(failure) = &self.ended {
            return Err(failure.clone());
        }
        let answered = self.send(kind, payload);
        let answered = answered.and_then(|()| self.reply(limit));
        answered.inspect_err(|failure| {
            self.ended = Some(failure.clone());
            self.kill();
        })
    }

    /// Returns the last output and log messages of the FMU, as the end of a sentence.
    pub fn output(&mut self) -> String {
        self.output.read_to_end(&mut self.errors, Duration::ZERO);
        self.output.text()
    }

    fn send(&mut self, kind: u8, payload: &[u8]) -> Result<(), Failure> {
        let too_long = || Failure::Worker("cannot take more than 4 GiB".to_owned());
        let size = u32::try_from(payload.len()).map_err(|_| too_long())?;
        let mut frame = Vec::with_capacity(HEAD + payload.len());
        frame.push(kind);
        frame.extend_from_slice(&size.to_le_bytes());
        frame.extend_from_slice(payload);
        let written = match &mut self.requests {
            Some(requests) => requests.write_all(&frame),
            None => Err(ErrorKind::BrokenPipe.into()),
        };
        match written {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(self.death()),
            written => written.map_err(|error| Failure::io("cannot be reached", &error)),
        }
    }

    fn reply(&mut self, limit: Duration) -> Result<(u8, Vec<u8>), Failure> {
        let deadline = Instant::now() + limit;
        let mut head = [0; HEAD];
        self.read(&mut head, deadline, limit)?;
        let [status, size @ ..] = head;
        let mut content = vec![0; u32::from_le_bytes(size) as usize];
        self.read(&mut content, deadline, limit)?;
        Ok((status, content))
    }

    /// Reads exactly as many bytes as `buffer` has, and the output of the FMU meanwhile.
    fn read(
        &mut self,
        buffer: &mut [u8],
        deadline: Instant,
        limit: Duration,
    ) -> Result<(), Failure> {
        let mut filled = 0;
        let mut last_check = Instant::now();
        while filled < buffer.len() {
            let now = Instant::now();
            let left = deadline.saturating_duration_since(now);
            if left.is_zero() {
                let output = self.output.text();
                let limit = u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX);
                let limit = SimDuration::from_nanos(limit);
                return Err(Failure::Late { limit, output });
            }
            if now - last_check >= PATIENCE {
                last_check = now;
                if self.is_interrupted() {
                    return Err(Failure::Interrupted);
                }
            }
            let (reply, output) = self.wait(left.min(PATIENCE))?;
            if output {
                self.output.read(&mut self.errors);
            }
            if reply {
                match self.replies.read(&mut buffer[filled..]) {
                    Ok(0) => return Err(self.death()),
                    Ok(count) => filled += count,
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(error) => return Err(Failure::io("cannot be read", &error)),
                }
            }
        }
        Ok(())
    }

    /// Waits until a reply or output can be read; returns which.
    fn wait(&self, patience: Duration) -> Result<(bool, bool), Failure> {
        let polled = |fd| PollFd::new(fd, PollFlags::POLLIN);
        let mut both = [polled(self.replies.as_fd()), polled(self.errors.as_fd())];
        // After its end, the output would be ready for ever.
        let open = if self.output.is_closed { 1 } else { 2 };
        let timeout = PollTimeout::try_from(patience).unwrap_or(PollTimeout::ZERO);
        match poll(&mut both[..open], timeout) {
            Ok(_) | Err(nix::errno::Errno::EINTR) => {}
            Err(error) => return Err(Failure::io("cannot be awaited", &error.into())),
        }
        let ready = |fd: &PollFd<'_>| fd.any().unwrap_or(false);
        Ok((ready(&both[0]), open == 2 && ready(&both[1])))
    }

    /// Returns whether the end of the work is requested, also by a handler of Python's signals.
    fn is_interrupted(&self) -> bool {
        let raised = Python::attach(|py| {
            let checked = py.check_signals();
            checked.map_err(|raised| self.exceptions.keep(py, raised))
        });
        raised.is_err() || interrupt::is_requested()
    }

    /// Returns the failure of a process that has closed its pipes.
    fn death(&mut self) -> Failure {
        self.output.read_to_end(&mut self.errors, FAREWELL);
        let how = match self.wait_for_end(FAREWELL) {
            Some(status) => ended_by(status),
            None => "closed its pipes".to_owned(),
        };
        let output = self.output.text();
        Failure::Ended { how, output }
    }

    fn wait_for_end(&mut self, patience: Duration) -> Option<ExitStatus> {
        let deadline = Instant::now() + patience;
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Some(status),
                Ok(None) if Instant::now() < deadline => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(None) | Err(_) => return None,
            }
        }
    }

    fn kill(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // A fork has not started it.
        if self.generation.is_past() {
            return;
        }
        // At the end of its input the worker ends the FMU.
        self.requests = None;
        if self.ended.is_none() {
            let deadline = Instant::now() + FAREWELL;
            self.output.read_to_end(&mut self.errors, FAREWELL);
            self.wait_for_end(deadline.saturating_duration_since(Instant::now()));
        }
        self.kill();
    }
}

fn ended_by(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => {
            let name = nix::sys::signal::Signal::try_from(signal);
            let name = name.map_or_else(|_| format!("signal {signal}"), |name| name.to_string());
            format!("was ended by {name}")
        }
        (None, Some(code)) => format!("ended itself with exit code {code}"),
        (None, None) => "ended".to_owned(),
    }
}

/// End of the output and log messages of an FMU.
#[derive(Default)]
struct Output {
    bytes: VecDeque<u8>,
    is_closed: bool,
}

impl Output {
    /// Reads the available bytes.
    fn read(&mut self, errors: &mut ChildStderr) {
        let mut buffer = [0; 4096];
        match errors.read(&mut buffer) {
            Ok(count @ 1..) => {
                self.bytes.extend(&buffer[..count]);
                let excess = self.bytes.len().saturating_sub(OUTPUT_MAX);
                self.bytes.drain(..excess);
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Ok(_) | Err(_) => self.is_closed = true,
        }
    }

    /// Reads up to the end, but no longer than `patience`.
    fn read_to_end(&mut self, errors: &mut ChildStderr, patience: Duration) {
        let deadline = Instant::now() + patience;
        while !self.is_closed {
            let left = deadline.saturating_duration_since(Instant::now());
            let timeout = PollTimeout::try_from(left).unwrap_or(PollTimeout::ZERO);
            let polled = poll(
                &mut [PollFd::new(errors.as_fd(), PollFlags::POLLIN)],
                timeout,
            );
            match polled {
                Ok(1..) => self.read(errors),
                Err(nix::errno::Errno::EINTR) => {}
                Ok(_) | Err(_) => return,
            }
        }
    }

    /// Returns the text in one line, as the end of a sentence.
    fn text(&self) -> String {
        let bytes: Vec<u8> = self.bytes.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let lines: Vec<&str> = lines.collect();
        if lines.is_empty() {
            return String::new();
        }
        format!("; its last output: {}", lines.join(" | "))
    }
}
