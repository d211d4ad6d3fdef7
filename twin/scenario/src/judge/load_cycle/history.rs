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
    increments: Vec<f64>,
    /// Rows of sums, the quantities of each leg in a row: those at the last instants, those at the
    /// last sample, and those before the first one, which are zero.
    rows: Vec<f64>,
    /// Number of instants stored so far.
    count: usize,
}

/// Row of the sums at the last sample.
const LAST: usize = CAPACITY;
/// Row of the sums before the first sample.
const BEFORE: usize = CAPACITY + 1;

/// A time between two rows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Edge {
    before: usize,
    after: usize,
    share: f64,
}

impl History {
    pub fn new(legs: usize, thresholds: Thresholds) -> Self {
        let width = legs * QUANTITIES;
        History {
            thresholds,
            on_ground: vec![false; legs],
            start_s: 0.0,
            end: None,
            end_s: 0.0,
            increments: vec![0.0; width],
            rows: vec![0.0; width * (BEFORE + 1)],
            count: 0,
        }
    }

    /// Returns the number of legs.
    pub fn legs(&self) -> usize {
        self.on_ground.len()
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
        let legs = self.on_ground.iter_mut();
        let legs = legs.zip(self.increments.chunks_exact_mut(QUANTITIES));
        for (load, (on_ground, increments)) in loads.zip(legs) {
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
            increments[Quantity::Impulse as usize] = load * elapsed_s;
            increments[Quantity::ContactTime as usize] = if *on_ground { elapsed_s } else { 0.0 };
            increments[Quantity::TouchDowns as usize] = f64::from(u8::from(touches_down));
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
            for (sum, (last, increment)) in row.iter_mut().zip(sums.iter().zip(&self.increments)) {
                *sum = last + share * increment;
            }
            self.count += 1;
        }
        for (sum, increment) in sums.iter_mut().zip(&self.increments) {
            *sum += increment;
        }
    }

    /// Returns `N` equidistant times from `from_s` on.
    pub fn edges<const N: usize>(&self, from_s: f64, bin_s: f64) -> [Edge; N] {
        std::array::from_fn(|bin| self.edge(from_s + bin as f64 * bin_s))
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
            return edge(instant % CAPACITY, (instant + 1) % CAPACITY, share);
        }
        let last_s = (self.count - 1) as f64 * INTERVAL_S;
        let share = (at_s - last_s) / (self.end_s - last_s);
        edge((self.count - 1) % CAPACITY, LAST, share.clamp(0.0, 1.0))
    }

    /// Returns the increments of a quantity of a leg between successive times.
    pub fn increments(
        &self,
        edges: &[Edge],
        leg: usize,
        quantity: Quantity,
    ) -> impl Iterator<Item = f64> {
        let index = leg * QUANTITIES + quantity as usize;
        let sum = move |edge: &Edge| {
            let before = self.rows[edge.before + index];
            before + edge.share * (self.rows[edge.after + index] - before)
        };
        let mut edges = edges.iter();
        let mut before = edges.next().map_or(0.0, sum);
        edges.map(move |edge| {
            let after = sum(edge);
            let increment = after - before;
            before = after;
            increment
        })
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
