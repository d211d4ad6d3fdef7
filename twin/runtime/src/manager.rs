use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

/// The scheduling rule (thesis, section 5.2.2.3), without clock, data or parts. An executor calls
/// it at each control step and reports beginnings and ends of iterations and transfers.
///
/// Time is cut in steps as long as the fastest I/O; a *control step* is every k-th of them.
///
/// 1. At a control step at which the process is not running, it begins an iteration. The tasks that
///    are idle at that instant *take part*: the process reads the result of the last transfer of
///    each.
/// 2. When the iteration ends, the tasks that take part receive its outputs, and each runs once.
/// 3. A task that is busy at the control step is skipped in this iteration, even if it becomes idle
///    before the process ends. Its data are read by the next iteration. (If it were started again
///    at once, its data could be overwritten before the process has read them.)
/// 4. A control step at which the process is still running is missed: the tasks wait for the
///    process, which begins again at the next control step, with the physical time elapsed since
///    its last beginning.
///
/// It follows that no transfer is ever cut short or doubled, that the data of each transfer are
/// read exactly once, and that the elapsed times sum to physical time.
///
/// ```
/// use twinrig_kernel::{SimDuration, SimTime};
/// use twinrig_runtime::{ControlStep, Manager};
///
/// let millis = |n| SimTime::ZERO + SimDuration::from_millis(n);
/// let mut manager = Manager::new(1);
/// assert!(matches!(manager.control_step(millis(0)), ControlStep::Begin { .. }));
/// manager.process_ended();
/// assert!(manager.takes_part(0));
/// manager.task_begun(0, millis(0)); // takes 3 ms
///
/// let elapsed = SimDuration::from_millis(2);
/// assert_eq!(manager.control_step(millis(2)), ControlStep::Begin { elapsed, missed: 0 });
/// assert!(!manager.takes_part(0));
/// manager.task_ended(0); // too late for this iteration
/// assert!(!manager.takes_part(0));
/// // The process is still running.
/// assert_eq!(manager.control_step(millis(4)), ControlStep::Late { missed: 1 });
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manager {
    running: bool,
    /// Beginning of the last iteration.
    begun: Option<SimTime>,
    /// Control steps missed since then.
    missed: u64,
    tasks: Vec<TaskState>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct TaskState {
    busy: bool,
    takes_part: bool,
    /// Beginning of the last transfer.
    begun: SimTime,
}

/// Decision at a control step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlStep {
    /// The process begins an iteration.
    Begin {
        /// Physical time since the last iteration began; zero at the first.
        elapsed: SimDuration,
        /// Control steps missed since then.
        missed: u64,
    },
    /// The last iteration is still running.
    Late {
        /// Control steps missed since it began, this one included.
        missed: u64,
    },
}

impl Manager {
    /// Creates a manager of `tasks` idle tasks and an idle process.
    pub fn new(tasks: usize) -> Self {
        Self {
            running: false,
            begun: None,
            missed: 0,
            tasks: vec![TaskState::default(); tasks],
        }
    }

    /// Begins a control step: starts an iteration, unless the last one is still running.
    pub fn control_step(&mut self, now: SimTime) -> ControlStep {
        if self.running {
            self.missed += 1;
            return ControlStep::Late {
                missed: self.missed,
            };
        }
        self.running = true;
        for task in &mut self.tasks {
            task.takes_part = !task.busy;
        }
        let elapsed = self.begun.map_or(SimDuration::ZERO, |begun| now - begun);
        self.begun = Some(now);
        ControlStep::Begin {
            elapsed,
            missed: std::mem::take(&mut self.missed),
        }
    }

    /// Ends the iteration of the process.
    ///
    /// # Panics
    /// If it was not running.
    pub fn process_ended(&mut self) {
        assert!(self.running, "the process ended without having begun");
        self.running = false;
    }

    /// Returns whether the task takes part in the iteration that is running or has just ended.
    pub fn takes_part(&self, task: usize) -> bool {
        self.tasks[task].takes_part
    }

    /// Marks the task as busy: a transfer begins.
    ///
    /// # Panics
    /// If it was busy.
    pub fn task_begun(&mut self, task: usize, now: SimTime) {
        assert!(
            !self.tasks[task].busy,
            "task {task} was started while it was busy"
        );
        self.tasks[task].busy = true;
        self.tasks[task].begun = now;
    }

    /// Returns the time from the beginning of the task's last transfer to `now`.
    pub fn since_begin(&self, task: usize, now: SimTime) -> SimDuration {
        let since = now.checked_since(self.tasks[task].begun);
        since.unwrap_or(SimDuration::ZERO)
    }

    /// Marks the task as idle: its transfer has ended.
    ///
    /// # Panics
    /// If it was idle.
    pub fn task_ended(&mut self, task: usize) {
        assert!(
            self.tasks[task].busy,
            "task {task} ended without having begun"
        );
        self.tasks[task].busy = false;
    }

    /// Returns whether the task is in a transfer.
    pub fn is_busy(&self, task: usize) -> bool {
        self.tasks[task].busy
    }
}
