//! Runge–Kutta method of order 4 with error control.
//!
//! The control keeps the error per time below the tolerance per millisecond: substeps at landings,
//! of which there are few, may err no more than long ones, and the error of a run is proportional
//! to the tolerance. Along a stiff mode of a leg the method is an exponential one ([`mode`]).
//!
//! A kink of a force, such as the onset of a damper, takes a few very short substeps at a tight
//! tolerance. A stiff model, in contrast, needs short substeps without end: a step of more than a
//! number of substeps fails, so that every run ends in bounded time.

mod mode;
mod weights;

pub use mode::{Missed, Mode, NoMode, Unseen};

use mode::Along;
use weights::{ERROR, FOURTH, MEAN, NODES, SECOND, THIRD, times};

use crate::lanes::{LANES, Quad};

/// Least substep: across a kink of the force on a leg (1e8 m/s³) the error per time is then below
/// any tolerance that the number of substeps permits \[s\].
const SUBSTEP_MIN: f64 = 1e-10;

/// Longest substep with error control: it has to notice a touch of the ground between two stages
/// \[s\].
const SUBSTEP_MAX: f64 = 1e-3;

/// Greatest number of substeps, rejected ones included, of any step, and of a step per time
/// \[1/s\]. A trot takes 1.5e3 a second, 1.8e5 at a tolerance of 1e-13 or with a hundred times the
/// damping of the elements 6e4; a million take about a second, and a run that is slower than the
/// robot creeps.
const SUBSTEPS: f64 = 200.0;
const SUBSTEPS_PER_TIME: f64 = 1e6;

/// Product of a substep and the rate of the fastest motion from which on stability, not accuracy,
/// limits the substep; the limit of stability is 2.8.
const STIFF: f64 = 0.5;

/// Time over which errors may add up to the tolerance \[s\].
const UNIT: f64 = 1e-3;

/// Limits of the ratio of successive substeps, and the share of the optimal substep that is taken.
const RATIO_MIN: f64 = 0.2;
const RATIO_MAX: f64 = 2.0;
const SAFETY: f64 = 0.85;

/// Number of the members of a state that belong to the trunk; the lanes of the others are legs.
const TRUNK: usize = 4;

impl Fastest {
    /// Finds the fastest motion of a leg in the differences of two states, and in those of the
    /// slopes there, member by member.
    pub fn new(states: &[Quad], slopes: &[Quad]) -> Self {
        let square = |quads: &[Quad], leg: usize| {
            let values = quads.iter().skip(TRUNK).map(|quad| quad.0[leg]);
            values.map(|value| value * value).sum::<f64>()
        };
        let mut fastest = Self { rate: 0.0, leg: 0 };
        for leg in 0..LANES {
            let rate = libm::sqrt(square(slopes, leg) / square(states, leg));
            // A leg without motion has no rate; one that is not finite is the fastest.
            if square(states, leg) != 0.0 && (rate > fastest.rate || rate.is_nan()) {
                fastest = Self { rate, leg };
            }
        }
        fastest
    }
}

/// Ordinary differential equation.
pub trait System {
    /// State.
    type State: Copy;
    /// Time derivative of the state, with integrands such as powers and forces.
    type Slope: Copy;
    /// Stiff mode of each leg, or [`NoMode`].
    type Mode: Mode<State = Self::State, Slope = Self::Slope>;

    /// Returns the stiff mode in a state with this slope, if the system has one.
    fn mode(&self, state: &Self::State, slope: &Self::Slope) -> Option<Self::Mode>;

    /// Returns the slope in a state, `time` seconds after the begin of the step.
    fn slope(&self, time: f64, state: &Self::State) -> Self::Slope;

    /// Returns the state advanced by a sum of slopes, each times its seconds.
    fn along<const M: usize>(
        state: &Self::State,
        slopes: [&Self::Slope; M],
        seconds: [f64; M],
    ) -> Self::State;

    /// Returns the size of an error, given as a sum of slopes, each times its seconds, and along a
    /// mode, after a substep of some length \[m\].
    fn error(
        &self,
        substep: f64,
        slopes: [&Self::Slope; 5],
        seconds: [f64; 5],
        missed: Option<Missed<'_, Self::Mode>>,
    ) -> f64;

    /// Returns the fastest motion, by two states close to each other and the slopes there.
    fn fastest(&self, states: [&Self::State; 2], slopes: [&Self::Slope; 2]) -> Fastest;

    /// Adds the integrands of an accepted substep, and returns the number of its events.
    fn accept(&mut self, substep: &Substep<'_, Self>) -> u64;
}

/// Fastest motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fastest {
    /// Rate: the ratio of the differences of slopes and states \[1/s\].
    pub rate: f64,
    /// Leg.
    pub leg: usize,
}

