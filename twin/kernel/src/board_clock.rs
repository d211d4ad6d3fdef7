use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{LocalDuration, LocalTime, SimDuration, SimTime};

/// Clock of a board: offset at the start, rate error, another rate in a window of time, and bounded
/// random wander.
///
/// At physical time `t` its reading is `offset + t·(1 + rate) + wander(t)`, rounded down to the
/// nanosecond, in exact integer arithmetic: it is monotonic, and [`BoardClock::sim_at`] inverts it.
///
/// ```
/// use twinrig_kernel::{BoardClock, LocalDuration, LocalTime, SimDuration, SimTime};
///
/// let fast = BoardClock::new(LocalDuration::from_nanos(500), 40_000)?; // + 40 ppm
/// let second = SimTime::ZERO + SimDuration::from_secs(1);
/// assert_eq!(fast.local_at(second), LocalTime::from_nanos(1_000_040_500));
/// assert_eq!(fast.sim_at(LocalTime::from_nanos(1_000_040_500)), second);
/// # Ok::<(), twinrig_kernel::BoardClockError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoardClock {
    offset_ns: i64,
    rate_ppb: i64,
    drift: Option<Drift>,
    wander: Option<Wander>,
}

/// Change of the rate in a window of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Drift {
    from: SimTime,
    until: SimTime,
    rate_ppb: i64,
}

/// Slow, bounded, random phase error: linear interpolation between knots `period` apart, each knot
/// uniform within ± `amplitude_ns`. A knot is a hash of the seed and the knot's number; the clock
/// therefore has no state and can be evaluated at any time in any order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Wander {
    amplitude_ns: i64,
    period_ns: i64,
    seed: u64,
}

/// A clock model that would not be monotonic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum BoardClockError {
    /// The rate is not within ± half of nominal.
    #[error(
        "clock rate error of {rate_ppb} ppb is out of range: it must be within ±500 000 000 ppb"
    )]
    Rate {
        /// The rate \[ppb\].
        rate_ppb: i64,
    },
    /// The amplitude of the wander exceeds an eighth of its period.
    #[error("clock wander of ±{amplitude} every {period} exceeds an eighth of the period")]
    Wander {
        /// Maximum phase error.
        amplitude: LocalDuration,
        /// Spacing of the knots.
        period: SimDuration,
    },
}

/// Parts per billion in one.
const BILLION: i128 = 1_000_000_000;
/// Maximum deviation of the rate \[ppb\]: half the nominal rate, a thousand times that of a poor
/// crystal.
const RATE_PPB_MAX: i64 = 500_000_000;

impl BoardClock {
    /// A clock that reads physical time.
    pub const IDEAL: Self = Self {
        offset_ns: 0,
        rate_ppb: 0,
        drift: None,
        wander: None,
    };

    /// A clock that reads `offset` at the start and gains `rate_ppb` nanoseconds per second.
    ///
    /// # Errors
    /// [`BoardClockError::Rate`] if the rate is not within ± 500 000 000 ppb.
    pub fn new(offset: LocalDuration, rate_ppb: i64) -> Result<Self, BoardClockError> {
        if !(-RATE_PPB_MAX..=RATE_PPB_MAX).contains(&rate_ppb) {
            return Err(BoardClockError::Rate { rate_ppb });
        }
        Ok(Self {
            offset_ns: offset.as_nanos(),
            rate_ppb,
            drift: None,
            wander: None,
        })
    }

    /// The same clock, which gains further `rate_ppb` nanoseconds per second from `from` until
    /// `until`, and keeps what it has gained. It replaces an earlier window.
    ///
    /// # Errors
    /// [`BoardClockError::Rate`] if the rate in the window is not within ± 500 000 000 ppb.
    pub fn with_drift(
        self,
        from: SimTime,
        until: SimTime,
        rate_ppb: i64,
    ) -> Result<Self, BoardClockError> {
        let sum = self.rate_ppb.saturating_add(rate_ppb);
        if !(-RATE_PPB_MAX..=RATE_PPB_MAX).contains(&sum) {
            return Err(BoardClockError::Rate { rate_ppb: sum });
        }
        let drift = Drift {
            from,
            until: until.max(from),
            rate_ppb,
        };
        Ok(Self {
            drift: Some(drift),
            ..self
        })
    }

