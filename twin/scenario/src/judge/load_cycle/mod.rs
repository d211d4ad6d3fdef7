//! Cycles of a gait by the loads of its feet.
//!
//! A touch-down is a poor mark of a cycle: a foot bounces, grazes the ground, and lands early on a
//! slope. Its load is a better one. The phase of a leg is that of the first Fourier coefficient of
//! its load, the circular mean of the cycle weighted by the load, so that a contact counts by its
//! impulse.
//!
//! Each cycle is seen through a raised cosine two periods long. Its copies one period apart add up
//! to one, so that phase, duty factor and number of contacts of a periodic gait are those of one
//! period exactly, whatever the shape of the loads.
//!
//! The period is not known beforehand, and changes. It is the longest time after which the loads
//! repeat ([`repetition`]). Cycles are found with a delay of [`LOOKAHEAD_S`], whatever their
//! period: they depend neither on earlier ones nor on the length of the run, except near its ends.

mod history;
mod readers;
mod repetition;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use twinrig_kernel::{SimDuration, SimTime};

use super::footstep::Thresholds;
use history::{Bin, History, LANES, Quantity, SPAN_S};
pub(super) use readers::LoadReaders;
use repetition::{BINS, Bins, LONGEST_S, Window};

/// Simulated time between a cycle and the samples with which it is found \[s\]: a window of one
/// period about the next cycle, of the longest period, for a cycle at the start of the run.
const LOOKAHEAD_S: f64 = 3.0 * LONGEST_S;
const _: () = assert!(SPAN_S > LOOKAHEAD_S + 2.5 * LONGEST_S);
/// Time between two searches where the loads do not repeat \[s\].
const SEARCH_STEP_S: f64 = 0.1;
/// Least magnitude of the first Fourier coefficient of a leg that has a phase, over the mean load
/// of a leg. A rectangular pulse of duty factor 0.9 reaches 0.11.
const CONCENTRATION_MIN: f64 = 0.1;

/// One cycle of all legs.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCycle {
    /// Time of the first leg's mean load; of the next leg, if the first has no phase.
    pub centre: SimTime,
    /// Period.
    pub period: SimDuration,
    /// Each leg.
    pub legs: Vec<LegCycle>,
}

/// One cycle of a leg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LegCycle {
    /// Circular mean of its load after the centre of the cycle, as a share of the period in [0, 1);
    /// none if the load has no first harmonic.
    pub phase: Option<f64>,
    /// Share of the cycle with the foot on the ground.
    pub duty_factor: f64,
    /// Number of contacts in the cycle.
    pub contacts: f64,
}

impl LoadCycle {
    /// Returns the phase of a leg after that of the leg `first`, as a share of the period below 1;
    /// none if one of them has none.
    pub fn phase(&self, leg: usize, first: usize) -> Option<f64> {
        let of = |leg: usize| self.legs.get(leg)?.phase;
        Some(wrap(of(leg)? - of(first)?))
    }

    /// Returns begin and end of the samples that it is measured by, one period before and after its
    /// centre.
    pub(super) fn samples(&self) -> [SimTime; 2] {
        let begin = self
            .centre
            .as_nanos()
            .saturating_sub(self.period.as_nanos());
        [SimTime::from_nanos(begin), self.centre + self.period]
    }
}

/// Search for the cycles of a run. Its memory does not depend on the length of the run.
#[derive(Clone, Debug)]
struct LoadCycles {
    history: History,
    window: Window,
    bins: Bins,
    /// Time about which the next cycle is searched \[s\].
    next_s: f64,
    /// Centre of the last cycle \[s\].
    last_s: f64,
    /// Last cycle.
    cycle: LoadCycle,
}

impl LoadCycles {
    /// Creates the search for the cycles of so many legs.
    pub fn new(legs: usize, thresholds: Thresholds) -> Self {
        LoadCycles {
            history: History::new(legs, thresholds),
            window: Window::new(),
            bins: [Bin::default(); _],
            next_s: 0.0,
            last_s: f64::NEG_INFINITY,
            cycle: LoadCycle {
                centre: SimTime::ZERO,
                period: SimDuration::ZERO,
                legs: vec![LegCycle::default(); legs],
            },
        }
    }

