//! Loads of the last seconds, as sums since the start.

use twinrig_kernel::SimTime;

use crate::judge::footstep::Thresholds;

/// Interval of the stored sums \[ns\]: a tenth of the shortest period.
const INTERVAL_NS: u64 = 10_000_000;
const INTERVAL_S: f64 = INTERVAL_NS as f64 * 1e-9;
/// Number of stored instants: the time up to which a cycle is found, and two and a half periods
/// before, as its centre may be half a period before the time about which it is searched.
const CAPACITY: usize = 2752;
/// Time that the stored instants span \[s\].
pub(super) const SPAN_S: f64 = CAPACITY as f64 * INTERVAL_S;

/// Quantity of a leg that is summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Integral of the load \[N·s\].
    Impulse,
    /// Time on the ground \[s\].
    ContactTime,
    /// Number of touch-downs.
    TouchDowns,
}

/// Number of quantities.
const QUANTITIES: usize = 3;
/// Number of legs whose sums are computed together.
pub(super) const LANES: usize = 4;

/// A value of each leg of a block.
pub(super) type Lanes = [f64; LANES];

/// Sums of all legs at multiples of an interval, linear between them.
#[derive(Clone, Debug)]
pub(super) struct History {
    thresholds: Thresholds,
    on_ground: Vec<bool>,
    start_s: f64,
    /// Time of the last sample.
    end: Option<SimTime>,
    end_s: f64,
    /// Increments of the last sample.
    increments: Vec<Lanes>,
    /// Rows of sums, all blocks of legs of each quantity in a row: those at the last instants,
    /// those at the last sample, and those before the first one, which are zero.
    rows: Vec<Lanes>,
    /// Number of instants stored so far.
    count: usize,
}

/// Row of the sums at the last sample.
const LAST: usize = CAPACITY;
/// Row of the sums before the first sample.
const BEFORE: usize = CAPACITY + 1;

/// A bin of the loads.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bin {
    /// Its begin.
    edge: Edge,
    pub increments: Lanes,
}

/// A time between two rows.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    before: usize,
    after: usize,
    share: f64,
}

impl History {
    pub fn new(legs: usize, thresholds: Thresholds) -> Self {
        let width = legs.div_ceil(LANES) * QUANTITIES;
        History {
            thresholds,
            on_ground: vec![false; legs],
            start_s: 0.0,
            end: None,
            end_s: 0.0,
            increments: vec![[0.0; LANES]; width],
            rows: vec![[0.0; LANES]; width * (BEFORE + 1)],
            count: 0,
        }
    }

    /// Returns the number of legs.
    pub fn legs(&self) -> usize {
        self.on_ground.len()
    }

    /// Returns the number of blocks of legs.
    pub fn blocks(&self) -> usize {
        self.legs().div_ceil(LANES)
    }

    /// Returns the time of the first sample \[s\].
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Returns the time of the last sample \[s\].
    pub fn end_s(&self) -> f64 {
        self.end_s
    }

    /// Adds the mean loads since the last sample. The load of a foot off the ground counts as none,
    /// as one that is not finite.
    pub fn sample(&mut self, now: SimTime, loads: impl Iterator<Item = f64>) {
        let Some(last) = self.end.replace(now) else {
            (self.start_s, self.end_s) = (now.as_secs_f64(), now.as_secs_f64());
            // Nothing happened before the first sample.
            self.count = instant(now.as_secs_f64()) + 1;
            for (load, on_ground) in loads.zip(&mut self.on_ground) {
                *on_ground = load >= self.thresholds.touch_down;
            }
            return;
        };
        self.end_s = now.as_secs_f64();
        let elapsed_s = (now - last).as_secs_f64();
        let blocks = self.blocks();
        for (leg, (load, on_ground)) in loads.zip(&mut self.on_ground).enumerate() {
            let was_on_ground = *on_ground;
            *on_ground = if was_on_ground {
                load >= self.thresholds.lift_off
            } else {
                load >= self.thresholds.touch_down
            };
            let load = if *on_ground && load.is_finite() {
                load
            } else {
                0.0
            };
            let touches_down = *on_ground && !was_on_ground;
            let mut put = |quantity: Quantity, increment: f64| {
                let place = quantity as usize * blocks + leg / LANES;
                self.increments[place][leg % LANES] = increment;
            };
            put(Quantity::Impulse, load * elapsed_s);
            put(
                Quantity::ContactTime,
                if *on_ground { elapsed_s } else { 0.0 },
            );
            put(Quantity::TouchDowns, f64::from(u8::from(touches_down)));
        }
        self.store(last, now);
    }