    /// The same clock with a random wander within ± `amplitude` and knots every `period`. `seed`
    /// is drawn from a [`crate::stream`].
    ///
    /// # Errors
    /// [`BoardClockError::Wander`] unless `amplitude` is at most an eighth of `period`, neither is
    /// negative, and `period` is below 292 years.
    pub fn with_wander(
        self,
        amplitude: LocalDuration,
        period: SimDuration,
        seed: u64,
    ) -> Result<Self, BoardClockError> {
        let error = BoardClockError::Wander { amplitude, period };
        let period_ns = i64::try_from(period.as_nanos()).map_err(|_| error)?;
        let amplitude_ns = amplitude.as_nanos();
        if period_ns == 0 || amplitude_ns < 0 || amplitude_ns > period_ns / 8 {
            return Err(error);
        }
        Ok(Self {
            wander: Some(Wander {
                amplitude_ns,
                period_ns,
                seed,
            }),
            ..self
        })
    }

    /// Returns the reading of the clock at `now`.
    ///
    /// # Panics
    /// If the reading exceeds 292 years.
    pub fn local_at(&self, now: SimTime) -> LocalTime {
        let now = i128::from(now.as_nanos());
        let local = match self.wander {
            None => self.steady(now),
            Some(wander) => {
                let period = i128::from(wander.period_ns);
                let knot = now / period;
                let (from, to) = (self.knot(wander, knot), self.knot(wander, knot + 1));
                from + (to - from) * (now - knot * period) / period
            }
        };
        LocalTime::from_nanos(i64::try_from(local).expect("local time past 292 years"))
    }

    /// Returns the first instant at which the clock reads `local` or later, at which a timer set to
    /// `local` expires; [`SimTime::ZERO`] if it does so from the start.
    ///
    /// # Panics
    /// If that instant is beyond 584 years.
    pub fn sim_at(&self, local: LocalTime) -> SimTime {
        let local = i128::from(local.as_nanos());
        let sim = match self.wander {
            None => self.steady_inverse(local),
            Some(wander) => {
                let period = i128::from(wander.period_ns);
                // Every earlier knot is before `local`; the search ends a few knots further on.
                let earliest = self.steady_inverse(local - i128::from(wander.amplitude_ns));
                let mut knot = (earliest.max(0) / period - 1).max(0);
                let mut from = self.knot(wander, knot);
                loop {
                    if from >= local {
                        break knot * period;
                    }
                    let to = self.knot(wander, knot + 1);
                    if to >= local {
                        break knot * period + div_ceil((local - from) * period, to - from);
                    }
                    (knot, from) = (knot + 1, to);
                }
            }
        };
        SimTime::from_nanos(u64::try_from(sim.max(0)).expect("physical time past 584 years"))
    }

    /// Returns the instant of a timer that is set to `after` past the start of period `number`;
    /// period 0 starts at the clock's zero. Local times past 292 years saturate.
    pub fn sim_at_period(&self, period: SimDuration, number: u64, after: SimDuration) -> SimTime {
        let local = period.as_nanos().saturating_mul(number);
        let local = local.saturating_add(after.as_nanos());
        self.sim_at(LocalTime::from_nanos(
            i64::try_from(local).unwrap_or(i64::MAX),
        ))
    }

    /// Returns the reading without wander, rounded down.
    fn steady(&self, sim: i128) -> i128 {
        let mut shown = sim * (BILLION + i128::from(self.rate_ppb));
        if let Some(drift) = self.drift {
            shown += drift.gain(sim);
        }
        i128::from(self.offset_ns) + shown.div_euclid(BILLION)
    }

