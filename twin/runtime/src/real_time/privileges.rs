use super::system::{lock_memory, raise_priority};

/// Privileges requested for a real-time run; without them the run continues.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Privileges {
    /// `SCHED_FIFO` priority of the control thread, 1 to 99; none leaves it at normal priority.
    pub control_priority: Option<u8>,
    /// `SCHED_FIFO` priority of the task threads.
    pub task_priority: Option<u8>,
    /// Whether to lock the program's memory against paging.
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
    /// Requests no privileges, as for tests.
    #[must_use]
    pub fn none() -> Self {
        Self {
            control_priority: None,
            task_priority: None,
            lock_memory: false,
        }
    }

    /// Locks memory and determines which privileges are refused: returns a sentence for each, with
    /// the remedy. To be called once, before a run.
    pub fn prepare(&self) -> Vec<String> {
        let mut refused = Vec::new();
        if let Some(priority) = self.control_priority.max(self.task_priority) {
            // On a temporary thread, so that the caller's priority is unchanged.
            let tried = std::thread::Builder::new().spawn(move || raise_priority(Some(priority)));
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
