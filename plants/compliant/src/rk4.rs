//! Runge–Kutta method of order 4 with error control.
//!
//! The method has stages at the begin, a quarter, three fifths and the end of a substep. The slope
//! at its end is the first of the next; with it the estimate of the error is that of a solution of
//! order 3:
//!
//! ```text
//! y₁ = y₀ + h Σ bⱼ kⱼ (j = 1 … 4)    k₅ = f(y₁)    ŷ₁ − y₁ = h Σ eⱼ kⱼ (j = 1 … 5)
//! ```
//!
//! The classical stages see only the middle and the end of a substep, and the difference of two
//! slopes at its end is their estimate: of a foot that lands in the second half it notices nothing.
//! With unequal stages gaits need a fifth less evaluations for the same error, and their energy
//! balance closes better; methods of order 3 and 5 need more.
//!
//! The control keeps the error per time below the tolerance per millisecond: substeps at landings,
//! of which there are few, may err no more than long ones, and the error of a run is proportional
//! to the tolerance.

/// Shortest substep: a model that needs shorter ones is too stiff for this method \[s\].
const SUBSTEP_MIN: f64 = 1e-7;

/// Longest substep with error control: it has to notice a touch of the ground between two stages
/// \[s\].
const SUBSTEP_MAX: f64 = 1e-3;

/// Time over which errors may add up to the tolerance \[s\].
const UNIT: f64 = 1e-3;

/// Substeps shorter than this may err as one of this length \[s\]: at a kink of a force law, the
/// error is proportional to the square of the substep only, but there are few of them.
const SHORT: f64 = 1e-5;

/// Limits of the ratio of successive substeps, and the share of the optimal substep that is taken.
const RATIO_MIN: f64 = 0.2;
const RATIO_MAX: f64 = 2.0;
const SAFETY: f64 = 0.85;

/// Instants of the second and the third stage as shares of a substep, and the weights of the slopes
/// in the states of the stages.
const NODES: [f64; 2] = [0.25, 0.6];
const SECOND: [f64; 1] = [0.25];
const THIRD: [f64; 2] = [-0.24, 0.84];
const FOURTH: [f64; 3] = [6.0 / 5.0, -57.0 / 35.0, 10.0 / 7.0];

/// Weights bⱼ of the slopes.
const WEIGHTS: [f64; 4] = [1.0 / 9.0, 16.0 / 63.0, 125.0 / 252.0, 5.0 / 36.0];

/// Weights eⱼ of the slopes in the error.
const ERROR: [f64; 5] = [
    -1.0 / 18.0,
    8.0 / 63.0,
    -25.0 / 252.0,
    -5.0 / 36.0,
    1.0 / 6.0,
];

/// Ordinary differential equation.
pub trait System {
    /// State.
    type State: Copy;
    /// Time derivative of the state, with integrands such as powers and forces.
    type Slope: Copy;

    /// Returns the slope in a state, `time` seconds after the begin of the step.
    fn slope(&self, time: f64, state: &Self::State) -> Self::Slope;

    /// Returns the state advanced by a sum of slopes, each times its seconds.
    fn along<const M: usize>(
        state: &Self::State,
        slopes: [&Self::Slope; M],
        seconds: [f64; M],
    ) -> Self::State;

    /// Returns the size of an error, given as a sum of slopes, each times its seconds, after a
    /// substep of some length \[m\].
    fn error(&self, substep: f64, slopes: [&Self::Slope; 5], seconds: [f64; 5]) -> f64;

    /// Adds the integrands of an accepted substep, which begins at `time` and ends in `next`: the
    /// sum of slopes, each times its seconds.
    fn accept(
        &mut self,
        time: f64,
        slopes: [&Self::Slope; 4],
        seconds: [f64; 4],
        next: &Self::State,
    );
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

/// Evaluations of the slope, accepted and rejected substeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct StepWork {
    /// Evaluations of the slope.
    pub evaluations: u64,
    /// Accepted substeps.
    pub accepted: u64,
    /// Rejected substeps.
    pub rejected: u64,
}

/// Failure of a step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StepError {
    /// The tolerance requires substeps that are too short.
    #[error(
        "the tolerance requires substeps below {SUBSTEP_MIN:e} s: a constraint, damping or mass is \
         too stiff for an explicit method"
    )]
    TooStiff,
    /// The state diverges, without error control.
    #[error(
        "a step of {seconds:e} s diverges: it is beyond the limit of stability; choose a tolerance or \
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
        let mut time = 0.0;
        let mut k1 = if let Some(slope) = slope.take() {
            slope
        } else {
            self.work.evaluations += 1;
            system.slope(0.0, state)
        };
        while time < seconds {
            let rest = seconds - time;
            let count = self.substeps(rest);
            let h = rest / count;
            let end = if count > 1.0 { time + h } else { seconds };
            let k2 = system.slope(
                time + NODES[0] * h,
                &F::along(state, [&k1], times(SECOND, h)),
            );
            let k3 = system.slope(
                time + NODES[1] * h,
                &F::along(state, [&k1, &k2], times(THIRD, h)),
            );
            let k4 = system.slope(end, &F::along(state, [&k1, &k2, &k3], times(FOURTH, h)));
            let (slopes, parts) = ([&k1, &k2, &k3, &k4], times(WEIGHTS, h));
            let next = F::along(state, slopes, parts);
            let k5 = system.slope(end, &next);
            self.work.evaluations += 4;
            let error = system.error(h, [&k1, &k2, &k3, &k4, &k5], times(ERROR, h));
            let ratio = error * (UNIT / h.max(SHORT)) / self.tolerance;
            // The form of the comparison rejects NaN.
            if ratio <= 1.0 {
                self.work.accepted += 1;
                system.accept(time, slopes, parts, &next);
                (*state, k1) = (next, k5);
                time = end;
            } else {
                self.work.rejected += 1;
                if self.tolerance.is_infinite() {
                    return Err(StepError::Diverged { seconds: h });
                }
            }
            let growth = Self::growth(ratio);
            // A substep cut short by the end of the step says nothing against a longer one.
            let cut_short = growth >= 1.0 && h < self.substep;
            self.substep = if cut_short {
                (h * growth).max(self.substep)
            } else {
                h * growth
            };
            if self.substep < SUBSTEP_MIN && self.substep < rest {
                return Err(StepError::TooStiff);
            }
        }
        *slope = Some(k1);
        Ok(())
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

/// Returns weights times a length of time.
#[inline(always)]
fn times<const M: usize>(weights: [f64; M], seconds: f64) -> [f64; M] {
    let mut all = weights;
    for weight in &mut all {
        *weight *= seconds;
    }
    all
}

#[cfg(test)]
mod tests;