    /// Returns the first time at which `steady` is `local` or later.
    fn steady_inverse(&self, local: i128) -> i128 {
        let since = local - i128::from(self.offset_ns);
        let rate = BILLION + i128::from(self.rate_ppb);
        if let Some(drift) = self.drift {
            return drift.inverse(since * BILLION, rate);
        }
        // Every tick of a board computes it; two divisions of 64 bits take half the time of one of
        // 128 bits. The product is below 2⁶³, since the rate is below 2·10⁹.
        if let (Ok(since), Ok(rate)) = (i64::try_from(since), i64::try_from(rate)) {
            let (whole, part) = (since.div_euclid(rate), since.rem_euclid(rate));
            let part = (part * 1_000_000_000 + rate - 1) / rate;
            return i128::from(whole) * BILLION + i128::from(part);
        }
        div_ceil(since * BILLION, rate)
    }

    /// Returns the reading at a knot of the wander.
    fn knot(&self, wander: Wander, number: i128) -> i128 {
        self.steady(number * i128::from(wander.period_ns)) + wander.phase(number)
    }
}

impl Drift {
    /// Returns the gain up to `sim` \[10⁻⁹ ns\].
    fn gain(self, sim: i128) -> i128 {
        let from = i128::from(self.from.as_nanos());
        let until = i128::from(self.until.as_nanos());
        (sim.clamp(from, until) - from) * i128::from(self.rate_ppb)
    }

    /// Returns the first time at which a clock of this rate \[ppb\] outside the window has gained
    /// `shown` \[10⁻⁹ ns\].
    fn inverse(self, shown: i128, rate: i128) -> i128 {
        let from = i128::from(self.from.as_nanos());
        let until = i128::from(self.until.as_nanos());
        let in_window = rate + i128::from(self.rate_ppb);
        let at_from = from * rate;
        let at_until = at_from + (until - from) * in_window;
        if shown <= at_from {
            div_ceil(shown, rate)
        } else if shown <= at_until {
            from + div_ceil(shown - at_from, in_window)
        } else {
            until + div_ceil(shown - at_until, rate)
        }
    }
}

impl Wander {
    /// Phase error \[ns\] at a knot, uniform within ± the amplitude.
    fn phase(self, knot: i128) -> i128 {
        let amplitude = i128::from(self.amplitude_ns);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "bits for a hash"
        )]
        let hash = i128::from(mix(self.seed ^ mix(knot as u64)));
        ((hash * (2 * amplitude + 1)) >> 64) - amplitude
    }
}

