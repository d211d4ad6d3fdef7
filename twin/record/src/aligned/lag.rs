//! Lag of one run behind another as a function of time, common to all legs.
//!
//! A gait is periodic: the footsteps of a leg match those of another run at every multiple of a
//! stride, and a single extra footstep is enough to select the wrong multiple for the rest of the
//! run. The lag D(t) is therefore estimated from all legs together, before footsteps are paired.
//! Time is divided into bins of one stride S, the lag into cells of 1/16 stride. From bin to bin
//! the lag changes by a persistent rate r of whole cells and by a jitter j of −1, 0 or 1 cells:
//! dₙ = dₙ₋₁ + rₙ + jₙ. The path that minimises
//!
//! ```text
//! N (κ₀ (d₀/S)² + κ_r |r₀|)  +  N Σ_n (κ_r |rₙ − rₙ₋₁| + κ_j |jₙ|)
//!                            +  ½ Σ_footsteps min(c, distance/S)
//! ```
//!
//! is found by dynamic programming (Viterbi). N is the number of legs; the distance is that of a
//! footstep of either run from the nearest footstep of the same leg in the other, shifted by the
//! lag. The terms have the following properties:
//!
//! - the distance saturates: a footstep without a counterpart costs c/2 = 0.1 once, at any lag;
//! - a constant rate costs nothing: a run that falls behind by 10 % is followed over any number of
//!   strides;
//! - a change to another multiple of the stride costs a leg at least 3, either within a few bins,
//!   for the changes of the rate, or over many, for the footsteps that do not match meanwhile: as
//!   much as thirty footsteps without a counterpart;
//! - both runs begin together: d₀ is near 0 unless the footsteps of all legs contradict it.

use core::ops::Range;

use super::footstep::RecordedFootstep;
use super::median::median;

/// Footsteps of a leg in both runs, in order of time.
pub(super) type Leg<'a> = [&'a [RecordedFootstep]; 2];

/// Cells of the lag per stride.
const CELLS: i32 = 16;

/// Maximum change of the lag from the best one of the previous bin, in cells.
const LAG_CHANGE_MAX: i32 = 2 * CELLS;

/// Maximum rate, in cells per bin: 25 %.
const RATE_MAX: i32 = CELLS / 4;

/// Number of rates.
const RATES: i32 = 2 * RATE_MAX + 1;

/// `κ₀`: cost per leg of an initial lag of one stride.
const START_COST: f64 = 1.0;

/// `κ_r`: cost per leg of a rate change of one cell per bin.
const RATE_COST: f64 = 0.75;

/// `κ_j`: cost per leg of a jitter of one cell.
const JITTER_COST: f64 = 0.05;

/// c: saturation of the distance of a footstep, in strides.
const DISTANCE_MAX: f64 = 0.2;

/// Lag of the second run behind the first, as a function of the time of the first; linear between
/// knots, constant before the first and after the last.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Lag {
    /// Times of the first run, increasing, and the lag at each \[s\].
    knots: Vec<[f64; 2]>,
}

impl Lag {
    /// Estimates the lag of the second run for `legs`, whose common stride is `stride` \[s\].
    pub(super) fn between(legs: &[Leg<'_>], stride: f64) -> Self {
        let steps = legs.iter().flat_map(|leg| leg[0]);
        let mut times: Vec<f64> = steps.map(|step| step.touch_down_s).collect();
        times.sort_by(f64::total_cmp);
        let Some(&first) = times.first() else {
            return Self::default();
        };
        // Bins without a footstep in the first run are omitted, so that a pause costs nothing.
        let mut begins: Vec<f64> = times
            .iter()
            .map(|time| first + libm::floor((time - first) / stride) * stride)
            .collect();
        begins.dedup();
        let search = Search { legs, stride };
        let cells = search.path(&begins);
        let knots = begins
            .iter()
            .zip(cells)
            .map(|(begin, cell)| [begin + 0.5 * stride, search.seconds(cell)]);
        Self {
            knots: knots.collect(),
        }
    }

    /// Removes the rounding to cells: the lag at each knot becomes the median over the touch-downs
    /// and lift-offs, within one stride, of the footsteps paired with this lag.
    pub(super) fn refined(
        mut self,
        pairs: impl Iterator<Item = [RecordedFootstep; 2]>,
        stride: f64,
    ) -> Self {
        let mut lags: Vec<[f64; 2]> = pairs
            .flat_map(|[a, b]| {
                let lags = [b.touch_down_s - a.touch_down_s, b.lift_off_s - a.lift_off_s];
                lags.map(|lag| [a.touch_down_s, lag])
            })
            .collect();
        lags.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for [time, lag] in &mut self.knots {
            let from = lags.partition_point(|near| near[0] < *time - stride);
            let to = lags.partition_point(|near| near[0] <= *time + stride);
            let near: Vec<f64> = lags[from..to.max(from)]
                .iter()
                .map(|near| near[1])
                .collect();
            *lag = median(&near).unwrap_or(*lag);
        }
        self
    }

    /// Returns the lag at a time of the first run \[s\].
    pub(super) fn at(&self, time: f64) -> f64 {
        let behind = self.knots.partition_point(|knot| knot[0] <= time);
        let before = behind.checked_sub(1).and_then(|n| self.knots.get(n));
        match (before, self.knots.get(behind)) {
            (Some([from, lag]), Some([to, next])) => {
                lag + (time - from) / (to - from) * (next - lag)
            }
            (Some([_, lag]), None) | (None, Some([_, lag])) => *lag,
            (None, None) => 0.0,
        }
    }
}

/// Dynamic programme over bins, cells and rates.
struct Search<'a> {
    legs: &'a [Leg<'a>],
    /// Stride S \[s\].
    stride: f64,
}

