use serde::{Deserialize, Serialize};

use crate::assumed::OVERFLOW_BUFFER;

/// Positions of the two motors in the board's fixed point: counts × 2^[`FRACTION_BITS`].
pub(crate) type Point = [i32; 2];

/// Bits behind the point of a position.
pub(crate) const FRACTION_BITS: u32 = 8;

/// Shortest interpolation period \[ticks\]: a tick must be left when one is taken away (thesis, section 5.3.3).
pub(crate) const PERIOD_MIN: u16 = 2;

/// How set-points that come once a period become one for each tick (thesis, section 5.3.3).
///
/// A *segment* leads from where the set-point is to the next point that came, at an even speed, and lasts a period.
/// At its end the next point is taken out of the buffer:
///
/// - there are more: this segment is one tick shorter, a *filled-buffer step*;
/// - there is none: the set-point goes on with half its last speed, a *missed point*, again and again until a point
///   comes. The first tick after that begins a new segment at once: the clock of the interpolation is reset.
///
/// Every point takes its period, less a tick for a filled-buffer step; and with periods of two ticks every missed point
/// takes a tick more, as long as none comes more than a tick late. So what the counters say is how the clocks of both
/// ends differ: filled − missed = mismatch × points × 2.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Interpolator {
    period: u16,
    heuristics: bool,
    /// Greatest ways in a tick.
    step_max: [i32; 2],
    waiting: Buffer,
    state: State,
    from: Point,
    to: Point,
    /// Ticks of this segment.
    length: u16,
    /// Ticks of it that are over.
    done: u16,
    at: Point,
    counts: SmoothCounts,
}

/// What happened to the points since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SmoothCounts {
    /// Points that were not there when their time had come.
    pub missed: u64,
    /// Interpolation periods that were shortened because the buffer held more.
    pub filled: u64,
    /// Points that were thrown away: the buffer was full.
    pub lost: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum State {
    /// No point has come yet.
    Idle,
    /// On the way to a point.
    Moving,
    /// On the way to where a missed point may be.
    Starved,
}

