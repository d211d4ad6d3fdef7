use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::prctl::set_timerslack;
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// What a real-time run asks of the system, and goes on without where it is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Privileges {
    /// Priority of the control thread among those of `SCHED_FIFO`, 1 to 99; none leaves it an ordinary thread.
    pub control_priority: Option<u8>,
    /// The same of the threads of the tasks.
    pub task_priority: Option<u8>,
    /// Whether to keep the program's memory from being paged out.
    pub lock_memory: bool,
}

/// Priorities of the original software (70 for control, 60 for its tasks), and locked memory.
impl Default for Privileges {
    fn default() -> Self {
        Self {
            control_priority: Some(70),
            task_priority: Some(60),
            lock_memory: true,
        }
    }
}

impl Privileges {
    /// Asks for nothing: what tests want.
    #[must_use]
    pub fn none() -> Self {
        Self {
            control_priority: None,
            task_priority: None,
            lock_memory: false,
        }
    }

    /// Locks memory and finds out what will be refused: a sentence for each, with the remedy. To be called
    /// once, before a run, by whoever can tell the user.
    pub fn prepare(&self) -> Vec<String> {
        let mut refused = Vec::new();
        if let Some(priority) = self.control_priority.max(self.task_priority) {
            // On a thread that ends at once, so that the caller stays what it is.
            let tried = std::thread::Builder::new().spawn(move || raise(Some(priority)));
            let raised = tried.is_ok_and(|thread| thread.join().unwrap_or(false));
            if !raised {
                refused.push(
                    "the system grants no real-time priority, so other programs may delay the run: \
                     raise the limit `rtprio` (ulimit -r, /etc/security/limits.conf), or run as root"
                        .into(),
                );
            }
        }
        if self.lock_memory && !lock_memory() {
            refused.push(
                "the system does not lock memory, so paging may delay the run: \
                 raise the limit `memlock` (ulimit -l, /etc/security/limits.conf), or run as root"
                    .into(),
            );
        }
        refused
    }
}

/// Locks what memory there is, and what will be if there is no limit to it: with one, memory asked for later
/// would be refused, which ends a program.
fn lock_memory() -> bool {
    let unlimited =
        getrlimit(Resource::RLIMIT_MEMLOCK).is_ok_and(|(soft, _)| soft == RLIM_INFINITY);
    let mut what = MlockAllFlags::MCL_CURRENT;
    if unlimited {
        what |= MlockAllFlags::MCL_FUTURE;
    }
    mlockall(what).is_ok()
}

/// Makes the calling thread a real-time one, and its timers exact; says whether it now has that priority.
pub(super) fn raise(priority: Option<u8>) -> bool {
    // Timers of ordinary threads are 50 µs late by default, to save power. None of ours is to be.
    let _ = set_timerslack(1);
    let Some(priority) = priority else {
        return true;
    };
    let Ok(priority) = ThreadPriority::try_from(priority) else {
        return false;
    };
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), priority, policy).is_ok()
}
