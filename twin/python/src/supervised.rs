//! Long work with the interpreter released, which Python's signals end.

use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread::Builder;

use pyo3::prelude::*;
use twinrig::runtime::interrupt::Token;
use twinrig::runtime::{PanicReport, catch_panic};

use crate::poll;

/// Result of work, and the exception of the signal handler that ended it.
pub(crate) struct Supervised<R> {
    /// Result, or the panic of the work.
    pub(crate) result: Result<R, PanicReport>,
    /// Exception raised by a handler of Python's signals: `KeyboardInterrupt` after Ctrl-C.
    pub(crate) interrupt: Option<PyErr>,
}

/// Does `work` with the interpreter released.
///
/// Python handles signals on its main thread only. There the work has a thread of its own, and this
/// one polls the signals meanwhile, also while the work does not reach the end of an advance. An
/// exception of a handler requests the end of the work, which is then awaited.
pub(crate) fn supervised<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> R + Send,
) -> PyResult<Supervised<R>> {
    if !is_main_thread(py)? {
        return Ok(in_place(py, work));
    }
    py.detach(|| on_a_thread(work))
}

/// Does `work` on this thread with the interpreter released; the work polls Python's signals.
pub(crate) fn in_place<R: Send>(py: Python<'_>, work: impl FnOnce() -> R + Send) -> Supervised<R> {
    let scoped = || Token::new().scope(|| catch_panic(work));
    Supervised {
        result: py.detach(scoped),
        interrupt: None,
    }
}

/// Whether this is the thread on which Python handles signals.
fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    let main = threading.call_method0("main_thread")?.getattr("ident")?;
    main.eq(threading.call_method0("get_ident")?)
}

/// Calls the handlers of the signals that Python has received.
fn handle_signals(py: Python<'_>) -> PyResult<()> {
    py.check_signals()
}

#[expect(
    clippy::disallowed_methods,
    reason = "the work has one thread; the other one waits for signals"
)]
fn on_a_thread<R: Send>(work: impl FnOnce() -> R + Send) -> PyResult<Supervised<R>> {
    let token = Token::new();
    let (done, finished) = sync_channel(1);
    std::thread::scope(|scope| {
        let worker = Builder::new().name("twinrig".to_owned());
        let scoped = token.clone();
        let worker = worker.spawn_scoped(scope, move || {
            let result = scoped.scope(|| catch_panic(work));
            // The receiver lives until this thread has ended.
            let _ = done.send(result);
        })?;
        let mut interrupt = None;
        loop {
            match finished.recv_timeout(poll::PERIOD) {
                Ok(result) => return Ok(Supervised { result, interrupt }),
                // The thread has ended without a result: its panic is passed on.
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(raised) = Python::attach(handle_signals) {
                        token.request();
                        interrupt.get_or_insert(raised);
                    }
                }
            }
        }
        let panic = worker.join().err().unwrap_or_else(|| Box::new("no result"));
        std::panic::resume_unwind(panic)
    })
}
