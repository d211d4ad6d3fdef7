//! Engine `ray`: the workers of a Ray cluster.
//!
//! Ray's driver is a process of its own (`_ray.py`): Ray ends the process of a driver that loses
//! its cluster, and this program has to report that and keep its rows.
//!
//! Frames of results come from that process by a pipe. A loss of a worker is not a property of a
//! run and never a row: the tasks of its batch are repeated singly (`_ray_batches.py`), and a task
//! that outlives several workers is reported as lost. Workers load the package from a wheel in the
//! object store. Ray's own way, `py_modules`, installs wheels by the `pip` on the path, keeps them
//! by name without regard to their contents, and two nodes on one machine install into one folder
//! at the same time.

use std::time::Duration;

use serde_json::{Value, json};
use twinrig::campaign::engine::{
    Engine, EngineError, EngineEvent, EngineOptions, EngineStatus, Job,
};

use crate::ray_process::{DriverProcess, Frame, Next};

/// Greatest time between two calls of the observer.
const UPDATE: Duration = Duration::from_millis(100);
/// Time to start a Ray, or to connect to one and send it the package.
const START_LIMIT: Duration = Duration::from_secs(180);
/// Time without a frame, after which the cluster is lost; the driver has one every second.
const SILENCE_LIMIT: Duration = Duration::from_secs(45);

/// Remedy after a loss.
const REPEAT: &str = "all rows up to now are kept: the same command continues, on another cluster or by the engine local";

/// Remedy where there is no cluster.
const START: &str =
    "start one by `ray start --head`, or leave out the address for a Ray of its own";

/// Word of Ray's log about a connection without the token of the cluster. Ray itself tries again
/// for 20 s, then reports a failed connection.
const REFUSAL: &str = "Unauthenticated";
/// Remedy for it.
const TOKEN: &str = "set RAY_AUTH_MODE, and RAY_AUTH_TOKEN_PATH or RAY_AUTH_TOKEN, as on the head";

/// Ray, of the Python package of that name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayEngine;

impl RayEngine {
    const NAME: &'static str = "ray";
}

impl Engine for RayEngine {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn run(
        &self,
        job: &dyn Job,
        tasks: &[usize],
        options: &EngineOptions,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError> {
        let status = EngineStatus {
            machines: Some(0),
            ..EngineStatus::default()
        };
        if tasks.is_empty() {
            return Ok(status);
        }
        let header = json!({
            "address": options.address,
            "jobs": options.jobs,
            "tasks": tasks.len(),
        });
        let mut input = vec![header.to_string().into_bytes(), job.shared()];
        input.extend(tasks.iter().map(|&task| job.task(task)));
        let process = DriverProcess::start(input)
            .map_err(|error| failed(format!("the driver cannot be started: {error}"), REPEAT))?;
        let work = Work {
            tasks,
            status,
            is_connected: false,
            place: place(options),
        };
        work.follow(process, observer)
    }
}

/// Work of a driver.
struct Work<'w> {
    tasks: &'w [usize],
    status: EngineStatus,
    is_connected: bool,
    /// ` at ADDRESS`, if there is one.
    place: String,
}

/// Consequence of a frame.
enum Step {
    Event(EngineEvent),
    Done,
}

impl Work<'_> {
    /// Passes on what the driver reports, until it has done all tasks or the observer ends it.
    fn follow(
        mut self,
        mut process: DriverProcess,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError> {
        loop {
            let event = match process.next(UPDATE) {
                Next::Frame(frame) => match self.step(frame)? {
                    Step::Event(event) => event,
                    Step::Done => return Ok(self.status),
                },
                Next::Silence if process.silent_for() > self.limit() => {
                    let silent = format!("no answer for {} s", self.limit().as_secs());
                    return Err(failed(silent, REPEAT));
                }
                Next::Silence if !self.is_connected && process.reports(REFUSAL) => {
                    let refused = format!("the cluster{} refuses the token", self.place);
                    return Err(failed(refused, TOKEN));
                }
                Next::Silence => EngineEvent::Status(self.status),
                Next::End => {
                    let (status, lines) = process.end();
                    let status = status.map_or_else(String::new, |it| format!(" ({it})"));
                    let (message, help) = if self.is_connected {
                        ("the cluster is lost", REPEAT)
                    } else {
                        ("the cluster cannot be reached", START)
                    };
                    return Err(failed(
                        format!("{message}{status}: {}", shown(&lines)),
                        help,
                    ));
                }
            };
            if !observer(event) {
                return Ok(self.status);
            }
        }
    }

    fn limit(&self) -> Duration {
        if self.is_connected {
            SILENCE_LIMIT
        } else {
            START_LIMIT
        }
    }

    fn step(&mut self, frame: Frame) -> Result<Step, EngineError> {
        let Frame {
            kind,
            task,
            contents,
        } = frame;
        let text = || String::from_utf8_lossy(&contents).into_owned();
        let damaged = || failed(format!("the driver's frame {kind} is damaged"), REPEAT);
        let task = || self.tasks.get(task).copied().ok_or_else(damaged);
        let event = match kind {
            b'R' => EngineEvent::Done {
                task: task()?,
                result: Ok(contents),
            },
            b'P' => EngineEvent::Done {
                task: task()?,
                result: Err(text()),
            },
            b'L' => EngineEvent::Lost {
                task: task()?,
                reason: text(),
            },
            b'S' => {
                let status = read_status(&contents).ok_or_else(damaged)?;
                (self.status, self.is_connected) = (status, true);
                EngineEvent::Status(status)
            }
            b'E' => {
                let error: Value = serde_json::from_slice(&contents).map_err(|_| damaged())?;
                let part = |name: &str| error[name].as_str().unwrap_or_default().to_owned();
                return Err(failed(part("message"), &part("help")));
            }
            b'D' => return Ok(Step::Done),
            _ => return Err(damaged()),
        };
        Ok(Step::Event(event))
    }
}

fn place(options: &EngineOptions) -> String {
    let address = options.address.clone();
    let address = address.or_else(|| std::env::var("RAY_ADDRESS").ok());
    address.map_or_else(String::new, |address| format!(" at `{address}`"))
}

fn failed(message: String, help: &str) -> EngineError {
    EngineError::Workers {
        engine: RayEngine::NAME,
        message,
        help: help.to_owned(),
    }
}

fn read_status(contents: &[u8]) -> Option<EngineStatus> {
    let status: Value = serde_json::from_slice(contents).ok()?;
    let number = |name: &str| usize::try_from(status[name].as_u64()?).ok();
    Some(EngineStatus {
        workers: number("workers")?,
        machines: Some(number("machines")?),
        repeated: number("repeated")?,
        waits_s: status["waits_s"].as_u64(),
    })
}

/// Returns the first sentence of the last line of the driver's standard error, without the place
/// that Ray puts before it: `[time E process thread] file:line: `.
fn shown(lines: &[String]) -> &str {
    let last = lines.iter().rev().find(|line| !line.trim().is_empty());
    let line = last.map_or("its driver has ended", String::as_str);
    let placed = line
        .strip_prefix('[')
        .and_then(|rest| rest.split_once("] "));
    let text = placed.and_then(|(_, rest)| rest.split_once(": "));
    let text = text.map_or(line, |(_, text)| text);
    text.split_once(". ").map_or(text, |(first, _)| first)
}
