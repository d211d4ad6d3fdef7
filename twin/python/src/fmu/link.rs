//! Link to the worker of an FMU: in a process of its own, or in this one.

use std::fs;
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::Deserialize;

use crate::exceptions::Exceptions;
use crate::fmu::failure::Failure;
use crate::fmu::folder::Folder;
use crate::fmu::process::Process;
use crate::fork::Generation;
use crate::interpreter::Interpreter;

/// File name of the archive, in the folder of a worker.
const ARCHIVE: &str = "model.fmu";

/// Kind of a request, as in `twinrig._fmu._worker`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request {
    Describe = 0,
    Start = 1,
    Advance = 2,
    Save = 3,
    Restore = 4,
}

/// Wall time for the start of an interpreter and for the extraction of an archive, beside the
/// limit of a call.
const PREPARATION: Duration = Duration::from_secs(20);

/// Statuses of replies.
const DONE: u8 = 0;
const REFUSED: u8 = 1;
const TERMINATED: u8 = 3;

/// Place of a worker, and the limit of its calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinkSettings {
    /// Whether the worker has a process of its own.
    pub isolated: bool,
    /// Limit of one call in wall time, of a process.
    pub time_limit: Duration,
}

enum Transport {
    Process(Box<Process>),
    Here(Object),
}

/// Link to one worker, which it ends on drop, with its folder.
pub(super) struct Link {
    // The worker ends before its folder is removed.
    transport: Transport,
    settings: LinkSettings,
    _folder: Folder,
}

/// Content of a reply with a failure.
#[derive(Deserialize)]
struct Failed {
    part: String,
    why: String,
}

impl Link {
    /// Starts a worker for an archive.
    pub fn start(
        settings: LinkSettings,
        archive: &[u8],
        exceptions: &Exceptions,
    ) -> Result<Self, Failure> {
        let folder = Folder::create();
        let folder = folder.map_err(|error| Failure::io("has no temporary folder", &error))?;
        let written = fs::write(folder.path().join(ARCHIVE), archive);
        written.map_err(|error| Failure::io("has no archive", &error))?;
        let transport = if settings.isolated {
            let interpreter = Python::attach(|py| {
                let found = Interpreter::current(py);
                found.map_err(|raised| failed_import(py, exceptions, raised))
            });
            let process = Process::start(&interpreter?, folder.path(), exceptions)?;
            Transport::Process(Box::new(process))
        } else {
            Transport::Here(Object::new(&folder, exceptions)?)
        };
        Ok(Self {
            transport,
            settings,
            _folder: folder,
        })
    }

    /// Sends a request and returns the content of the reply.
    pub fn call(&mut self, request: Request, payload: &[u8]) -> Result<Vec<u8>, Failure> {
        let kind = request as u8;
        let limit = match request {
            Request::Describe | Request::Start => self.settings.time_limit + PREPARATION,
            Request::Advance | Request::Save | Request::Restore => self.settings.time_limit,
        };
        let (status, content) = match &mut self.transport {
            Transport::Process(process) => process.call(kind, payload, limit)?,
            Transport::Here(object) => object.call(kind, payload)?,
        };
        match status {
            DONE => Ok(content),
            REFUSED => {
                let why = String::from_utf8_lossy(&content);
                Err(Failure::Refused(format!("{why}{}", self.output())))
            }
            _ => match serde_json::from_slice(&content) {
                Ok(Failed { part, why }) => {
                    let why = format!("{why}{}", self.output());
                    Err(match status {
                        TERMINATED => Failure::Terminated { part, why },
                        _ => Failure::Failed { part, why },
                    })
                }
                Err(error) => Err(Failure::Worker(format!("sent a wrong reply: {error}"))),
            },
        }
    }
}

impl Link {
    /// Returns the last output of the FMU, of a process, as the end of a sentence.
    fn output(&mut self) -> String {
        match &mut self.transport {
            Transport::Process(process) => process.output(),
            Transport::Here(_) => String::new(),
        }
    }
}

fn failed_import(py: Python<'_>, exceptions: &Exceptions, raised: PyErr) -> Failure {
    Failure::Worker(format!(
        "cannot be started: {}",
        exceptions.keep(py, raised)
    ))
}

/// A worker in this process.
struct Object {
    worker: Py<PyAny>,
    exceptions: Exceptions,
    generation: Generation,
}

impl Object {
    fn new(folder: &Folder, exceptions: &Exceptions) -> Result<Self, Failure> {
        let worker = Python::attach(|py| {
            let class = py.import("twinrig._fmu._worker")?.getattr("Worker")?;
            let worker = class.call1((folder.path(),))?;
            Ok(worker.unbind())
        });
        Ok(Self {
            worker: worker
                .map_err(|raised| Python::attach(|py| failed_import(py, exceptions, raised)))?,
            exceptions: exceptions.clone(),
            generation: Generation::current(),
        })
    }

    fn call(&self, kind: u8, payload: &[u8]) -> Result<(u8, Vec<u8>), Failure> {
        Python::attach(|py| {
            let call = || {
                let payload = PyBytes::new(py, payload);
                let reply = self.worker.bind(py).call_method1("call", (kind, payload))?;
                let (status, content): (u8, Bound<'_, PyBytes>) = reply.extract()?;
                Ok((status, content.as_bytes().to_vec()))
            };
            call().map_err(|raised: PyErr| {
                // Not a failure of the FMU, which the worker reports: Ctrl-C, or no memory.
                self.exceptions.keep(py, raised);
                Failure::Interrupted
            })
        })
    }
}

impl Drop for Object {
    fn drop(&mut self) {
        if self.generation.is_past() {
            return;
        }
        // At the end of the interpreter there is nothing left to be ended.
        let _ = Python::try_attach(|py| self.worker.call_method0(py, "close"));
    }
}
