use serde::{Deserialize, Serialize};

use crate::assumed::OVERFLOW_BUFFER;

/// Positions of the two motors in the board's fixed-point format: counts × 2^[`FRACTION_BITS`].
pub(crate) type Point = [i32; 2];

/// Fractional bits of a position.
pub(crate) const FRACTION_BITS: u32 = 8;

/// Minimum interpolation period \[ticks\]: one tick must remain when one is removed (thesis,
/// section 5.3.3).
pub(crate) const PERIOD_MIN: u16 = 2;

/// Interpolation of periodic set-points to one set-point per tick (thesis, section 5.3.3).
///
/// A *segment* leads from the present set-point to the next received point at constant speed within
/// one period. At its end the next point is taken from the buffer:
///
/// - more points are in the buffer: this segment is one tick shorter, a *filled-buffer step*;
/// - the buffer is empty: the set-point is extrapolated at half its last speed, a *missed point*,
///   repeatedly until a point is received. The first tick after that begins a new segment
///   immediately: the clock of the interpolation is reset.
///
/// Every point takes its period, less one tick for a filled-buffer step; with periods of two ticks
/// every missed point takes one tick more, provided that no point is more than a tick late. The
/// counters therefore measure the clock mismatch of both ends: filled − missed = mismatch × points
/// × 2.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Interpolator {
    period: u16,
    heuristics: bool,
    /// Maximum displacement per tick.
    step_max: [i32; 2],
    queue: Buffer,
    state: State,
    from: Point,
    to: Point,
    /// Ticks of this segment.
    length: u16,
    /// Elapsed ticks of this segment.
    done: u16,
    at: Point,
    counts: SmoothCounts,
}

/// Counts of irregular points since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SmoothCounts {
    /// Points that were not available at their deadline.
    pub missed: u64,
    /// Interpolation periods shortened because the buffer contained more points.
    pub filled: u64,
    /// Points discarded because the buffer was full.
    pub lost: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum State {
    /// No point received yet.
    Idle,
    /// Towards a received point.
    Moving,
    /// Towards an extrapolated point.
    Starved,
}

/// Queue of points, oldest first.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Buffer {
    points: [Point; OVERFLOW_BUFFER],
    first: usize,
    len: usize,
}

impl Buffer {
    const EMPTY: Self = Self {
        points: [[0; 2]; OVERFLOW_BUFFER],
        first: 0,
        len: 0,
    };

    fn push(&mut self, point: Point) {
        self.points[(self.first + self.len) % OVERFLOW_BUFFER] = point;
        self.len += 1;
    }

    fn pop(&mut self) -> Option<Point> {
        (self.len > 0).then(|| {
            let point = self.points[self.first];
            self.first = (self.first + 1) % OVERFLOW_BUFFER;
            self.len -= 1;
            point
        })
    }
}

impl Interpolator {
    /// Creates an interpolator with a period \[ticks\], with or without the heuristics, at rest at
    /// 0.
    pub(crate) fn new(period: u16, heuristics: bool) -> Self {
        Self {
            period: period.max(PERIOD_MIN),
            heuristics,
            step_max: [i32::MAX; 2],
            queue: Buffer::EMPTY,
            state: State::Idle,
            from: [0; 2],
            to: [0; 2],
            length: PERIOD_MIN,
            done: 0,
            at: [0; 2],
            counts: SmoothCounts::default(),
        }
    }

    /// Clears the queue and rests at a position until the next point.
    pub(crate) fn rest_at(&mut self, at: Point) {
        self.queue = Buffer::EMPTY;
        self.resume(at);
    }

    /// Continues from a position with the queued points.
    pub(crate) fn resume(&mut self, at: Point) {
        self.state = State::Idle;
        self.at = at;
        self.from = at;
        self.to = at;
        self.done = 0;
    }

    /// Sets the period from the next segment on \[ticks\].
    pub(crate) fn set_period(&mut self, ticks: u16) {
        self.period = ticks.max(PERIOD_MIN);
    }

    /// Sets the maximum speed of a motor from the next segment on \[counts/s\].
    pub(crate) fn set_speed_max(&mut self, motor: usize, counts_per_second: u16) {
        self.step_max[motor] = (i32::from(counts_per_second) << FRACTION_BITS) / 1_000;
    }

    pub(crate) fn period(&self) -> u16 {
        self.period
    }

    pub(crate) fn counts(&self) -> SmoothCounts {
        self.counts
    }

    /// Counts on from these counts.
    pub(crate) fn continue_counts(&mut self, counts: SmoothCounts) {
        self.counts = counts;
    }

    /// Returns the present set-point.
    pub(crate) fn at(&self) -> Point {
        self.at
    }

    /// Returns the number of queued points.
    #[cfg(test)]
    fn queued(&self) -> usize {
        self.queue.len
    }

