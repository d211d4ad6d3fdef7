//! How far one run lags behind another, in the course of time: the delay that all legs have in common.
//!
//! A gait is periodic, so the footsteps of one leg match those of another run at every multiple of a stride, and a single
//! extra footstep is enough to prefer the wrong multiple for the rest of the run. The lag D(t) is therefore estimated from
//! all legs together, before any footsteps are paired. Time is divided into bins of one stride S, the lag into cells of 1/16
//! stride. In each bin the lag changes by a rate r of whole cells, which it keeps, and by a jitter j of −1, 0 or 1 cells:
//! dₙ = dₙ₋₁ + rₙ + jₙ. The path of least
//!
//! ```text
//! N (κ₀ (d₀/S)² + κ_r |r₀|)  +  N Σ_n (κ_r |rₙ − rₙ₋₁| + κ_j |jₙ|)  +  ½ Σ_footsteps min(c, distance/S)
//! ```
//!
//! is found by dynamic programming (Viterbi), with N legs, and the distance of a footstep of either run from the nearest one
//! of its leg in the other, which is shifted by the lag. The terms are chosen so that
//!
//! - the distance saturates: a footstep that the other run does not have costs c/2 = 0.1 once, whatever the lag is;
//! - a steady rate costs nothing: a run that falls behind by 10 % is followed for as many strides as it takes;
//! - to get to another multiple of the stride costs a leg at least 3, whether in a few bins, for the changes of the rate, or
//!   in many, for the footsteps that do not match meanwhile: as much as thirty footsteps without a partner;
//! - both runs begin together: d₀ is near 0 unless the footsteps of all legs say otherwise.

use core::ops::Range;

use super::footstep::RecordedFootstep;
use super::median::median;

/// The footsteps of a leg in both runs, in order of time.
pub(super) type Leg<'a> = [&'a [RecordedFootstep]; 2];

/// Cells of the lag in a stride.
const CELLS: i32 = 16;

/// How far the lag can be from the best known one of the bin before, in cells.
const REACH: i32 = 2 * CELLS;

/// The highest rate, in cells a bin: 25 %.
const RATE_MAX: i32 = CELLS / 4;

/// How many rates there are.
const RATES: i32 = 2 * RATE_MAX + 1;

/// `κ₀`: the cost for a leg to begin a stride apart.
const START: f64 = 1.0;

/// `κ_r`: the cost for a leg to change the rate by one cell a bin.
const RATE: f64 = 0.75;

/// `κ_j`: the cost for a leg to be off the rate by one cell.
const JITTER: f64 = 0.05;

/// c: the distance above which a footstep does not matter to the lag, in strides.
const SATURATED: f64 = 0.2;

/// The lag of the second run behind the first, as a function of the time of the first; straight between knots, constant
/// before the first and behind the last.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Lag {
    /// Times of the first run, rising, and the lag there \[s\].
    knots: Vec<[f64; 2]>,
}

impl Lag {
    /// The lag of the second run of these legs, whose common stride is `stride` \[s\].
    pub(super) fn between(legs: &[Leg<'_>], stride: f64) -> Self {
        let steps = legs.iter().flat_map(|leg| leg[0]);
        let mut times: Vec<f64> = steps.map(|step| step.touch_down_s).collect();
        times.sort_by(f64::total_cmp);
        let Some(&first) = times.first() else {
            return Self::default();
        };
        // Bins in which the first run has no footstep are left out: a pause costs nothing.
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

    /// The same without the rounding to cells: at each knot the median lag of the touch-downs and lift-offs that are within
    /// a stride of it, of footsteps that were paired by this lag.
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

    /// The lag at a time of the first run \[s\].
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

/// The search for the path.
struct Search<'a> {
    legs: &'a [Leg<'a>],
    /// S \[s\].
    stride: f64,
}

/// Where a path is in a bin.
#[derive(Debug, Clone, Copy)]
struct State {
    cell: i32,
    rate: i32,
}

/// The states that are searched in a bin, by cell, then by rate, and the cheapest paths to them.
struct Bin {
    /// The lowest cell.
    lowest: i32,
    /// What the cheapest path to each state costs.
    costs: Vec<f64>,
    /// The jitter by which it got there from the bin before.
    jitters: Vec<i8>,
    /// By how much its rate changes, if it ends in the bin behind with the rate of the state.
    changes: Vec<i8>,
}

/// The place of a state among those of a bin; none if it is not searched.
fn place(lowest: i32, state: State) -> Option<usize> {
    let known = state.rate.abs() <= RATE_MAX && state.cell <= lowest + 2 * REACH;
    let place = (state.cell - lowest) * RATES + state.rate + RATE_MAX;
    usize::try_from(place).ok().filter(|_| known)
}

fn states(lowest: i32) -> impl Iterator<Item = State> {
    let rates = |cell| (-RATE_MAX..=RATE_MAX).map(move |rate| State { cell, rate });
    (lowest..=lowest + 2 * REACH).flat_map(rates)
}

/// The least of three costs, by a move of 0, 1 or −1 that costs `by`, and that move; of several 0.
fn cheapest(stay: f64, up: f64, down: f64, by: f64) -> (f64, i8) {
    let moved = if down < up { (down, -1) } else { (up, 1) };
    if moved.0 + by < stay {
        (moved.0 + by, moved.1)
    } else {
        (stay, 0)
    }
}

impl Bin {
    /// The end of the cheapest path; of several the one nearest to no lag.
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

