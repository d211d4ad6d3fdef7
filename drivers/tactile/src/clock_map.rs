use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, SimDuration};

/// Mapping of a board's stamps to host time, on line: offset and rate from arrivals.
///
/// A sample arrives a known transport time after its instant, and a delay later, which varies and
/// is never negative. The map is therefore the line below all arrivals that is highest in the
/// middle of their span (a linear program, whose solution is the edge of the lower convex hull
/// there). Each interval of 64 ms contributes its earliest point; points are forgotten after 8 s,
/// so that a drifting oscillator is followed.
///
/// **Error.** With delays of up to 2 ms, a tenth of the samples lost and clocks of ±200 ppm: below
/// 0.1 ms after two seconds, below 40 µs after ten; with delays of up to 50 µs, below 1 µs.
///
/// **Bias.** The smallest delay within 8 s is indistinguishable from transport: mapped times are
/// later than the true ones by it, never earlier by more than the error of the extrapolation over
/// half the interval.
///
/// ```
/// use twinrig_kernel::{HostTime, SimDuration};
/// use twinrig_tactile::ClockMap;
///
/// let mut map = ClockMap::new(SimDuration::from_micros(195));
/// // The stamp 0 is at 1 s; the board's clock is slow by 100 ppm.
/// for n in 0..10_000_u64 {
///     let sampled = 1_000_000_000 + n * 1_000_100;
///     let delay = if n % 7 == 0 { 0 } else { 400_000 };
///     let mapped = map.observe(n * 1_000, HostTime::from_nanos(sampled + 195_000 + delay));
///     if n > 2_000 {
///         assert!(mapped.as_nanos().abs_diff(sampled) < 1_000);
///     }
/// }
/// assert!((map.rate() + 100e-6).abs() < 1e-7);
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClockMap {
    transport: SimDuration,
    /// Stamp \[µs\] and host time \[ns\] of the first sample: zero of both axes.
    origin: Option<(u64, u64)>,
    /// Earliest points of complete intervals, in order of `board`.
    earliest: VecDeque<Point>,
    /// Number of the present interval, and its earliest point.
    present: Option<(f64, Point)>,
    line: Line,
    /// Stamp \[µs\] and mapped time \[ns\] of the newest sample.
    newest: (u64, u64),
    residual: f64,
    #[serde(skip)]
    hull: Vec<Point>,
}

/// A sample relative to the first.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Point {
    /// Time on the board's clock \[ns\].
    board: f64,
    /// Host time without transport, less `board` \[ns\].
    excess: f64,
}

/// Excess as a function of the board's time.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Line {
    through: Point,
    slope: f64,
}

/// Length of an interval \[ns\].
const INTERVAL: f64 = 64e6;
/// Age at which a point is forgotten \[ns\].
const HORIZON: f64 = 8e9;
/// Greatest number of points: the intervals of a horizon and the one that begins in it.
const POINTS: usize = 126;
/// Greatest deviation of a rate from nominal \[1\]. ASSUMED: more than that of any crystal. It
/// keeps the first second usable, in which the delays determine the rate to a few parts in a
/// thousand.
const SLOPE_MAX: f64 = 1e-3;
/// An arrival earlier than the line by more than this moves the line at once \[ns\].
const SLACK: f64 = 100.0;

impl Line {
    fn at(&self, board: f64) -> f64 {
        self.through.excess + self.slope * (board - self.through.board)
    }
}

impl ClockMap {
    /// Creates a map of a board whose samples arrive `transport` after their instant, at the
    /// earliest.
    pub fn new(transport: SimDuration) -> Self {
        Self {
            transport,
            origin: None,
            earliest: VecDeque::with_capacity(POINTS),
            present: None,
            line: Line::default(),
            newest: (0, 0),
            residual: 0.0,
            hull: Vec::with_capacity(POINTS + 1),
        }
    }

    /// Forgets all samples: the board has restarted.
    pub fn reset(&mut self) {
        self.origin = None;
        self.earliest.clear();
        self.present = None;
        self.line = Line::default();
    }

