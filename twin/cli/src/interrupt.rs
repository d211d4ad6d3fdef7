//! Handling of SIGINT and SIGTERM, and of a budget of wall-clock time.

use std::io::Write;
use std::sync::{Once, mpsc};
use std::time::Duration;

use twinrig_kernel::SimDuration;
use twinrig_rig::run::interrupt;
use twinrig_runtime::interrupt::request;

static HANDLER: Once = Once::new();

/// Time within which an interrupt request must be acknowledged: a custom part may loop forever, or
/// a read from a pipe without a writer may block.
const GRACE_PERIOD: Duration = Duration::from_secs(3);
/// Grace period if drivers close their devices first.
const GRACE_PERIOD_ON_HARDWARE: Duration = Duration::from_secs(15);

/// Installs the handler of SIGINT and SIGTERM. The first signal requests the end of the run; a
/// second one, or an expired grace period, terminates the program.
pub(crate) fn listen() {
    HANDLER.call_once(|| {
        let (sender, receiver) = mpsc::channel();
        // Without a handler a signal terminates the program, and the recording is readable up to
        // its last flush, so a failure to install it is ignored.
        let _ = ctrlc::set_handler(move || {
            if request() {
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

/// Budget of wall-clock time, which counts until this value is dropped.
pub(crate) struct Budget {
    _end: mpsc::Sender<()>,
}

/// Requests the end of the program after `budget` of wall-clock time, as the first signal does.
pub(crate) fn end_after(budget: SimDuration) -> Budget {
    let (sender, receiver) = mpsc::channel::<()>();
    let thread = std::thread::Builder::new().name("budget".to_owned());
    // Without the thread the run is as long as without a budget.
    let _ = thread.spawn(move || {
        let left = Duration::from_nanos(budget.as_nanos());
        if receiver.recv_timeout(left) == Err(mpsc::RecvTimeoutError::Timeout) {
            interrupt::request_by_budget(budget);
            exit_unless_acknowledged();
        }
    });
    Budget { _end: sender }
}

/// Returns the message of a run that did not start because of an interrupt.
pub(crate) fn not_run() -> String {
    let reason = interrupt::reason();
    format!("not run, since the command was interrupted{reason}")
}

fn exit_unless_acknowledged() {
    let grace_period = if interrupt::is_on_hardware() {
        GRACE_PERIOD_ON_HARDWARE
    } else {
        GRACE_PERIOD
    };
    std::thread::sleep(grace_period);
    if !interrupt::is_acknowledged() {
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