    /// Adds a sample, the mean load of each foot since the last one; `found` takes the completed
    /// cycles.
    pub fn sample(
        &mut self,
        now: SimTime,
        loads: impl Iterator<Item = f64>,
        found: &mut impl FnMut(&LoadCycle),
    ) {
        self.history.sample(now, loads);
        while self.next_s + LOOKAHEAD_S <= self.history.end_s() {
            self.search(found);
        }
    }

    /// Passes the cycles up to the end of the run on.
    pub fn finish(&mut self, found: &mut impl FnMut(&LoadCycle)) {
        while self.next_s < self.history.end_s() {
            self.search(found);
        }
    }

    /// Searches the cycle about the next time.
    fn search(&mut self, found: &mut impl FnMut(&LoadCycle)) {
        let from_s = self.next_s;
        self.next_s += SEARCH_STEP_S;
        let Some(period_s) =
            repetition::period(&self.history, &self.window, &mut self.bins, from_s)
        else {
            return;
        };
        let period_s = repetition::refined(
            &self.history,
            &self.window,
            &mut self.bins,
            from_s,
            period_s,
        );
        let Some(centre_s) = self.centre(from_s, period_s) else {
            return;
        };
        let period_s = repetition::refined(
            &self.history,
            &self.window,
            &mut self.bins,
            centre_s,
            period_s,
        );
        let Some(centre_s) = self.centre(centre_s, period_s) else {
            return;
        };
        self.next_s = self.next_s.max(centre_s + period_s);
        // The search may lead back to the last cycle where the gait changes.
        let is_next = centre_s > self.last_s + 0.5 * period_s;
        let begin_s = centre_s - period_s;
        if !is_next
            || begin_s < self.history.start_s()
            || centre_s + period_s > self.history.end_s()
        {
            return;
        }
        self.last_s = centre_s;
        self.measure(centre_s, period_s);
        found(&self.cycle);
    }

    /// Returns the time of the mean load of the first leg that has one about `near_s`.
    fn centre(&mut self, near_s: f64, period_s: f64) -> Option<f64> {
        let mut centre_s = near_s;
        // Converges as the window covers two periods; a gait that changes may not.
        for _ in 0..8 {
            self.measure(centre_s, period_s);
            let phase = self.cycle.legs.iter().find_map(|leg| leg.phase)?;
            let shift = wrap(phase + 0.5) - 0.5;
            centre_s += shift * period_s;
            if shift.abs() < 1e-6 {
                break;
            }
        }
        Some(centre_s)
    }

    /// Measures the cycle about `centre_s`.
    fn measure(&mut self, centre_s: f64, period_s: f64) {
        let legs = self.cycle.legs.len();
        let (history, window) = (&self.history, &self.window);
        let bins = &mut self.bins[..=2 * BINS];
        history.set_edges(bins, centre_s - period_s, period_s / BINS as f64);
        let mut of = |block: usize, quantity: Quantity| {
            history.set_increments(bins, block, quantity);
            window.transform(bins)
        };
        // Lanes without a leg have no load.
        let mut load = 0.0;
        for block in 0..history.blocks() {
            let impulses = of(block, Quantity::Impulse);
            load = (0..LANES).fold(load, |load, lane| load + impulses.of(lane).sum);
        }
        let least = CONCENTRATION_MIN * load / legs as f64;
        for (block, cycles) in self.cycle.legs.chunks_mut(LANES).enumerate() {
            let [impulses, times, touch_downs] = [
                Quantity::Impulse,
                Quantity::ContactTime,
                Quantity::TouchDowns,
            ]
            .map(|quantity| of(block, quantity));
            for (lane, cycle) in cycles.iter_mut().enumerate() {
                let first = impulses.of(lane).first;
                *cycle = LegCycle {
                    phase: (first.norm() > least).then(|| wrap(-first.argument() / TAU)),
                    duty_factor: times.of(lane).sum / period_s,
                    contacts: touch_downs.of(lane).sum,
                };
            }
        }
        let duration =
            |seconds| SimDuration::try_from_secs_f64(seconds).unwrap_or(SimDuration::ZERO);
        self.cycle.centre = SimTime::ZERO + duration(centre_s);
        self.cycle.period = duration(period_s);
    }
}

/// Wraps a share of a cycle into [0, 1).
pub(crate) fn wrap(share: f64) -> f64 {
    let wrapped = share - libm::floor(share);
    if wrapped < 1.0 { wrapped } else { 0.0 }
}