    /// Adds a sample with its stamp \[µs\], ascending, and its time of arrival; returns the time of
    /// the sample: strictly increasing, and not later than its arrival less transport, unless that
    /// of the sample before was.
    pub fn observe(&mut self, stamp_us: u64, arrived: HostTime) -> HostTime {
        let host = (arrived - self.transport).as_nanos();
        let (stamp_0, host_0) = *self.origin.get_or_insert((stamp_us, host));
        let board = signed_difference(stamp_us, stamp_0) * 1e3;
        let point = Point {
            board,
            excess: signed_difference(host, host_0) - board,
        };
        self.add(point);
        let excess = self.line.at(board).min(point.excess);
        self.residual = point.excess - excess;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a difference to an arrival, saturated"
        )]
        let early = (self.residual.round() as i64).unsigned_abs();
        let mapped = host.saturating_sub(early);
        let mapped = mapped.max(self.newest.1.saturating_add(1));
        self.newest = (stamp_us, mapped);
        HostTime::from_nanos(mapped)
    }

    /// Host time less board time at the newest sample \[s\].
    pub fn offset(&self) -> f64 {
        let (stamp, mapped) = self.newest;
        signed_difference(mapped, stamp.saturating_mul(1000)) * 1e-9
    }

    /// Relative error of the rate of the board's clock \[1\], positive if it is fast.
    pub fn rate(&self) -> f64 {
        -self.line.slope / (1.0 + self.line.slope)
    }

    /// Delay of the newest sample beyond transport \[s\].
    pub fn residual(&self) -> f64 {
        self.residual * 1e-9
    }

    fn add(&mut self, point: Point) {
        let interval = (point.board / INTERVAL).floor();
        match &mut self.present {
            Some((present, earliest)) if *present == interval => {
                let (line, above) = (self.line, point.excess - earliest.excess);
                if above < line.slope * (point.board - earliest.board) {
                    *earliest = point;
                }
                if point.excess < line.at(point.board) - SLACK {
                    self.fit();
                }
            }
            _ => {
                if let Some((_, earliest)) = self.present.replace((interval, point)) {
                    self.keep(earliest);
                }
                self.fit();
            }
        }
    }

    /// Keeps the earliest point of a complete interval.
    fn keep(&mut self, earliest: Point) {
        let old = |point: &Point| earliest.board - point.board > HORIZON;
        while self.earliest.len() >= POINTS || self.earliest.front().is_some_and(old) {
            self.earliest.pop_front();
        }
        self.earliest.push_back(earliest);
    }

    /// Fits the line to the points.
    fn fit(&mut self) {
        let hull = &mut self.hull;
        hull.clear();
        let present = self.present.iter().map(|(_, point)| point);
        for &point in self.earliest.iter().chain(present) {
            // A vertex above the chord of its neighbours is not on the lower hull.
            while let [.., a, b] = hull[..]
                && (b.excess - a.excess) * (point.board - a.board)
                    >= (point.excess - a.excess) * (b.board - a.board)
            {
                hull.pop();
            }
            hull.push(point);
        }
        let [first, .., last] = hull[..] else {
            let through = hull.first().copied().unwrap_or_default();
            self.line = Line {
                through,
                slope: 0.0,
            };
            return;
        };
        let middle = f64::midpoint(first.board, last.board);
        let edge = hull.windows(2).find(|edge| edge[1].board >= middle);
        let Some(&[a, b]) = edge else {
            return;
        };
        let slope = (b.excess - a.excess) / (b.board - a.board);
        if slope.is_nan() {
            return;
        }
        let slope = slope.clamp(-SLOPE_MAX, SLOPE_MAX);
        // With a limited slope another vertex may be the lowest.
        let below = |point: &Point| point.excess - slope * point.board;
        let lowest = hull.iter().copied();
        let lowest = lowest.min_by(|p, q| below(p).total_cmp(&below(q)));
        self.line = Line {
            through: lowest.unwrap_or(a),
            slope,
        };
    }
}

/// Difference of two unsigned numbers.
fn signed_difference(a: u64, b: u64) -> f64 {
    let size = a.abs_diff(b) as f64;
    if a < b { -size } else { size }
}