/// Points that wait, oldest first.
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
    /// With a period \[ticks\], with or without the heuristics; at rest at 0.
    pub(crate) fn new(period: u16, heuristics: bool) -> Self {
        Self {
            period: period.max(PERIOD_MIN),
            heuristics,
            step_max: [i32::MAX; 2],
            waiting: Buffer::EMPTY,
            state: State::Idle,
            from: [0; 2],
            to: [0; 2],
            length: PERIOD_MIN,
            done: 0,
            at: [0; 2],
            counts: SmoothCounts::default(),
        }
    }

    /// Forgets the points that wait, and rests at a place until the next one comes.
    pub(crate) fn rest(&mut self, at: Point) {
        self.waiting = Buffer::EMPTY;
        self.resume(at);
    }

    /// Goes on from a place with the points that wait.
    pub(crate) fn resume(&mut self, at: Point) {
        self.state = State::Idle;
        self.at = at;
        self.from = at;
        self.to = at;
        self.done = 0;
    }

    /// From the next segment on \[ticks\].
    pub(crate) fn set_period(&mut self, ticks: u16) {
        self.period = ticks.max(PERIOD_MIN);
    }

    /// Greatest speed of a motor, from the next segment on \[counts/s\].
    pub(crate) fn set_speed_max(&mut self, motor: usize, counts_per_second: u16) {
        self.step_max[motor] = (i32::from(counts_per_second) << FRACTION_BITS) / 1_000;
    }

    pub(crate) fn period(&self) -> u16 {
        self.period
    }

    pub(crate) fn counts(&self) -> SmoothCounts {
        self.counts
    }

    /// Where the set-point is.
    pub(crate) fn at(&self) -> Point {
        self.at
    }

    /// How many points wait.
    #[cfg(test)]
    fn waiting(&self) -> usize {
        self.waiting.len
    }

    /// A point has come. Where there is no room, the oldest one that waits makes room for it.
    pub(crate) fn push(&mut self, point: Point) {
        let room = if self.heuristics { OVERFLOW_BUFFER } else { 1 };
        if self.waiting.len == room {
            let _ = self.waiting.pop();
            self.counts.lost += 1;
        }
        self.waiting.push(point);
    }

    /// The next tick: the set-point for it.
    pub(crate) fn tick(&mut self) -> Point {
        let over = self.done == self.length;
        let there = self.waiting.len > 0;
        let due = match self.state {
            State::Idle => there,
            State::Moving => over,
            State::Starved => over || self.heuristics && there,
        };
        if due {
            self.begin_segment();
        }
        if self.state != State::Idle {
            self.done += 1;
            for motor in 0..2 {
                let way = i64::from(self.to[motor] - self.from[motor]);
                let gone = way * i64::from(self.done) / i64::from(self.length);
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "not longer than the way, which fits"
                )]
                let gone = gone as i32;
                self.at[motor] = self.from[motor] + gone;
            }
        }
        self.at
    }

    fn begin_segment(&mut self) {
        let first = self.state == State::Idle;
        if let Some(point) = self.waiting.pop() {
            self.state = State::Moving;
            let more = self.waiting.len > 0;
            if more && self.heuristics && !first {
                self.counts.filled += 1;
                self.lead_to(point, self.period - 1);
            } else {
                self.lead_to(point, self.period);
            }
        } else {
            self.state = State::Starved;
            self.counts.missed += 1;
            let guess = if self.heuristics {
                [0, 1].map(|motor| self.guess(motor))
            } else {
                self.at
            };
            self.lead_to(guess, self.period);
        }
    }

    /// Where half the last speed would lead to.
    fn guess(&self, motor: usize) -> i32 {
        let way = i64::from(self.to[motor] - self.from[motor]);
        let half = way * i64::from(self.period) / (2 * i64::from(self.length));
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a shortened segment is half as long at least: not longer than the way, which fits"
        )]
        let half = half as i32;
        self.at[motor].saturating_add(half)
    }

    fn lead_to(&mut self, point: Point, length: u16) {
        self.from = self.at;
        self.to = [0, 1].map(|motor| {
            let way = point[motor].saturating_sub(self.at[motor]);
            let way_max = self.step_max[motor].saturating_mul(i32::from(length));
            self.at[motor] + way.clamp(-way_max, way_max)
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
    fn a_point_is_reached_in_exactly_a_period() {
        let mut smooth = Interpolator::new(10, true);
        assert_eq!(ticks(&mut smooth), [0, 0]);
        smooth.push(both(100));
        assert_eq!(
            ticks(&mut smooth),
            [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]
        );
    }

    #[test]
    fn a_second_point_in_the_buffer_takes_a_tick_off_this_segment_but_for_the_first() {
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
    fn the_greatest_speed_clips_the_catching_up() {
        let mut smooth = Interpolator::new(2, true);
        smooth.set_speed_max(0, 10_000);
        smooth.push(both(100));
        assert_eq!(ticks(&mut smooth), [10, 20]);
        smooth.push(both(100));
        assert_eq!(ticks(&mut smooth), [30, 40]);
    }

    #[test]
    fn without_heuristics_points_are_lost_and_an_empty_deadline_holds_still() {
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
    fn a_full_buffer_throws_the_oldest_away_and_says_so() {
        let mut smooth = Interpolator::new(2, true);
        for n in 0..=8 {
            smooth.push(both(n));
        }
        assert_eq!((smooth.waiting(), smooth.counts().lost), (8, 1));
        assert_eq!(ticks(&mut smooth), [0, 1]);
    }

    /// Points at 2 ms with a delay each, ticks at 1 ms and a bit.
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
        /// What the counters say is the difference of the clocks, whatever the jitter.
        #[test]
        fn filled_less_missed_is_the_mismatch(
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

        /// A slave that ticks slower never misses a point once it has its margin, and loses none.
        #[test]
        fn a_slow_slave_misses_at_most_what_the_jitter_first_costs(
            mismatch_ppm in 20_i64..1_000,
            phase_ns in 0_u64..2_000_000,
        ) {
            let tick_ns = u64::try_from(1_000_000 + mismatch_ppm).unwrap();
            let counts = run(true, tick_ns, phase_ns, &vec![0; 5_000]).counts();
            prop_assert!(counts.missed == 0, "{counts:?}");
        }
    }

    #[test]
    fn without_heuristics_a_slow_slave_loses_a_point_for_each_that_is_too_many() {
        let smooth = run(false, 1_001_000, 0, &vec![0; 10_000]);
        assert!(smooth.counts().lost.abs_diff(10) <= 1);
        assert_eq!(smooth.counts().missed, 0);
        let smooth = run(false, 999_000, 0, &vec![0; 10_000]);
        assert_eq!(smooth.counts().lost, 0);
        assert!(smooth.counts().missed.abs_diff(10) <= 1);
    }

    #[test]
    fn a_steady_motion_is_followed_within_half_a_tick_of_way_at_the_best_lag() {
        let (mut smooth, speed) = (Interpolator::new(10, true), 100.0); // counts per tick
        let mut ways = vec![];
        for n in 0..200 {
            if n % 10 == 0 {
                smooth.push(both(10 * n));
            }
            let at = f64::from(smooth.tick()[0]) / f64::from(1 << FRACTION_BITS);
            if n >= 20 {
                // The set-point holds from this tick to the next.
                ways.extend([
                    at * 10.0 - speed * f64::from(n),
                    at * 10.0 - speed * f64::from(n + 1),
                ]);
            }
        }
        let (least, most) = ways
            .iter()
            .fold((f64::MAX, f64::MIN), |(least, most), &way| {
                (least.min(way), most.max(way))
            });
        assert!((0.5 * (most - least) - 0.5 * speed).abs() < 0.05 * speed);
    }
}
