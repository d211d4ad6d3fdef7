//! Ctrl-C, or a plain kill, ends a run after the instant at hand, so that what was recorded by then is whole.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Once, mpsc};
use std::time::Duration;

use twinrig_runtime::interrupt;

static LISTEN: Once = Once::new();
/// Whether the request to end has been seen by those who are to end.
static SEEN: AtomicBool = AtomicBool::new(false);
/// Whether devices may have to be closed, which takes its time.
static AT_DEVICES: AtomicBool = AtomicBool::new(false);

/// So long nobody has to look whether the end is requested: a part of somebody's own may loop, or a pipe may have no writer.
const PATIENCE: Duration = Duration::from_secs(3);
/// The same where drivers close their devices first.
const PATIENCE_AT_DEVICES: Duration = Duration::from_secs(15);

/// Begins to listen for Ctrl-C. The first ends the run; a second, or one that nobody looks at, ends the program as it always
/// does.
pub fn listen() {
    LISTEN.call_once(|| {
        let (caught, catches) = mpsc::channel();
        // Without a handler Ctrl-C ends the program at once, and the recording is readable up to its last flush: no
        // reason to refuse to run.
        let _ = ctrlc::set_handler(move || {
            if interrupt::request() {
                std::process::exit(EXIT_INTERRUPTED);
            }
            let _ = caught.send(());
        });
        let thread = std::thread::Builder::new().name("interrupt".to_owned());
        let _ = thread.spawn(move || {
            if catches.recv().is_ok() {
                end_if_nobody_looks();
            }
        });
    });
}

fn end_if_nobody_looks() {
    let patience = if AT_DEVICES.load(Ordering::SeqCst) {
        PATIENCE_AT_DEVICES
    } else {
        PATIENCE
    };
    std::thread::sleep(patience);
    if !SEEN.load(Ordering::SeqCst) {
        let seconds = patience.as_secs();
        let _ = writeln!(
            std::io::stderr(),
            "error: interrupted, and nothing came to an end within {seconds} s; a recording holds what was flushed"
        );
        std::process::exit(EXIT_INTERRUPTED);
    }
}

/// 128 and the number of the signal, as shells have it.
const EXIT_INTERRUPTED: i32 = 130;

/// Whether somebody pressed Ctrl-C. Who asks and hears yes has to come to an end.
pub fn asked() -> bool {
    let asked = interrupt::is_requested();
    if asked {
        SEEN.store(true, Ordering::SeqCst);
    }
    asked
}

/// The same as a flag, for what runs at devices and looks at it from another thread.
pub fn flag_at_devices() -> &'static AtomicBool {
    AT_DEVICES.store(true, Ordering::SeqCst);
    interrupt::flag()
}
