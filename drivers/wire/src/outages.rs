use twinrig_kernel::{SimDuration, SimTime};

use crate::{FaultKind, FaultSchedule};

/// Windows of time in which a board has no supply or boots.
pub(crate) struct Outages {
    /// Disjoint, in order of time.
    windows: Vec<(SimTime, SimTime)>,
    /// Number of begins and ends that are past: state, to be saved.
    pub(crate) passed: usize,
}

impl Outages {
    /// Returns the outages of the board at a place, which takes `boot` to boot, and the schedule in
    /// which they last until it has booted.
    pub(crate) fn of(
        on: &str,
        schedule: &FaultSchedule,
        boot: SimDuration,
    ) -> (Self, FaultSchedule) {
        let mut schedule = schedule.clone();
        let mut windows = Vec::new();
        for fault in schedule.faults.iter_mut().filter(|fault| fault.strikes(on)) {
            if let FaultKind::BrownOut { boot: given } = fault.kind {
                let boot = given.unwrap_or(boot).as_nanos();
                let lasts = fault.lasts.as_nanos().saturating_add(boot);
                fault.lasts = SimDuration::from_nanos(lasts);
                windows.push((fault.at, fault.until()));
            }
        }
        windows.sort_unstable();
        windows.dedup_by(|later, earlier| {
            let overlap = later.0 <= earlier.1;
            if overlap {
                earlier.1 = earlier.1.max(later.1);
            }
            overlap
        });
        let outages = Self { windows, passed: 0 };
        (outages, schedule)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.windows.is_empty()
    }

    /// Whether the board does not work.
    pub(crate) fn is_off(&self) -> bool {
        self.passed % 2 == 1
    }

    /// Returns the time of the next begin or end.
    pub(crate) fn next(&self) -> Option<SimTime> {
        let (begin, end) = self.windows.get(self.passed / 2)?;
        Some(if self.is_off() { *end } else { *begin })
    }
}