/// State of a path in a bin.
#[derive(Debug, Clone, Copy)]
struct State {
    cell: i32,
    rate: i32,
}

/// Searched states of a bin, by cell, then by rate, with the minimum-cost paths to them.
struct Bin {
    /// Lowest cell.
    lowest: i32,
    /// Cost of the cheapest path to each state.
    costs: Vec<f64>,
    /// Jitter of the last transition of that path.
    jitters: Vec<i8>,
    /// Rate change of the cheapest path that leaves each cell with each rate.
    changes: Vec<i8>,
}

/// Returns the index of a state within a bin; `None` if the state is not searched.
fn state_index(lowest: i32, state: State) -> Option<usize> {
    let known = state.rate.abs() <= RATE_MAX && state.cell <= lowest + 2 * LAG_CHANGE_MAX;
    let index = (state.cell - lowest) * RATES + state.rate + RATE_MAX;
    usize::try_from(index).ok().filter(|_| known)
}

fn states(lowest: i32) -> impl Iterator<Item = State> {
    let rates = |cell| (-RATE_MAX..=RATE_MAX).map(move |rate| State { cell, rate });
    (lowest..=lowest + 2 * LAG_CHANGE_MAX).flat_map(rates)
}

/// Returns the least of three costs, where the moves 1 and −1 cost `by` in addition, and the
/// move; 0 on a tie.
fn cheapest(stay: f64, up: f64, down: f64, by: f64) -> (f64, i8) {
    let best_move = if down < up { (down, -1) } else { (up, 1) };
    if best_move.0 + by < stay {
        (best_move.0 + by, best_move.1)
    } else {
        (stay, 0)
    }
}

impl Bin {
    /// Returns the end of the cheapest path; on a tie the one with the smallest lag.
    fn best(&self) -> State {
        let all = states(self.lowest).zip(&self.costs);
        let best = all.reduce(|best, next| {
            let nearer = next.1 == best.1 && next.0.cell.abs() < best.0.cell.abs();
            if next.1 < best.1 || nearer {
                next
            } else {
                best
            }
        });
        best.map_or(State { cell: 0, rate: 0 }, |(state, _)| state)
    }

    /// Returns the costs of the cheapest paths that leave each cell with each rate, after an
    /// optional rate change.
    fn leaving_costs(&mut self, change_cost: f64) -> Vec<f64> {
        const LAST: usize = (RATES - 1) as usize;
        let cells = self.costs.chunks_exact(LAST + 1);
        let leaving_costs = cells.flat_map(|rates| {
            (0..=LAST).map(|rate| {
                let up = rate
                    .checked_sub(1)
                    .map_or(f64::INFINITY, |from| rates[from]);
                let down = rates.get(rate + 1).copied().unwrap_or(f64::INFINITY);
                cheapest(rates[rate], up, down, change_cost)
            })
        });
        let (costs, changes) = leaving_costs.unzip();
        self.changes = changes;
        costs
    }

    /// Returns the jitter of the cheapest path to `state` of this bin.
    fn jitter(&self, state: State) -> i32 {
        let jitter = state_index(self.lowest, state).and_then(|index| self.jitters.get(index));
        jitter.copied().map_or(0, i32::from)
    }

    /// Returns the rate change of the cheapest path that leaves this bin in the state `leaves`.
    fn change(&self, leaves: State) -> i32 {
        let change = state_index(self.lowest, leaves).and_then(|index| self.changes.get(index));
        change.copied().map_or(0, i32::from)
    }
}

impl<'a> Search<'a> {
    /// Returns the cell of each bin on the cheapest path; the bins begin at `begins` \[s\] in the
    /// first run.
    fn path(&self, begins: &[f64]) -> Vec<i32> {
        let mut bins: Vec<Bin> = Vec::with_capacity(begins.len());
        for &begin in begins {
            let bin = self.bin(begin, bins.last_mut());
            bins.push(bin);
        }
        let mut path = Vec::with_capacity(bins.len());
        let mut state = bins.last().map_or(State { cell: 0, rate: 0 }, Bin::best);
        for (n, bin) in bins.iter().enumerate().rev() {
            path.push(state.cell);
            state.cell -= state.rate + bin.jitter(state);
            let before = n.checked_sub(1).and_then(|n| bins.get(n));
            state.rate -= before.map_or(0, |before| before.change(state));
        }
        path.reverse();
        path
    }