    /// Queues a received point. A full queue discards its oldest point.
    pub(crate) fn push(&mut self, point: Point) {
        let capacity = if self.heuristics { OVERFLOW_BUFFER } else { 1 };
        if self.queue.len == capacity {
            let _ = self.queue.pop();
            self.counts.lost += 1;
        }
        self.queue.push(point);
    }

    /// Advances by one tick and returns its set-point.
    pub(crate) fn tick(&mut self) -> Point {
        let finished = self.done == self.length;
        let available = self.queue.len > 0;
        let due = match self.state {
            State::Idle => available,
            State::Moving => finished,
            State::Starved => finished || self.heuristics && available,
        };
        if due {
            self.begin_segment();
        }
        if self.state != State::Idle {
            self.done += 1;
            for motor in 0..2 {
                let travel = i64::from(self.to[motor] - self.from[motor]);
                let travelled = travel * i64::from(self.done) / i64::from(self.length);
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "not longer than the travel, which fits"
                )]
                let travelled = travelled as i32;
                self.at[motor] = self.from[motor] + travelled;
            }
        }
        self.at
    }

    fn begin_segment(&mut self) {
        let first = self.state == State::Idle;
        if let Some(point) = self.queue.pop() {
            self.state = State::Moving;
            let more = self.queue.len > 0;
            if more && self.heuristics && !first {
                self.counts.filled += 1;
                self.start_segment(point, self.period - 1);
            } else {
                self.start_segment(point, self.period);
            }
        } else {
            self.state = State::Starved;
            self.counts.missed += 1;
            let extrapolation = if self.heuristics {
                [0, 1].map(|motor| self.extrapolation(motor))
            } else {
                self.at
            };
            self.start_segment(extrapolation, self.period);
        }
    }

    /// Returns the extrapolation at half the last speed.
    fn extrapolation(&self, motor: usize) -> i32 {
        let travel = i64::from(self.to[motor] - self.from[motor]);
        let half = travel * i64::from(self.period) / (2 * i64::from(self.length));
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a shortened segment has at least half the length: not longer than the travel, which fits"
        )]
        let half = half as i32;
        self.at[motor].saturating_add(half)
    }

    fn start_segment(&mut self, point: Point, length: u16) {
        self.from = self.at;
        self.to = [0, 1].map(|motor| {
            let travel = point[motor].saturating_sub(self.at[motor]);
            let travel_max = self.step_max[motor].saturating_mul(i32::from(length));
            self.at[motor] + travel.clamp(-travel_max, travel_max)
        });
        self.length = length;
        self.done = 0;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const fn counts(n: i32) -> i32 {
        n << FRACTION_BITS
    }

    fn both(n: i32) -> Point {
        [counts(n), counts(n)]
    }

    fn ticks<const N: usize>(smooth: &mut Interpolator) -> [i32; N] {
        std::array::from_fn(|_| smooth.tick()[0] >> FRACTION_BITS)
    }

    #[test]
    fn point_is_reached_in_exactly_one_period() {
        let mut smooth = Interpolator::new(10, true);
        assert_eq!(ticks(&mut smooth), [0, 0]);
        smooth.push(both(100));
        assert_eq!(
            ticks(&mut smooth),
            [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]
        );
    }

    #[test]
    fn queued_points_shorten_every_segment_but_the_first() {
        let mut smooth = Interpolator::new(4, true);
        smooth.push(both(40));
        smooth.push(both(70));
        smooth.push(both(90));
        assert_eq!(ticks(&mut smooth), [10, 20, 30, 40]);
        assert_eq!(smooth.counts().filled, 0);
        assert_eq!(ticks(&mut smooth), [50, 60, 70]);
        assert_eq!(smooth.counts().filled, 1);
        assert_eq!(ticks(&mut smooth), [75, 80, 85, 90]);
        assert_eq!((smooth.counts().filled, smooth.counts().missed), (1, 0));
    }

    #[test]
    fn missed_points_halve_the_speed_and_the_next_point_resets_the_clock() {
        let mut smooth = Interpolator::new(2, true);
        smooth.push(both(80));
        assert_eq!(ticks(&mut smooth), [40, 80]);
        assert_eq!(ticks(&mut smooth), [100, 120]);
        assert_eq!(ticks(&mut smooth), [130, 140]);
        assert_eq!(ticks(&mut smooth), [145]);
        assert_eq!(smooth.counts().missed, 3);
        smooth.push(both(165));
        assert_eq!(ticks(&mut smooth), [155, 165]);
        assert_eq!(smooth.counts().missed, 3);
    }

    #[test]
    fn catching_up_is_limited_to_the_maximum_speed() {
        let mut smooth = Interpolator::new(2, true);
        smooth.set_speed_max(0, 10_000);
        smooth.push(both(100));
        assert_eq!(ticks(&mut smooth), [10, 20]);
        smooth.push(both(100));
        assert_eq!(ticks(&mut smooth), [30, 40]);
    }

    #[test]
    fn without_heuristics_points_are_lost_and_underflow_holds_position() {
        let mut smooth = Interpolator::new(2, false);
        smooth.push(both(10));
        smooth.push(both(20));
        assert_eq!(smooth.counts().lost, 1);
        assert_eq!(ticks(&mut smooth), [10, 20, 20]);
        smooth.push(both(30));
        assert_eq!(ticks(&mut smooth), [20, 25, 30]);
        assert_eq!((smooth.counts().missed, smooth.counts().filled), (1, 0));
    }

    #[test]
    fn full_buffer_discards_and_counts_the_oldest_point() {
        let mut smooth = Interpolator::new(2, true);
        for n in 0..=8 {
            smooth.push(both(n));
        }
        assert_eq!((smooth.queued(), smooth.counts().lost), (8, 1));
        assert_eq!(ticks(&mut smooth), [0, 1]);
    }

    /// Runs with points every 2 ms, each delayed, and ticks of about 1 ms.
    fn run(heuristics: bool, tick_ns: u64, phase_ns: u64, delays_ns: &[u64]) -> Interpolator {
        let mut smooth = Interpolator::new(2, heuristics);
        let mut tick = phase_ns;
        for (n, delay) in delays_ns.iter().enumerate() {
            let arrival = 2_000_000 * n as u64 + delay;
            while tick < arrival {
                smooth.tick();
                tick += tick_ns;
            }
            smooth.push(both(i32::try_from(n % 2_000).unwrap()));
        }
        smooth
    }

    proptest! {
        /// The difference of the counters is that of the clocks, independent of the jitter.
        #[test]
        fn filled_minus_missed_equals_the_clock_mismatch(
            mismatch_ppm in -3_000_i64..3_000,
            phase_ns in 0_u64..2_000_000,
            jitter_ns in 0_u64..=1_000_000,
            seed in any::<u64>(),
        ) {
            let mut random = twinrig_kernel::stream(seed, "jitter");
            let cycles = 20_000_u32;
            let delays: Vec<u64> = (0..cycles).map(|_| random.between(0, jitter_ns)).collect();
            let tick_ns = u64::try_from(1_000_000 + mismatch_ppm).unwrap();
            let counts = run(true, tick_ns, phase_ns, &delays).counts();
            let found = i128::from(counts.filled) - i128::from(counts.missed);
            let elapsed_ticks = 2e6 * f64::from(cycles) / tick_ns as f64;
            let expected = 2.0 * f64::from(cycles) - elapsed_ticks;
            prop_assert!((found as f64 - expected).abs() <= 3.0, "{counts:?}, expected {expected}");
            prop_assert_eq!(counts.lost, 0);
        }

        /// A board with a slower clock misses no point.
        #[test]
        fn slow_board_misses_no_point(
            mismatch_ppm in 20_i64..1_000,
            phase_ns in 0_u64..2_000_000,
        ) {
            let tick_ns = u64::try_from(1_000_000 + mismatch_ppm).unwrap();
            let counts = run(true, tick_ns, phase_ns, &vec![0; 5_000]).counts();
            prop_assert!(counts.missed == 0, "{counts:?}");
        }
    }

    #[test]
    fn without_heuristics_clock_mismatch_loses_or_misses_points() {
        let smooth = run(false, 1_001_000, 0, &vec![0; 10_000]);
        assert!(smooth.counts().lost.abs_diff(10) <= 1);
        assert_eq!(smooth.counts().missed, 0);
        let smooth = run(false, 999_000, 0, &vec![0; 10_000]);
        assert_eq!(smooth.counts().lost, 0);
        assert!(smooth.counts().missed.abs_diff(10) <= 1);
    }

    #[test]
    fn ramp_is_followed_within_half_a_tick_at_constant_lag() {
        let (mut smooth, speed) = (Interpolator::new(10, true), 100.0); // counts per tick
        let mut errors = vec![];
        for n in 0..200 {
            if n % 10 == 0 {
                smooth.push(both(10 * n));
            }
            let at = f64::from(smooth.tick()[0]) / f64::from(1 << FRACTION_BITS);
            if n >= 20 {
                // The set-point is constant from this tick to the next.
                errors.extend([
                    at * 10.0 - speed * f64::from(n),
                    at * 10.0 - speed * f64::from(n + 1),
                ]);
            }
        }
        let (least, most) = errors
            .iter()
            .fold((f64::MAX, f64::MIN), |(least, most), &error| {
                (least.min(error), most.max(error))
            });
        assert!((0.5 * (most - least) - 0.5 * speed).abs() < 0.05 * speed);
    }
}
