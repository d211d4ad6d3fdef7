//! Change of the trunk's state from cycle to cycle.

use twinrig_kernel::SimTime;

use super::transport::GRAVITY;
use crate::judge::tracker::seconds;

/// Differences between the states of the trunk at successive beginnings of a cycle: a return map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cycles {
    proposed: Option<(SimTime, State)>,
    last: Option<State>,
    /// Beginnings of the first and of the last cycle.
    span: Option<[SimTime; 2]>,
    /// Sum of the squares of the differences, and their number: that of whole cycles.
    squares: f64,
    number: u32,
    /// First height \[m\], the scale of heights.
    height: f64,
}

/// Height \[m\], roll and pitch \[rad\], and speed \[m/s\] of the trunk.
pub(super) type State = [f64; 4];

impl Cycles {
    /// Proposes a state for the beginning of a cycle; it takes the place of an unconfirmed one.
    pub fn propose(&mut self, now: SimTime, state: State) {
        self.proposed = Some((now, state));
    }

    /// Begins a cycle with the proposed state, if there is one.
    pub fn confirm(&mut self) {
        let Some((now, state)) = self.proposed.take() else {
            return;
        };
        self.span = Some([self.span.map_or(now, |[first, _]| first), now]);
        let Some(last) = self.last.replace(state) else {
            self.height = state[0];
            return;
        };
        let speed_scale = (GRAVITY * self.height.abs()).sqrt();
        let scales = [self.height, 1.0, 1.0, speed_scale];
        for ((now, before), scale) in state.iter().zip(last).zip(scales) {
            let change = (now - before) / scale;
            self.squares += change * change;
        }
        self.number += 1;
    }

    /// Returns the number of whole cycles, for a detail of a finding.
    pub fn detail(&self) -> String {
        match self.number {
            1 => "1 cycle".to_owned(),
            number => format!("{number} cycles"),
        }
    }

    /// Returns the frequency of the cycles \[Hz\]; none without a whole one.
    pub fn frequency(&self) -> Option<f64> {
        let [first, last] = self.span?;
        (self.number > 0).then(|| f64::from(self.number) / seconds(last - first))
    }

    /// Returns the root mean square of the changes; none without a whole cycle.
    pub fn residual(&self) -> Option<f64> {
        (self.number > 0).then(|| (self.squares / f64::from(self.number)).sqrt())
    }
}