/// Bijective mixing function of 64 bits (finaliser of `SplitMix64`).
fn mix(bits: u64) -> u64 {
    let bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

/// Returns `dividend / divisor` rounded up, for a positive divisor.
fn div_ceil(dividend: i128, divisor: i128) -> i128 {
    -(-dividend).div_euclid(divisor)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_clock() -> impl Strategy<Value = BoardClock> {
        let wander = prop::option::of((0_i64..2_000, 16_000_u64..2_000_000, any::<u64>()));
        let any_rate = || prop_oneof![-RATE_PPB_MAX..=RATE_PPB_MAX, -100_000_i64..100_000, Just(0)];
        let drift = prop::option::of((any_time(), any_time(), any_rate()));
        let offset = -1_000_000_000_i64..1_000_000_000;
        (offset, any_rate(), drift, wander).prop_map(|(offset, rate, drift, wander)| {
            let mut clock = BoardClock::new(LocalDuration::from_nanos(offset), rate).unwrap();
            if let Some((from, lasts, in_window)) = drift {
                let (from, until) = (SimTime::from_nanos(from), SimTime::from_nanos(from + lasts));
                clock = clock.with_drift(from, until, in_window - rate).unwrap();
            }
            match wander {
                None => clock,
                Some((amplitude, period, seed)) => clock
                    .with_wander(
                        LocalDuration::from_nanos(amplitude),
                        SimDuration::from_nanos(period),
                        seed,
                    )
                    .unwrap(),
            }
        })
    }

    fn any_time() -> impl Strategy<Value = u64> {
        prop_oneof![0_u64..100, 0_u64..10_000_000, 0_u64..1 << 60]
    }

    proptest! {
        #[test]
        fn clock_is_monotonic(clock in any_clock(), at in any_time(), step in 0_u64..100_000) {
            let (early, late) = (SimTime::from_nanos(at), SimTime::from_nanos(at + step));
            prop_assert!(clock.local_at(early) <= clock.local_at(late));
        }

        #[test]
        fn timer_expires_at_the_first_instant_with_its_reading(clock in any_clock(), at in any_time(), by in -5_i64..5) {
            let local = clock.local_at(SimTime::from_nanos(at)) + LocalDuration::from_nanos(by);
            let fires = clock.sim_at(local);
            prop_assert!(clock.local_at(fires) >= local);
            if fires > SimTime::ZERO {
                prop_assert!(clock.local_at(SimTime::from_nanos(fires.as_nanos() - 1)) < local);
            }
        }

        #[test]
        fn inverse_of_a_reading_is_its_first_instant(clock in any_clock(), at in any_time()) {
            let shown = clock.local_at(SimTime::from_nanos(at));
            let back = clock.sim_at(shown);
            prop_assert!(back.as_nanos() <= at);
            prop_assert_eq!(clock.local_at(back), shown);
        }

        #[test]
        fn wander_stays_within_its_amplitude(
            seed in any::<u64>(), amplitude in 0_i64..1_000, rate in -100_000_i64..100_000, at in any_time()
        ) {
            let steady = BoardClock::new(LocalDuration::ZERO, rate).unwrap();
            let period = SimDuration::from_nanos(1_000_000);
            let wandering = steady.with_wander(LocalDuration::from_nanos(amplitude), period, seed).unwrap();
            let at = SimTime::from_nanos(at);
            let error = (wandering.local_at(at) - steady.local_at(at)).as_nanos();
            // Tolerance of 2 ns for the roundings of the knots and of the interpolation.
            prop_assert!(error.abs() <= amplitude + 2, "{error}");
        }
    }

    #[test]
    fn drift_in_a_window_is_kept() {
        let second = |n: u64| SimTime::from_nanos(n * 1_000_000_000);
        let clock = BoardClock::new(LocalDuration::ZERO, 10_000).unwrap();
        let clock = clock.with_drift(second(2), second(5), 200_000).unwrap();
        // 10 µs a second, and 200 µs in each of three seconds.
        for (at, nanos) in [
            (1, 1_000_010_000),
            (2, 2_000_020_000),
            (3, 3_000_230_000),
            (5, 5_000_650_000),
            (9, 9_000_690_000),
        ] {
            let shown = clock.local_at(second(at));
            assert_eq!(shown, LocalTime::from_nanos(nanos), "{at} s");
        }
    }

    #[test]
    fn non_monotonic_clocks_are_rejected() {
        assert!(BoardClock::new(LocalDuration::ZERO, -1_000_000_000).is_err());
        let nearly = BoardClock::new(LocalDuration::ZERO, -RATE_PPB_MAX).unwrap();
        assert!(nearly.with_drift(SimTime::ZERO, SimTime::MAX, -1).is_err());
        let wander = |amplitude, period| {
            BoardClock::IDEAL.with_wander(
                LocalDuration::from_nanos(amplitude),
                SimDuration::from_nanos(period),
                0,
            )
        };
        assert!(wander(100, 799).is_err());
        assert!(wander(-1, 800).is_err());
        assert!(wander(0, 0).is_err());
        assert!(wander(100, 800).is_ok());
    }

    #[test]
    fn ideal_clock_reads_physical_time() {
        let now = SimTime::from_nanos(123_456_789);
        assert_eq!(
            BoardClock::IDEAL.local_at(now),
            LocalTime::from_nanos(123_456_789)
        );
    }
}