    fn bin(&self, begin: f64, before: Option<&mut Bin>) -> Bin {
        let lowest = before.as_ref().map_or(0, |bin| bin.best().cell) - LAG_CHANGE_MAX;
        let near = self.near(begin, lowest);
        let (mut costs, jitters): (Vec<f64>, Vec<i8>) = match before {
            None => states(lowest).map(|state| (self.start(state), 0)).unzip(),
            Some(before) => self.arrivals(lowest, before),
        };
        for (cell, rates) in (lowest..).zip(costs.chunks_exact_mut(RATES as usize)) {
            let mismatch = self.mismatch(&near, begin, self.seconds(cell));
            for cost in rates {
                *cost += mismatch;
            }
        }
        Bin {
            lowest,
            costs,
            jitters,
            changes: Vec::new(),
        }
    }

    fn start(&self, state: State) -> f64 {
        let strides = f64::from(state.cell) / f64::from(CELLS);
        let cost = START_COST * strides * strides + RATE_COST * f64::from(state.rate.abs());
        self.legs.len() as f64 * cost
    }

    /// Returns the costs of the cheapest paths to the states of a bin from the previous one, and
    /// their jitters.
    fn arrivals(&self, lowest: i32, before: &mut Bin) -> (Vec<f64>, Vec<i8>) {
        let legs = self.legs.len() as f64;
        let leaving_costs = before.leaving_costs(legs * RATE_COST);
        let leaves = |state: State, jitter: i32| {
            let cell = state.cell - state.rate - jitter;
            let index = state_index(before.lowest, State { cell, ..state });
            let cost = index.and_then(|index| leaving_costs.get(index));
            cost.copied().unwrap_or(f64::INFINITY)
        };
        let arrival = |state| {
            let [stay, up, down] = [0, 1, -1].map(|jitter| leaves(state, jitter));
            cheapest(stay, up, down, legs * JITTER_COST)
        };
        states(lowest).map(arrival).unzip()
    }

    /// Returns the footstep mismatch at `lag` \[s\] of the bin that begins at `begin` in the first
    /// run.
    fn mismatch(&self, near: &[Leg<'_>], begin: f64, lag: f64) -> f64 {
        let span = [begin, begin + self.stride];
        let of_run = |steps: &[RecordedFootstep], other: &[RecordedFootstep], shift: [f64; 2]| {
            let steps = &steps[within(steps, span.map(|time| time + shift[0]))];
            let distances = steps
                .iter()
                .map(|step| self.distance(step, other, shift[1]));
            distances.sum::<f64>()
        };
        let of_leg = |[a, b]: &Leg<'_>| of_run(a, b, [0.0, lag]) + of_run(b, a, [lag, -lag]);
        0.5 * near.iter().map(of_leg).sum::<f64>()
    }

    /// Returns the footsteps that any lag of a bin can compare: of the first run those around the
    /// bin, of the second those around the bin at every searched lag.
    fn near(&self, begin: f64, lowest: i32) -> Vec<Leg<'a>> {
        let margin = (1.0 + 2.0 * DISTANCE_MAX) * self.stride;
        let [first, last] = [lowest, lowest + 2 * LAG_CHANGE_MAX].map(|cell| self.seconds(cell));
        let about = |lags: [f64; 2]| [begin + lags[0] - margin, begin + lags[1] + 2.0 * margin];
        let spans = [about([0.0; 2]), about([first, last])];
        let legs = self.legs.iter();
        let near = legs.map(|leg| [0, 1].map(|run| &leg[run][within(leg[run], spans[run])]));
        near.collect()
    }

    /// Returns the distance of a shifted footstep from the nearest of the other run, in strides; at
    /// most [`DISTANCE_MAX`].
    fn distance(&self, step: &RecordedFootstep, other: &[RecordedFootstep], shift: f64) -> f64 {
        // The distance is the mean of two, so each of them is at most twice that.
        let reach = 2.0 * DISTANCE_MAX * self.stride;
        let expected = step.touch_down_s + shift;
        let near = &other[within(other, [expected - reach, expected + reach])];
        let distances = near.iter().map(|other| distance(step, other, shift));
        distances.fold(DISTANCE_MAX * self.stride, f64::min) / self.stride
    }

    fn seconds(&self, cell: i32) -> f64 {
        f64::from(cell) / f64::from(CELLS) * self.stride
    }
}

/// Returns the distance of two footsteps, the first shifted: mean of the absolute differences of
/// touch-down and lift-off \[s\].
pub(super) fn distance(a: &RecordedFootstep, b: &RecordedFootstep, shift: f64) -> f64 {
    let touch_down = b.touch_down_s - a.touch_down_s - shift;
    let lift_off = b.lift_off_s - a.lift_off_s - shift;
    0.5 * (touch_down.abs() + lift_off.abs())
}

/// Returns the index range of the footsteps that touch down within `[begin, end)` \[s\].
pub(super) fn within(steps: &[RecordedFootstep], [begin, end]: [f64; 2]) -> Range<usize> {
    let from = steps.partition_point(|step| step.touch_down_s < begin);
    let to = steps.partition_point(|step| step.touch_down_s < end);
    from..to.max(from)
}
