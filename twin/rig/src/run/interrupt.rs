//! Interrupt requests to runs: a run ends after the current instant, with a complete recording.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::interrupt;

use crate::report::seconds;

/// Whether the running operation has detected the interrupt request.
static ACKNOWLEDGED: AtomicBool = AtomicBool::new(false);
/// Whether drivers may have to close their devices, which takes longer.
static ON_HARDWARE: AtomicBool = AtomicBool::new(false);
/// Budget of wall-clock time that is used up.
static USED_UP: OnceLock<SimDuration> = OnceLock::new();

/// Requests the end of the run, for the reason that this budget of wall-clock time is used up.
pub fn request_by_budget(budget: SimDuration) {
    let _ = USED_UP.set(budget);
    interrupt::request();
}

/// Returns the reason of an interrupt, for messages: empty for a signal.
pub fn reason() -> String {
    USED_UP.get().map_or_else(String::new, |budget| {
        let seconds = seconds(budget.as_nanos());
        format!(": the budget of {seconds} s is used up")
    })
}

/// Returns the message of a run that was interrupted at `at`.
pub(crate) fn message(at: SimTime) -> String {
    format!("interrupted at {at}{}", reason())
}

/// Returns and acknowledges an interrupt request. The caller must end its operation if it is true.
pub fn is_requested() -> bool {
    let is_requested = interrupt::is_requested();
    if is_requested {
        ACKNOWLEDGED.store(true, Ordering::SeqCst);
    }
    is_requested
}

/// Returns whether the running operation has detected the interrupt request.
pub fn is_acknowledged() -> bool {
    ACKNOWLEDGED.load(Ordering::SeqCst)
}

/// Returns the flag of interrupt requests for runs on hardware, which poll it on another thread.
pub fn hardware_flag() -> &'static AtomicBool {
    ON_HARDWARE.store(true, Ordering::SeqCst);
    interrupt::flag()
}

/// Returns whether a run on hardware may have to close its devices.
pub fn is_on_hardware() -> bool {
    ON_HARDWARE.load(Ordering::SeqCst)
}
