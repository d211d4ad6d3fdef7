//! Panics of parts: they end a run, not the program, and name the part.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::cell::{Cell, RefCell};
use std::fmt;
use std::io::Write;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::Once;

#[cfg(panic = "abort")]
compile_error!(
    "a panic of a part must unwind to end its run only: leave `panic = \"abort\"` out of the profile"
);

/// A panic that was caught: a bug in a part, or in what calls it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PanicReport {
    /// The innermost part whose code was running: ``plant `toy` ``; none outside of all parts.
    pub part: Option<String>,
    /// The message of the panic.
    pub message: String,
    /// Source file, line and column; none if another panic hook has taken the place of this one.
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

/// Which kind of part.
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
    /// A [`crate::Wire`] with the boards at its far end.
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
    /// How many [`caught`] this thread is in.
    static DEPTH: Cell<usize> = const { Cell::new(0) };
    /// The panic that unwinds through the innermost of them.
    static UNWINDING: RefCell<Unwinding> = const { RefCell::new(Unwinding { part: None, place: None }) };
}

#[derive(Default)]
struct Unwinding {
    part: Option<String>,
    place: Option<String>,
}

/// Runs `run`; a panic in it is an error that says where and in which part it happened, and is not printed. With
/// `RUST_BACKTRACE` set, its back-trace goes to standard error.
///
/// What `run` was changing when it panicked is in no defined state, though it is memory-safe: the caller reads of it what it
/// knows to be sound, and calls none of its parts again.
///
/// # Errors
/// [`PanicReport`] if `run` panicked.
pub fn caught<R>(run: impl FnOnce() -> R) -> Result<R, PanicReport> {
    listen();
    let outer = UNWINDING.take();
    DEPTH.set(DEPTH.get() + 1);
    let ran = catch_unwind(AssertUnwindSafe(run));
    DEPTH.set(DEPTH.get() - 1);
    let Unwinding { part, place } = UNWINDING.replace(outer);
    ran.map_err(|payload| PanicReport {
        part,
        message: message(&*payload).to_owned(),
        place,
    })
}

/// Runs `call`, which is code of the part `name`: a panic that unwinds through here is known to be that part's. Costs nothing
/// otherwise.
pub fn in_part<R>(kind: PartKind, name: &str, call: impl FnOnce() -> R) -> R {
    let entered = Entered { kind, name };
    let result = call();
    std::mem::forget(entered);
    result
}

/// A part that is being called. It is dropped by unwinding only.
struct Entered<'a> {
    kind: PartKind,
    name: &'a str,
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        // The innermost part is dropped first, and is the one to blame.
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

/// Puts a hook before the present one that keeps the place of a panic which will be caught.
fn listen() {
    static ONCE: Once = Once::new();
    // The hook of a thread that is unwinding cannot be changed.
    if std::thread::panicking() {
        return;
    }
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !kept(info) {
                before(info);
            }
        }));
    });
}

/// Keeps the place of a panic. False if nobody here catches it, or if one is being unwound already: the program may be about to
/// abort, and its last word must not be lost.
fn kept(info: &PanicHookInfo<'_>) -> bool {
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
    fn a_panic_is_an_error_with_its_part_its_message_and_its_place() {
        let line = line!() + 2;
        let report = caught(|| {
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
    fn of_parts_that_call_each_other_the_innermost_is_named() {
        let report = caught(|| {
            in_part(PartKind::Task, "sbcp", || {
                in_part(PartKind::Driver, "sbcp", || ());
                in_part(PartKind::Plant, "toy", || -> () { panic!("a") });
            });
        });
        let part = report.unwrap_err().part;
        assert_eq!(part.as_deref(), Some("plant `toy`"));
    }

    #[test]
    fn a_panic_knows_nothing_of_the_one_before() {
        let _ = caught(|| in_part(PartKind::Plant, "toy", || -> () { panic!("a") }));
        let second = caught(|| std::panic::panic_any(5)).unwrap_err();
        assert_eq!(second.part, None);
        assert_eq!(second.message, "without a message");
        assert_eq!(caught(|| 7), Ok(7));
    }

    #[test]
    fn one_that_is_caught_inside_another_leaves_the_other_alone() {
        struct Tidy;
        impl Drop for Tidy {
            fn drop(&mut self) {
                // While it is dropped, another panic may be on its way out.
                let inner = caught(|| in_part(PartKind::Driver, "inner", || -> () { panic!("b") }));
                assert_eq!(inner.unwrap_err().message, "b");
            }
        }
        let outer = caught(|| {
            let _tidy = Tidy;
            in_part(PartKind::Plant, "outer", || -> () { panic!("a") });
        });
        let outer = outer.unwrap_err();
        assert_eq!(outer.part.as_deref(), Some("plant `outer`"));
        assert_eq!(outer.message, "a");
        assert!(outer.place.is_some());
    }
}