/// Accepted substep.
#[derive(Clone, Copy)]
pub struct Substep<'a, F: System + ?Sized> {
    /// Begin, since that of the step \[s\].
    pub time: f64,
    /// Duration \[s\].
    pub seconds: f64,
    /// k₁ … k₄.
    pub slopes: [&'a F::Slope; 4],
    /// Seconds of each in the sum that leads to the end.
    pub shares: [f64; 4],
    /// k₅, the slope at the end.
    pub last: &'a F::Slope,
    /// States at both ends.
    pub states: [&'a F::State; 2],
    /// Motion along a stiff mode.
    pub unseen: Option<Unseen<F::Mode>>,
}

/// Control of the substeps.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StepControl {
    /// Greatest estimated error per millisecond \[m\]; infinite to take every step in one.
    tolerance: f64,
    /// Proposed length of the next substep \[s\].
    substep: f64,
    /// Work since the start.
    pub work: StepWork,
}

/// Evaluations of the slope, accepted and rejected substeps, events.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct StepWork {
    /// Evaluations of the slope.
    pub evaluations: u64,
    /// Accepted substeps.
    pub accepted: u64,
    /// Rejected substeps.
    pub rejected: u64,
    /// Events.
    pub events: u64,
    /// Reciprocal of the least accepted substep, but for those cut short by the end of a step
    /// \[1/s\]; zero without any.
    pub greatest_rate: f64,
}

/// Failure of a step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StepError {
    /// The model is too stiff for an explicit method.
    #[error(
        "too stiff for an explicit method: a motion with a rate of {:.1e} 1/s needs substeps of {:.1e} s \
         without end; reduce stiffness or damping, add mass, or choose rigid constraints",
        fastest.rate, substep
    )]
    TooStiff {
        /// Fastest motion.
        fastest: Fastest,
        /// Length of the substeps \[s\].
        substep: f64,
    },
    /// The error of the least substep exceeds the tolerance.
    #[error(
        "a substep of {substep:.1e} s errs by more than the tolerance, in a motion of {:.1e} 1/s: the \
         state is beyond what the model describes, or the tolerance too tight",
        fastest.rate
    )]
    Abrupt {
        /// Fastest motion.
        fastest: Fastest,
        /// Length of the substep \[s\].
        substep: f64,
    },
    /// The tolerance requires too many substeps.
    #[error(
        "a tolerance of {tolerance:e} m needs substeps of {substep:.1e} s without end, at motions of \
         {:.1e} 1/s: choose a larger one",
        fastest.rate
    )]
    TooPrecise {
        /// Tolerance \[m\].
        tolerance: f64,
        /// Fastest motion.
        fastest: Fastest,
        /// Length of the substeps \[s\].
        substep: f64,
    },
    /// The state diverges.
    #[error(
        "a step of {seconds:.1e} s diverges: it is beyond the limit of stability; choose a tolerance or \
         a shorter step"
    )]
    Diverged {
        /// Length of the step \[s\].
        seconds: f64,
    },
}

impl StepControl {
    /// Default tolerance \[m\]: keeps trunk and feet of every gait of the scenarios within 2.5e-5 m
    /// over the first second, and the energy balance within 2e-5.
    pub const TOLERANCE: f64 = 4e-6;

    /// Substeps over which an error of a velocity moves a point: it outlives its own.
    pub const VELOCITY_SUBSTEPS: f64 = 2.0;

    /// Weight of the error of a bristle against that of a position: enough to notice the friction
    /// of a landing, too little to follow the bristle of a foot in the air.
    pub const BRISTLE_WEIGHT: f64 = 0.3;

    /// Substeps shorter than this, of which no step has many, may err as one of this length \[s\]:
    /// at a kink of a force law, the error is proportional to the square of the substep only.
    pub const SHORT: f64 = 1.0 / SUBSTEPS_PER_TIME;

    /// Weight of the error of work, as the height by which it lifts the robot, against that of a
    /// position, while set-points are held: closes the energy balance where they jump. Short
    /// substeps need it not.
    pub const WORK_WEIGHT: f64 = 0.4;

    /// Weight of the error of substeps along a stiff mode: accuracy alone limits them, and at more
    /// of it than the tolerance of a position the energy balance does not close.
    const CARE: f64 = 4.0;

