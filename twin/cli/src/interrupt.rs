//! Ctrl-C, or a plain kill, ends a run between two slices of it, so that what was recorded by then is whole.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);
static LISTEN: Once = Once::new();

/// Begins to listen for Ctrl-C. The first ends the run; a second ends the program as it always does.
pub fn listen() {
    LISTEN.call_once(|| {
        // Without a handler Ctrl-C ends the program at once, and the recording is readable up to its last flush: no
        // reason to refuse to run.
        let _ = ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::SeqCst) {
                std::process::exit(EXIT_INTERRUPTED);
            }
        });
    });
}

/// 128 and the number of the signal, as shells have it.
const EXIT_INTERRUPTED: i32 = 130;

/// Whether somebody pressed Ctrl-C.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

/// The same as a flag, for whoever looks at it from another thread.
pub fn flag() -> &'static AtomicBool {
    &ASKED
}