    /// Stores the sums at the instants after `last` up to `now`, and at `now`.
    fn store(&mut self, last: SimTime, now: SimTime) {
        let width = self.increments.len();
        let (rows, sums) = self.rows.split_at_mut(LAST * width);
        let sums = &mut sums[..width];
        let elapsed = (now - last).as_nanos() as f64;
        let next = |count: usize| count as u64 * INTERVAL_NS;
        while next(self.count) <= now.as_nanos() {
            let since_last = next(self.count) - last.as_nanos();
            let share = since_last as f64 / elapsed;
            let row = self.count % CAPACITY * width;
            let row = &mut rows[row..row + width];
            for (sums, (last, increments)) in row.iter_mut().zip(sums.iter().zip(&self.increments))
            {
                *sums = std::array::from_fn(|lane| last[lane] + share * increments[lane]);
            }
            self.count += 1;
        }
        for (sums, increments) in sums.iter_mut().zip(&self.increments) {
            *sums = std::array::from_fn(|lane| sums[lane] + increments[lane]);
        }
    }

    fn edge(&self, at_s: f64) -> Edge {
        let width = self.increments.len();
        let edge = |before: usize, after: usize, share: f64| Edge {
            before: before * width,
            after: after * width,
            share,
        };
        if at_s <= self.start_s {
            return edge(BEFORE, BEFORE, 0.0);
        }
        if at_s >= self.end_s {
            return edge(LAST, LAST, 0.0);
        }
        let instant = instant(at_s);
        if instant + 1 < self.count {
            let share = at_s / INTERVAL_S - instant as f64;
            let before = instant % CAPACITY;
            let after = if before + 1 < CAPACITY { before + 1 } else { 0 };
            return edge(before, after, share);
        }
        let last_s = (self.count - 1) as f64 * INTERVAL_S;
        let share = (at_s - last_s) / (self.end_s - last_s);
        edge((self.count - 1) % CAPACITY, LAST, share.clamp(0.0, 1.0))
    }

    /// Sets the bins between equidistant times from `from_s` on.
    pub fn set_edges(&self, bins: &mut [Bin], from_s: f64, bin_s: f64) {
        for (index, bin) in bins.iter_mut().enumerate() {
            bin.edge = self.edge(from_s + index as f64 * bin_s);
        }
    }

    /// Sets the increments of a quantity of a block of legs in each bin but the last.
    pub fn set_increments(&self, bins: &mut [Bin], block: usize, quantity: Quantity) {
        let index = quantity as usize * self.blocks() + block;
        let sums = |edge: &Edge| -> Lanes {
            let (before, after) = (
                self.rows[edge.before + index],
                self.rows[edge.after + index],
            );
            std::array::from_fn(|lane| before[lane] + edge.share * (after[lane] - before[lane]))
        };
        let mut after = bins.last().map_or([0.0; LANES], |bin| sums(&bin.edge));
        for bin in bins.iter_mut().rev().skip(1) {
            let before = sums(&bin.edge);
            bin.increments = std::array::from_fn(|lane| after[lane] - before[lane]);
            after = before;
        }
    }
}

/// Returns the last instant at or before a time.
fn instant(at_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a time since the start"
    )]
    let instant = (at_s / INTERVAL_S) as usize;
    instant
}