    /// Creates the control for a tolerance \[m\].
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            substep: f64::INFINITY,
            work: StepWork::default(),
        }
    }

    /// Returns the tolerance \[m\].
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Advances a state by `seconds`. `slope` is the one in this state, if known, and becomes the
    /// one at the end.
    ///
    /// # Errors
    /// [`StepError`]; the state is then that after the last accepted substep.
    #[inline(always)]
    pub fn advance<F: System>(
        &mut self,
        system: &mut F,
        state: &mut F::State,
        slope: &mut Option<F::Slope>,
        seconds: f64,
    ) -> Result<(), StepError> {
        let (mut time, mut substeps_left) = (0.0, SUBSTEPS + SUBSTEPS_PER_TIME * seconds);
        let mut k1 = if let Some(slope) = slope.take() {
            slope
        } else {
            self.work.evaluations += 1;
            system.slope(0.0, state)
        };
        let mut mode = mode_of(system, state, &k1);
        while time < seconds {
            let rest = seconds - time;
            let count = self.substeps(rest);
            let h = rest / count;
            let end = if count > 1.0 { time + h } else { seconds };
            let mut along = None;
            if let Some(mode) = mode {
                along = Along::new(mode, &k1, h);
            }
            let mut second = F::along(state, [&k1], times(SECOND, h));
            if let Some(along) = &mut along {
                second = along.second(&second);
            }
            let k2 = system.slope(time + NODES[0] * h, &second);
            let mut third = F::along(state, [&k1, &k2], times(THIRD, h));
            if let Some(along) = &mut along {
                third = along.third(&third, &k2);
            }
            let k3 = system.slope(time + NODES[1] * h, &third);
            let mut fourth = F::along(state, [&k1, &k2, &k3], times(FOURTH, h));
            if let Some(along) = &mut along {
                fourth = along.fourth(&fourth, &k3);
            }
            let k4 = system.slope(end, &fourth);
            let (slopes, shares) = ([&k1, &k2, &k3, &k4], times(MEAN, h));
            let mut next = F::along(state, slopes, shares);
            if let Some(along) = &mut along {
                next = along.end(&next, &k4);
            }
            let k5 = system.slope(end, &next);
            self.work.evaluations += 4;
            let (slopes_and_last, errors) = ([&k1, &k2, &k3, &k4, &k5], times(ERROR, h));
            let error = if let Some(along) = &mut along {
                let missed = along.missed(&k5);
                Self::CARE * system.error(h, slopes_and_last, errors, Some(missed))
            } else {
                system.error(h, slopes_and_last, errors, None)
            };
            let ratio = error * (UNIT / h.max(Self::SHORT)) / self.tolerance;
            let is_least = h <= SUBSTEP_MIN;
            substeps_left -= 1.0;
            // The form of the comparison rejects NaN.
            let accepted = ratio <= 1.0;
            if !accepted && (is_least || self.tolerance.is_infinite()) || substeps_left < 0.0 {
                let fastest = system.fastest([&fourth, &next], [&k4, &k5]);
                return Err(self.refusal(h, fastest));
            }
            if accepted {
                self.work.accepted += 1;
                if h >= self.substep || count > 1.0 {
                    self.work.greatest_rate = self.work.greatest_rate.max(1.0 / h);
                }
                let mut unseen = None;
                if let Some(along) = &along {
                    unseen = Some(along.unseen());
                }
                self.work.events += system.accept(&Substep {
                    time,
                    seconds: h,
                    slopes,
                    shares,
                    last: &k5,
                    states: [state, &next],
                    unseen,
                });
                (*state, k1) = (next, k5);
                mode = mode_of(system, state, &k1);
                time = end;
            } else {
                self.work.rejected += 1;
            }
            let growth = Self::growth(ratio);
            // A substep cut short by the end of the step says nothing against a longer one.
            let cut_short = growth >= 1.0 && h < self.substep;
            self.substep = if cut_short {
                (h * growth).max(self.substep)
            } else {
                (h * growth).max(SUBSTEP_MIN)
            };
        }
        *slope = Some(k1);
        Ok(())
    }

    /// Returns the reason why substeps of a length do not lead to the end of a step.
    #[cold]
    fn refusal(&self, substep: f64, fastest: Fastest) -> StepError {
        let tolerance = self.tolerance;
        let stiffness = substep * fastest.rate;
        if tolerance.is_infinite() || !stiffness.is_finite() {
            StepError::Diverged { seconds: substep }
        } else if substep <= SUBSTEP_MIN {
            StepError::Abrupt { fastest, substep }
        } else if stiffness > STIFF {
            StepError::TooStiff { fastest, substep }
        } else {
            StepError::TooPrecise {
                tolerance,
                fastest,
                substep,
            }
        }
    }

    /// Returns the number of equal substeps for the remaining time.
    #[inline(always)]
    fn substeps(&self, rest: f64) -> f64 {
        // Rounding errors of the remaining time are no reason for one more.
        const ROUND_OFF: f64 = 1e-9;
        let most = self.substep.min(SUBSTEP_MAX);
        if rest <= most || self.tolerance.is_infinite() {
            1.0
        } else {
            libm::ceil(rest / most - ROUND_OFF)
        }
    }

    /// Returns the ratio of the next substep to one with this ratio of error to tolerance, which
    /// grows with the cube of its length: the fourth root damps the control.
    #[inline(always)]
    fn growth(ratio: f64) -> f64 {
        if ratio.is_nan() {
            return RATIO_MIN;
        }
        (SAFETY / libm::sqrt(libm::sqrt(ratio))).clamp(RATIO_MIN, RATIO_MAX)
    }
}

/// Returns the stiff mode; the exponential weights are those of the own method alone.
#[inline(always)]
fn mode_of<F: System>(system: &F, state: &F::State, slope: &F::Slope) -> Option<F::Mode> {
    if cfg!(feature = "three-eighths") {
        None
    } else {
        system.mode(state, slope)
    }
}

#[cfg(test)]
mod tests;
