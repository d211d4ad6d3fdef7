use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{SimDuration, Stream, stream};

/// Model of a duration in virtual time: an iteration of the process, a transfer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Timing {
    /// Constant.
    Constant(SimDuration),
    /// Uniform over the whole nanoseconds from `min` to `max`.
    Uniform {
        /// Shortest.
        min: SimDuration,
        /// Longest.
        max: SimDuration,
    },
    /// Truncated normal: mean and standard deviation are those before truncation to `min..=max`.
    Normal {
        /// Mean, within `min..=max`.
        mean: SimDuration,
        /// Standard deviation.
        deviation: SimDuration,
        /// Shortest.
        min: SimDuration,
        /// Longest.
        max: SimDuration,
    },
    /// A recorded sequence, repeated cyclically.
    Trace(Vec<SimDuration>),
}

/// An invalid timing.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TimingError {
    /// The shortest time is longer than the longest.
    #[error("no time lies between {min} and {max}")]
    EmptyRange {
        /// Shortest.
        min: SimDuration,
        /// Longest.
        max: SimDuration,
    },
    /// The mean lies outside the range.
    #[error("a mean of {mean} is not between {min} and {max}")]
    MeanOutside {
        /// Mean.
        mean: SimDuration,
        /// Shortest.
        min: SimDuration,
        /// Longest.
        max: SimDuration,
    },
    /// The trace is empty.
    #[error("the recorded trace is empty")]
    EmptyTrace,
}

impl Timing {
    /// Zero duration.
    pub const ZERO: Self = Self::Constant(SimDuration::ZERO);

    /// Returns the longest possible duration.
    pub fn longest(&self) -> SimDuration {
        match self {
            Self::Constant(duration) => *duration,
            Self::Uniform { max, .. } | Self::Normal { max, .. } => *max,
            Self::Trace(durations) => durations.iter().max().copied().unwrap_or_default(),
        }
    }

    /// Returns the sequence of durations, drawn from the random stream `name`.
    ///
    /// # Errors
    /// [`TimingError`] if the timing is invalid.
    pub fn source(self, seed: u64, name: &str) -> Result<TimeSource, TimingError> {
        match &self {
            Self::Uniform { min, max } | Self::Normal { min, max, .. } if min > max => {
                return Err(TimingError::EmptyRange {
                    min: *min,
                    max: *max,
                });
            }
            Self::Normal { mean, min, max, .. } if !(min..=max).contains(&mean) => {
                return Err(TimingError::MeanOutside {
                    mean: *mean,
                    min: *min,
                    max: *max,
                });
            }
            Self::Trace(durations) if durations.is_empty() => return Err(TimingError::EmptyTrace),
            _ => {}
        }
        Ok(TimeSource {
            timing: self,
            stream: stream(seed, name),
            next: 0,
        })
    }
}

/// Sequence of durations of a [`Timing`].
///
/// ```
/// use twinrig_kernel::SimDuration;
/// use twinrig_runtime::Timing;
///
/// let (short, long) = (SimDuration::from_micros(50), SimDuration::from_micros(80));
/// let mut transfer = Timing::Uniform { min: short, max: long }.source(1, "io/transfer")?;
/// assert!((short..=long).contains(&transfer.draw()));
/// # Ok::<(), twinrig_runtime::TimingError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeSource {
    timing: Timing,
    stream: Stream,
    /// Next index in the trace.
    next: usize,
}

impl TimeSource {
    /// Draws the next duration.
    pub fn draw(&mut self) -> SimDuration {
        match &self.timing {
            Timing::Constant(duration) => *duration,
            Timing::Uniform { min, max } => {
                SimDuration::from_nanos(self.stream.between(min.as_nanos(), max.as_nanos()))
            }
            Timing::Normal {
                mean,
                deviation,
                min,
                max,
            } => draw_normal(&mut self.stream, *mean, *deviation, (*min, *max)),
            Timing::Trace(durations) => {
                let duration = durations[self.next];
                self.next = (self.next + 1) % durations.len();
                duration
            }
        }
    }
}

/// Draws by rejection. The mean lies in the range; a range narrower than the standard deviation is
/// sampled uniformly and thinned by the density instead, so that at least one trial in three is
/// accepted either way.
fn draw_normal(
    stream: &mut Stream,
    mean: SimDuration,
    deviation: SimDuration,
    (min, max): (SimDuration, SimDuration),
) -> SimDuration {
    let (mean_ns, deviation_ns) = (mean.as_nanos() as f64, deviation.as_nanos() as f64);
    loop {
        if max - min < deviation {
            let trial_ns = stream.between(min.as_nanos(), max.as_nanos());
            let off = (trial_ns as f64 - mean_ns) / deviation_ns;
            if stream.unit() < libm::exp(-0.5 * off * off) {
                return SimDuration::from_nanos(trial_ns);
            }
        } else {
            let trial_ns = mean_ns + deviation_ns * stream.normal();
            let trial = SimDuration::try_from_secs_f64(trial_ns * 1e-9);
            if let Some(trial) = trial.filter(|trial| (min..=max).contains(trial)) {
                return trial;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn ns(nanos: u64) -> SimDuration {
        SimDuration::from_nanos(nanos)
    }

    proptest! {
        #[test]
        fn draws_stay_within_the_range(
            min in 0_u64..1_000_000, width in 0_u64..1_000_000, mean in 0.0..=1.0_f64,
            deviation in 0_u64..3_000_000, seed in any::<u64>(),
        ) {
            let (min, max) = (ns(min), ns(min + width));
            let mean = min + SimDuration::try_from_secs_f64(mean * (max - min).as_secs_f64()).unwrap();
            for timing in [Timing::Uniform { min, max }, Timing::Normal { mean, deviation: ns(deviation), min, max }] {
                prop_assert_eq!(timing.longest(), max);
                let mut source = timing.source(seed, "any").unwrap();
                for _ in 0..20 {
                    prop_assert!((min..=max).contains(&source.draw()));
                }
            }
        }
    }

    #[test]
    fn wide_normal_has_its_mean_and_deviation() {
        let timing = Timing::Normal {
            mean: ns(10_000),
            deviation: ns(500),
            min: ns(0),
            max: ns(20_000),
        };
        let mut source = timing.source(1, "any").unwrap();
        let drawn: Vec<f64> = (0..20_000)
            .map(|_| source.draw().as_nanos() as f64)
            .collect();
        let mean = drawn.iter().sum::<f64>() / 20_000.0;
        let variance = drawn.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 20_000.0;
        assert!(
            (mean - 10_000.0).abs() < 15.0 && (variance.sqrt() - 500.0).abs() < 10.0,
            "{mean} {variance}"
        );
    }

    #[test]
    fn trace_repeats_cyclically() {
        let mut source = Timing::Trace(vec![ns(1), ns(2), ns(3)])
            .source(0, "any")
            .unwrap();
        let drawn: Vec<_> = (0..5).map(|_| source.draw().as_nanos()).collect();
        assert_eq!(drawn, [1, 2, 3, 1, 2]);
    }

    #[test]
    fn invalid_timings_are_refused() {
        let refused = |timing: Timing| timing.source(0, "any").unwrap_err();
        assert_eq!(refused(Timing::Trace(vec![])), TimingError::EmptyTrace);
        assert!(matches!(
            refused(Timing::Uniform {
                min: ns(2),
                max: ns(1)
            }),
            TimingError::EmptyRange { .. }
        ));
        let off = Timing::Normal {
            mean: ns(9),
            deviation: ns(1),
            min: ns(1),
            max: ns(2),
        };
        assert!(matches!(refused(off), TimingError::MeanOutside { .. }));
    }
}
