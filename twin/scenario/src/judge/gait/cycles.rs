//! Change of the trunk's state from cycle to cycle.

/// Differences between the states of the trunk at successive beginnings of a cycle: a return map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cycles {
    last: Option<[f64; 4]>,
    /// First height \[m\], the scale of heights.
    height: f64,
    squares: f64,
    pairs: u32,
}

/// Gravity in the scale of the speed \[m/s²\].
const GRAVITY: f64 = 9.81;

impl Cycles {
    /// Adds the state at the beginning of a cycle: height \[m\], roll and pitch \[rad\], speed
    /// \[m/s\].
    pub fn add(&mut self, height: f64, roll: f64, pitch: f64, speed: f64) {
        if self.last.is_none() {
            self.height = height;
        }
        let speed_scale = (GRAVITY * self.height.abs()).sqrt();
        let state = [height / self.height, roll, pitch, speed / speed_scale];
        if let Some(last) = self.last.replace(state) {
            let changes = state.iter().zip(last);
            self.squares += changes.map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            self.pairs += 1;
        }
    }

    /// Returns the number of pairs of successive cycles.
    pub fn pairs(&self) -> u32 {
        self.pairs
    }

    /// Returns the root mean square of the changes; none with less than two cycles.
    pub fn residual(&self) -> Option<f64> {
        (self.pairs > 0).then(|| (self.squares / f64::from(self.pairs)).sqrt())
    }
}
