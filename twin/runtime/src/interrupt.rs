//! Request to end long operations: of the whole program, as by Ctrl-C or SIGTERM, or of the work
//! under a [`Token`]. Every long operation polls [`is_requested`]. The signal handler calls
//! [`request`]; this crate installs none.
//!
//! ```
//! use twinrig_runtime::interrupt::{self, Token};
//!
//! let token = Token::new();
//! token.request();
//! assert!(token.scope(interrupt::is_requested));
//! assert!(!interrupt::is_requested(), "other work continues");
//! ```

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Number of requests in force, of the program and of tokens. It keeps the check of a program
/// without requests at one load.
static REQUESTS: AtomicUsize = AtomicUsize::new(0);

/// Requests the end of the program; returns whether it had been requested before.
pub fn request() -> bool {
    let before = REQUESTED.swap(true, Ordering::SeqCst);
    if !before {
        REQUESTS.fetch_add(1, Ordering::SeqCst);
    }
    before
}

/// Returns whether the end of the program, or of the work of this thread, is requested.
#[inline]
pub fn is_requested() -> bool {
    REQUESTS.load(Ordering::Relaxed) != 0 && is_requested_here()
}

#[cold]
fn is_requested_here() -> bool {
    REQUESTED.load(Ordering::Relaxed)
        || CURRENT.with_borrow(|token| token.as_ref().is_some_and(Token::is_requested))
}

/// Returns the flag of the program, to be polled by another thread.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

thread_local! {
    static CURRENT: RefCell<Option<Token>> = const { RefCell::new(None) };
}

/// Request to end a part of the work of a program: that of the threads in its [`Token::scope`].
/// Clones share the request. For a program that hosts several runs, each with a user of its own.
#[derive(Clone, Debug, Default)]
pub struct Token(Arc<Request>);

#[derive(Debug, Default)]
struct Request(AtomicBool);

impl Drop for Request {
    fn drop(&mut self) {
        if *self.0.get_mut() {
            REQUESTS.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

impl Token {
    /// Creates a token without a request.
    pub fn new() -> Self {
        Self::default()
    }

    /// Requests the end of the work in the scope of the token.
    pub fn request(&self) {
        if !self.0.0.swap(true, Ordering::SeqCst) {
            REQUESTS.fetch_add(1, Ordering::SeqCst);
        }
    }

    /// Returns whether its end is requested.
    pub fn is_requested(&self) -> bool {
        self.0.0.load(Ordering::Relaxed)
    }

    /// Does `work` on this thread in the scope of the token, in place of an outer one.
    pub fn scope<R>(&self, work: impl FnOnce() -> R) -> R {
        in_scope(Some(self), work)
    }
}

/// Returns the token of this thread, for the threads that it starts: they do not inherit it.
pub fn current() -> Option<Token> {
    CURRENT.with_borrow(Clone::clone)
}

/// Does `work` in the scope of the token of another thread, as returned by [`current`].
pub fn in_scope<R>(token: Option<&Token>, work: impl FnOnce() -> R) -> R {
    let _outer = Outer(CURRENT.replace(token.cloned()));
    work()
}

/// Token to return to, also after a panic.
struct Outer(Option<Token>);

impl Drop for Outer {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// Interruption check for a long loop.
///
/// A plant uses one in each [`crate::Plant::advance`] and checks it at every step: with steps of a
/// nanosecond, an advance to an observation a second away would take an hour without a possibility
/// of interruption.
///
/// ```
/// use twinrig_runtime::interrupt::LongLoop;
///
/// let mut steps = LongLoop::default();
/// let sum: u64 = (0..1_000_000).take_while(|_| !steps.is_interrupted()).sum();
/// assert_eq!(sum, 499_999_500_000);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct LongLoop {
    turns: u32,
}

/// Turns between two checks of the flag: an ordinary advance to the next observation has fewer and
/// is never interrupted.
const TURNS: u32 = 256;

impl LongLoop {
    /// Counts a turn; returns whether the end is requested, checked every 256th turn.
    #[inline]
    pub fn is_interrupted(&mut self) -> bool {
        self.turns = self.turns.wrapping_add(1);
        self.turns.is_multiple_of(TURNS) && is_requested()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Mutex, MutexGuard, PoisonError};

    use super::*;

    /// Lets the tests, which share the number of requests, run one after the other.
    fn alone() -> MutexGuard<'static, ()> {
        static ALONE: Mutex<()> = Mutex::new(());
        ALONE.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[test]
    fn only_long_loops_are_interrupted() {
        let _alone = alone();
        let mut turns = LongLoop::default();
        let token = Token::new();
        token.scope(|| {
            token.request();
            let first = (1..=3 * TURNS).find(|_| turns.is_interrupted());
            assert_eq!(first, Some(TURNS));
        });
        assert!((0..3 * TURNS).all(|_| !turns.is_interrupted()));
    }

    #[test]
    fn request_of_a_token_ends_the_work_in_its_scope_only() {
        let _alone = alone();
        let (outer, inner) = (Token::new(), Token::new());
        outer.scope(|| {
            inner.scope(|| {
                inner.clone().request();
                assert!(is_requested());
                let of_other_thread = std::thread::Builder::new().spawn(is_requested);
                assert!(
                    !of_other_thread.unwrap().join().unwrap(),
                    "threads do not inherit it"
                );
                let token = current();
                let handed = std::thread::Builder::new()
                    .spawn(move || in_scope(token.as_ref(), is_requested));
                assert!(handed.unwrap().join().unwrap());
            });
            assert!(!is_requested(), "the outer scope has a token of its own");
            let _ = std::panic::catch_unwind(|| inner.scope(|| std::panic::panic_any(())));
            assert!(!is_requested(), "a panic leaves the scope");
        });
        assert!(current().is_none());
    }

    #[test]
    fn request_ends_with_its_token() {
        let _alone = alone();
        let before = REQUESTS.load(Ordering::SeqCst);
        let token = Token::new();
        token.request();
        token.request();
        assert_eq!(REQUESTS.load(Ordering::SeqCst), before + 1);
        drop(token.clone());
        assert!(token.is_requested());
        drop(token);
        assert_eq!(REQUESTS.load(Ordering::SeqCst), before);
    }
}
