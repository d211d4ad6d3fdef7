//! Distribution of the cycles of the loads.

use twinrig_kernel::SimTime;

use super::{LoadCycle, LoadCycles};
use crate::judge::footstep::Thresholds;
use crate::judge::monitor::Monitor;

/// Search for the cycles of the loads, and their readers: monitors, and a caller that collects
/// them.
#[derive(Clone, Debug)]
pub(crate) struct LoadReaders {
    thresholds: Thresholds,
    /// Index of the load of each leg in the samples; none if nothing observes it.
    loads: Vec<Option<usize>>,
    /// Search, until the run ends or the robot falls; none without readers.
    search: Option<LoadCycles>,
    /// Indices of the monitors.
    monitors: Vec<usize>,
    /// Cycles found by the last samples, if they are collected.
    collected: Option<Vec<LoadCycle>>,
}

impl LoadReaders {
    pub fn new(loads: Vec<Option<usize>>, thresholds: Thresholds, monitors: Vec<usize>) -> Self {
        LoadReaders {
            thresholds,
            search: (!monitors.is_empty()).then(|| LoadCycles::new(loads.len(), thresholds)),
            loads,
            monitors,
            collected: None,
        }
    }

    /// Collects the cycles from now on.
    pub fn collect(&mut self) {
        let search = || LoadCycles::new(self.loads.len(), self.thresholds);
        self.search.get_or_insert_with(search);
        self.collected = Some(Vec::new());
    }

    /// Returns the collected cycles.
    pub fn collected(&self) -> &[LoadCycle] {
        self.collected.as_deref().unwrap_or_default()
    }

    /// Forgets the collected cycles.
    pub fn clear(&mut self) {
        if let Some(collected) = &mut self.collected {
            collected.clear();
        }
    }

    /// Adds the samples of the feet. A leg whose load is not observed carries none.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64], monitors: &mut [Monitor]) {
        if let Some(search) = &mut self.search {
            let loads = self.loads.iter();
            let loads = loads.map(|load| load.map_or(0.0, |load| values[load]));
            let mut found = deliver(&self.monitors, &mut self.collected, monitors);
            search.sample(now, loads, &mut found);
        }
    }

    /// Passes on the cycles up to now; no later ones are searched.
    pub fn finish(&mut self, monitors: &mut [Monitor]) {
        if let Some(mut search) = self.search.take() {
            search.finish(&mut deliver(&self.monitors, &mut self.collected, monitors));
        }
    }
}

/// Returns the function that passes a cycle on.
fn deliver<'r>(
    readers: &'r [usize],
    collected: &'r mut Option<Vec<LoadCycle>>,
    monitors: &'r mut [Monitor],
) -> impl FnMut(&LoadCycle) + 'r {
    move |cycle| {
        for index in readers {
            monitors[*index].load_cycle(cycle);
        }
        if let Some(collected) = collected {
            collected.push(cycle.clone());
        }
    }
}
