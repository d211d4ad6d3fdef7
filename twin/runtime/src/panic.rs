//! Panics of parts: each ends its run, not the program, and is attributed to the part.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::cell::{Cell, RefCell};
use std::fmt;
use std::io::Write;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::Once;

// Without unwinding on WebAssembly, a panic ends the program.
#[cfg(all(panic = "abort", not(target_family = "wasm")))]
compile_error!(
    "a panic of a part must unwind to end its run only: leave `panic = \"abort\"` out of the profile"
);

/// A caught panic: a bug in a part or in its caller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PanicReport {
    /// The innermost part whose code was running: ``plant `toy` ``; none outside of all parts.
    pub part: Option<String>,
    /// The message of the panic.
    pub message: String,
    /// Source file, line and column; none if another panic hook has replaced this one.
    pub place: Option<String>,
}

impl fmt::Display for PanicReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = self.part.as_deref().unwrap_or("twin");
        write!(f, "{part} panicked: {}", self.message)?;
        match &self.place {
            Some(place) => write!(f, " ({place})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for PanicReport {}

/// Kind of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// A [`crate::Plant`].
    Plant,
    /// A [`crate::Process`].
    Controller,
    /// An [`crate::IoTask`].
    Task,
    /// A [`crate::Driver`].
    Driver,
    /// A [`crate::Wire`] with its boards.
    Wire,
}

impl PartKind {
    fn word(self) -> &'static str {
        match self {
            Self::Plant => "plant",
            Self::Controller => "controller",
            Self::Task => "task",
            Self::Driver => "driver",
            Self::Wire => "wire",
        }
    }
}

thread_local! {
    /// Nesting depth of [`catch_panic`] on this thread.
    static DEPTH: Cell<usize> = const { Cell::new(0) };
    /// Panic that unwinds through the innermost of them.
    static UNWINDING: RefCell<Unwinding> = const { RefCell::new(Unwinding { part: None, place: None }) };
}

#[derive(Default)]
struct Unwinding {
    part: Option<String>,
    place: Option<String>,
}

/// Runs `run` and converts a panic in it into an error with its part and source location; the panic
/// is not printed. With `RUST_BACKTRACE` set, its back-trace is written to standard error.
///
/// Data modified by `run` during the panic are memory-safe, but in no defined state: the caller may
/// read only data known to be consistent, and must not call the parts again.
///
/// # Errors
/// [`PanicReport`] if `run` panicked.
pub fn catch_panic<R>(run: impl FnOnce() -> R) -> Result<R, PanicReport> {
    install_hook();
    let outer = UNWINDING.take();
    DEPTH.set(DEPTH.get() + 1);
    let result = catch_unwind(AssertUnwindSafe(run));
    DEPTH.set(DEPTH.get() - 1);
    let Unwinding { part, place } = UNWINDING.replace(outer);
    result.map_err(|payload| PanicReport {
        part,
        message: message(&*payload).to_owned(),
        place,
    })
}

/// Runs `call`, which is code of the part `name`: a panic that unwinds through it is attributed to
/// that part. No cost otherwise.
pub fn in_part<R>(kind: PartKind, name: &str, call: impl FnOnce() -> R) -> R {
    let entered = Entered { kind, name };
    let result = call();
    std::mem::forget(entered);
    result
}

/// A call of a part in progress. Dropped by unwinding only.
struct Entered<'a> {
    kind: PartKind,
    name: &'a str,
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        // The innermost part is dropped first; the panic is attributed to it.
        UNWINDING.with_borrow_mut(|unwinding| {
            unwinding
                .part
                .get_or_insert_with(|| format!("{} `{}`", self.kind.word(), self.name));
        });
    }
}

fn message(payload: &(dyn std::any::Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("without a message")
}

/// Installs a hook before the present one that stores the location of a panic that will be caught.
fn install_hook() {
    static ONCE: Once = Once::new();
    // The hook cannot be changed while the thread is unwinding.
    if std::thread::panicking() {
        return;
    }
    ONCE.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !record_location(info) {
                previous(info);
            }
        }));
    });
}

/// Stores the location of a panic. Returns false if the panic is not caught, or if another one is
/// unwinding already: the program may be about to abort, and its message must be printed.
fn record_location(info: &PanicHookInfo<'_>) -> bool {
    if DEPTH.get() == 0 {
        return false;
    }
    let place = info.location().map(ToString::to_string);
    let first = UNWINDING.with_borrow_mut(|unwinding| {
        let known = unwinding.place.take();
        unwinding.place = place;
        known.is_none()
    });
    let trace = Backtrace::capture();
    if first && trace.status() == BacktraceStatus::Captured {
        let _ = writeln!(std::io::stderr(), "{trace}");
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caught_panic_has_part_message_and_location() {
        let line = line!() + 2;
        let report = catch_panic(|| {
            in_part(PartKind::Plant, "toy", || -> () { panic!("at {} N", 3) });
        });
        let report = report.unwrap_err();
        assert_eq!(report.part.as_deref(), Some("plant `toy`"));
        assert_eq!(report.message, "at 3 N");
        let place = report.place.clone().unwrap();
        assert!(
            place.contains(&format!("panic.rs:{line}:")),
            "{place}, expected line {line}"
        );
        assert_eq!(
            report.to_string(),
            format!("plant `toy` panicked: at 3 N ({place})")
        );
    }

    #[test]
    fn nested_parts_report_the_innermost() {
        let report = catch_panic(|| {
            in_part(PartKind::Task, "sbcp", || {
                in_part(PartKind::Driver, "sbcp", || ());
                in_part(PartKind::Plant, "toy", || -> () { panic!("a") });
            });
        });
        let part = report.unwrap_err().part;
        assert_eq!(part.as_deref(), Some("plant `toy`"));
    }

    #[test]
    fn report_is_independent_of_earlier_panics() {
        let _ = catch_panic(|| in_part(PartKind::Plant, "toy", || -> () { panic!("a") }));
        let second = catch_panic(|| std::panic::panic_any(5)).unwrap_err();
        assert_eq!(second.part, None);
        assert_eq!(second.message, "without a message");
        assert_eq!(catch_panic(|| 7), Ok(7));
    }

    #[test]
    fn panic_caught_during_unwinding_leaves_the_outer_report_intact() {
        struct Tidy;
        impl Drop for Tidy {
            fn drop(&mut self) {
                // Another panic may be unwinding during the drop.
                let inner =
                    catch_panic(|| in_part(PartKind::Driver, "inner", || -> () { panic!("b") }));
                assert_eq!(inner.unwrap_err().message, "b");
            }
        }
        let outer = catch_panic(|| {
            let _tidy = Tidy;
            in_part(PartKind::Plant, "outer", || -> () { panic!("a") });
        });
        let outer = outer.unwrap_err();
        assert_eq!(outer.part.as_deref(), Some("plant `outer`"));
        assert_eq!(outer.message, "a");
        assert!(outer.place.is_some());
    }
}