    /// What the cheapest paths cost that leave each cell with each rate, which may be a new one.
    fn turned(&mut self, price: f64) -> Vec<f64> {
        const LAST: usize = (RATES - 1) as usize;
        let cells = self.costs.chunks_exact(LAST + 1);
        let turned = cells.flat_map(|rates| {
            (0..=LAST).map(|rate| {
                let up = rate
                    .checked_sub(1)
                    .map_or(f64::INFINITY, |from| rates[from]);
                let down = rates.get(rate + 1).copied().unwrap_or(f64::INFINITY);
                cheapest(rates[rate], up, down, price)
            })
        });
        let (costs, changes) = turned.unzip();
        self.changes = changes;
        costs
    }

    /// The jitter by which the cheapest path got to a state of this bin.
    fn jitter(&self, state: State) -> i32 {
        let jitter = place(self.lowest, state).and_then(|place| self.jitters.get(place));
        jitter.copied().map_or(0, i32::from)
    }

    /// The change of the rate of the cheapest path that leaves this bin at a cell with a rate.
    fn change(&self, leaves: State) -> i32 {
        let change = place(self.lowest, leaves).and_then(|place| self.changes.get(place));
        change.copied().map_or(0, i32::from)
    }
}

impl<'a> Search<'a> {
    /// The cell of each bin on the cheapest path; of bins that begin at these times of the first run \[s\].
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
        let lowest = before.as_ref().map_or(0, |bin| bin.best().cell) - REACH;
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
        let cost = START * strides * strides + RATE * f64::from(state.rate.abs());
        self.legs.len() as f64 * cost
    }

    /// The cheapest ways to the states of a bin from the bin before, and their jitters.
    fn arrivals(&self, lowest: i32, before: &mut Bin) -> (Vec<f64>, Vec<i8>) {
        let legs = self.legs.len() as f64;
        let turned = before.turned(legs * RATE);
        let leaves = |state: State, jitter: i32| {
            let cell = state.cell - state.rate - jitter;
            let place = place(before.lowest, State { cell, ..state });
            let cost = place.and_then(|place| turned.get(place));
            cost.copied().unwrap_or(f64::INFINITY)
        };
        let arrival = |state| {
            let [stay, up, down] = [0, 1, -1].map(|jitter| leaves(state, jitter));
            cheapest(stay, up, down, legs * JITTER)
        };
        states(lowest).map(arrival).unzip()
    }

    /// How badly the footsteps of the bin that begins at a time of the first run match at a lag \[s\].
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

    /// The footsteps that any lag of a bin compares: of the first run those about the bin, of the second those about the bin
    /// at every lag.
    fn near(&self, begin: f64, lowest: i32) -> Vec<Leg<'a>> {
        let margin = (1.0 + 2.0 * SATURATED) * self.stride;
        let [first, last] = [lowest, lowest + 2 * REACH].map(|cell| self.seconds(cell));
        let about = |lags: [f64; 2]| [begin + lags[0] - margin, begin + lags[1] + 2.0 * margin];
        let spans = [about([0.0; 2]), about([first, last])];
        let legs = self.legs.iter();
        let near = legs.map(|leg| [0, 1].map(|run| &leg[run][within(leg[run], spans[run])]));
        near.collect()
    }

    /// How far a footstep, shifted, is from the nearest of the other run, in strides; at most [`SATURATED`].
    fn distance(&self, step: &RecordedFootstep, other: &[RecordedFootstep], shift: f64) -> f64 {
        // The distance is the mean of two, so either is at most twice that.
        let reach = 2.0 * SATURATED * self.stride;
        let expected = step.touch_down_s + shift;
        let near = &other[within(other, [expected - reach, expected + reach])];
        let distances = near.iter().map(|other| distance(step, other, shift));
        distances.fold(SATURATED * self.stride, f64::min) / self.stride
    }

    fn seconds(&self, cell: i32) -> f64 {
        f64::from(cell) / f64::from(CELLS) * self.stride
    }
}

/// How far apart two footsteps are, the first shifted: the mean of touch-down and lift-off \[s\].
pub(super) fn distance(a: &RecordedFootstep, b: &RecordedFootstep, shift: f64) -> f64 {
    let touch_down = b.touch_down_s - a.touch_down_s - shift;
    let lift_off = b.lift_off_s - a.lift_off_s - shift;
    0.5 * (touch_down.abs() + lift_off.abs())
}

/// Which footsteps come down in a span of time, which does not include its end \[s\].
pub(super) fn within(steps: &[RecordedFootstep], [begin, end]: [f64; 2]) -> Range<usize> {
    let from = steps.partition_point(|step| step.touch_down_s < begin);
    let to = steps.partition_point(|step| step.touch_down_s < end);
    from..to.max(from)
}
