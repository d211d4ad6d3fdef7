//! Handling of SIGINT and SIGTERM, and of a budget of wall-clock time: a run ends after the current
//! instant, with a complete recording.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
#[cfg(feature = "cli")]
use std::sync::mpsc;
use std::sync::{Once, OnceLock};
use std::time::Duration;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::interrupt;

use crate::report::seconds;

static HANDLER: Once = Once::new();
/// Whether the running operation has detected the interrupt request.
static ACKNOWLEDGED: AtomicBool = AtomicBool::new(false);
/// Whether drivers may have to close their devices, which takes longer.
static ON_HARDWARE: AtomicBool = AtomicBool::new(false);

/// Time within which an interrupt request must be acknowledged: a custom part may loop forever, or
/// a read from a pipe without a writer may block.
const GRACE_PERIOD: Duration = Duration::from_secs(3);
/// Grace period if drivers close their devices first.
const GRACE_PERIOD_ON_HARDWARE: Duration = Duration::from_secs(15);

/// Installs the handler of SIGINT and SIGTERM. The first signal requests the end of the run; a
/// second one, or an expired grace period, terminates the program.
#[cfg(feature = "cli")]
pub fn listen() {
    HANDLER.call_once(|| {
        let (sender, receiver) = mpsc::channel();
        // Without a handler a signal terminates the program, and the recording is readable up to
        // its last flush, so a failure to install it is ignored.
        let _ = ctrlc::set_handler(move || {
            if interrupt::request() {
                std::process::exit(EXIT_INTERRUPTED);
            }
            let _ = sender.send(());
        });
        let thread = std::thread::Builder::new().name("interrupt".to_owned());
        let _ = thread.spawn(move || {
            if receiver.recv().is_ok() {
                exit_unless_acknowledged();
            }
        });
    });
}

/// Budget that is used up.
static USED_UP: OnceLock<SimDuration> = OnceLock::new();

/// Budget of wall-clock time, which counts until this value is dropped.
#[cfg(feature = "cli")]
pub struct Budget {
    _end: mpsc::Sender<()>,
}

/// Requests the end of the program after `budget` of wall-clock time, as the first signal does.
#[cfg(feature = "cli")]
pub fn end_after(budget: SimDuration) -> Budget {
    let (sender, receiver) = mpsc::channel::<()>();
    let thread = std::thread::Builder::new().name("budget".to_owned());
    // Without the thread the run is as long as without a budget.
    let _ = thread.spawn(move || {
        let left = Duration::from_nanos(budget.as_nanos());
        if receiver.recv_timeout(left) == Err(mpsc::RecvTimeoutError::Timeout) {
            let _ = USED_UP.set(budget);
            interrupt::request();
            exit_unless_acknowledged();
        }
    });
    Budget { _end: sender }
}

/// Returns the reason of an interrupt, for messages: empty for a signal.
fn reason() -> String {
    USED_UP.get().map_or_else(String::new, |budget| {
        let seconds = seconds(budget.as_nanos());
        format!(": the budget of {seconds} s is used up")
    })
}

/// Returns the message of a run that was interrupted at `at`.
pub fn message(at: SimTime) -> String {
    format!("interrupted at {at}{}", reason())
}

/// Returns the message of a run that did not start because of an interrupt.
#[cfg(feature = "cli")]
pub fn not_run() -> String {
    format!("not run, since the command was interrupted{}", reason())
}

fn exit_unless_acknowledged() {
    let grace_period = if ON_HARDWARE.load(Ordering::SeqCst) {
        GRACE_PERIOD_ON_HARDWARE
    } else {
        GRACE_PERIOD
    };
    std::thread::sleep(grace_period);
    if !ACKNOWLEDGED.load(Ordering::SeqCst) {
        let seconds = grace_period.as_secs();
        let _ = writeln!(
            std::io::stderr(),
            "error: interrupted, but the run did not end within {seconds} s; a recording contains the data up to its last flush"
        );
        std::process::exit(EXIT_INTERRUPTED);
    }
}

/// Exit code 128 + SIGINT, as in shells.
const EXIT_INTERRUPTED: i32 = 130;

/// Returns and acknowledges an interrupt request. The caller must end its operation if it is true.
pub fn is_requested() -> bool {
    let is_requested = interrupt::is_requested();
    if is_requested {
        ACKNOWLEDGED.store(true, Ordering::SeqCst);
    }
    is_requested
}

/// Returns the flag of interrupt requests for runs on hardware, which poll it on another thread,
/// and extends the grace period.
pub fn hardware_flag() -> &'static AtomicBool {
    ON_HARDWARE.store(true, Ordering::SeqCst);
    interrupt::flag()
}
