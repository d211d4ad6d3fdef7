//! State of the planner: distance, cycles of the gait, last footfalls, and the present change.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use super::footfalls::{NextFootfall, Obstacle, Prediction};
use super::odometry::{Foot, Odometry};

/// Greatest difference of successive strides of an even gait, as a share.
const STRIDE_TOLERANCE: f64 = 0.03;
/// Least share of the last stride in the mean of strides, which forgets old ones.
const STRIDE_WEIGHT: f64 = 0.1;

/// Values of the planner's variables.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// None if there is nothing to plan.
    pub obstacle: Option<Obstacle>,
    pub margin: f64,
    pub most: f64,
    pub slope: f64,
    pub scale: f64,
    pub offset: f64,
}

/// State of the planner besides that of the gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    odometry: Odometry,
    legs: Vec<LegState>,
    cycle: Option<Cycle>,
    /// Mean stride without a change, without the scale \[m\].
    stride: Option<f64>,
    /// Number of strides in this mean.
    strides: u32,
    /// Last stride of any kind \[m\].
    last_stride: f64,
    /// Whole cycles without a change.
    unchanged: u32,
    /// Change of the step length \[m\].
    change: f64,
}

/// Begin of the present cycle of the first leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Cycle {
    elapsed: f64,
    travelled: f64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct LegState {
    phase: f64,
    /// Whether the foot was off the ground since its last take-off by phase.
    lifted: bool,
    last: Option<TouchDown>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct TouchDown {
    /// Time since then \[s\].
    age: f64,
    /// Place in front of the trunk \[m\].
    reach: f64,
    /// Change of the step length at that time \[m\].
    change: f64,
}

impl State {
    pub(super) fn new(legs: usize) -> Self {
        Self {
            odometry: Odometry::new(legs),
            legs: vec![LegState::default(); legs],
            cycle: None,
            stride: None,
            last_stride: 0.0,
            strides: 0,
            unchanged: 0,
            change: 0.0,
        }
    }

    /// Number of legs of a state that is consistent, else 0.
    pub(super) fn legs(&self) -> usize {
        let count = self.legs.len();
        if self.odometry.legs() == count {
            count
        } else {
            0
        }
    }

    pub(super) fn change(&self) -> f64 {
        self.change
    }

    /// Distance of the trunk from its start \[m\].
    pub(super) fn travelled(&self, plan: &Plan) -> f64 {
        plan.scale * self.odometry.travelled - plan.offset
    }

    /// Processes the feet at the end of `seconds`, and the phases of their legs. Returns the duration
    /// of the last cycle of the first leg if it is complete \[s\].
    pub(super) fn step(
        &mut self,
        seconds: f64,
        feet: &[Foot],
        phases: impl Iterator<Item = f64>,
    ) -> Option<f64> {
        self.odometry.step(seconds, feet);
        let mut begins = false;
        for (n, ((leg, foot), phase)) in self.legs.iter_mut().zip(feet).zip(phases).enumerate() {
            let took_off = leg.step(seconds, *foot, phase, self.change);
            begins |= took_off && n == 0;
        }
        if let Some(cycle) = &mut self.cycle {
            cycle.elapsed += seconds;
        }
        if !begins {
            return None;
        }
        let travelled = self.odometry.travelled;
        let elapsed = 0.0;
        let last = self.cycle.replace(Cycle { elapsed, travelled })?;
        self.measure(travelled - last.travelled);
        Some(last.elapsed)
    }

    /// Processes the stride of the last cycle.
    fn measure(&mut self, stride: f64) {
        self.unchanged = if self.change == 0.0 {
            self.unchanged.saturating_add(1)
        } else {
            0
        };
        let even = (stride - self.last_stride).abs() <= STRIDE_TOLERANCE * stride.abs();
        if even && self.unchanged > 1 {
            self.strides = self.strides.saturating_add(1);
            let mean = self.stride.unwrap_or(stride);
            let weight = (1.0 / f64::from(self.strides)).max(STRIDE_WEIGHT);
            self.stride = Some(mean + weight * (stride - mean));
        }
        self.last_stride = stride;
    }

    /// Plans the next cycles, of this duration \[s\]; `next` is overwritten.
    pub(super) fn plan(&mut self, duration: f64, plan: &Plan, next: &mut Vec<NextFootfall>) {
        let (Some(obstacle), Some(stride)) = (plan.obstacle, self.stride) else {
            self.change = 0.0;
            return;
        };
        next.clear();
        next.extend(self.legs.iter().filter_map(|leg| leg.next(duration)));
        let prediction = Prediction {
            travelled: self.travelled(plan),
            stride: plan.scale * stride,
            slope: plan.slope,
            legs: next,
        };
        self.change = prediction.change(obstacle, plan.margin, plan.most, self.change);
    }
}

impl LegState {
    /// Processes an iteration; returns whether the leg takes off by its phase.
    fn step(&mut self, seconds: f64, foot: Foot, phase: f64, change: f64) -> bool {
        if let Some(last) = &mut self.last {
            last.age += seconds;
        }
        let took_off = phase < self.phase - PI;
        self.phase = phase;
        self.lifted |= !foot.stands() && phase < PI;
        // A foot that scuffs the ground early in its swing has not landed.
        if self.lifted && foot.stands() && phase > FRAC_PI_2 {
            self.lifted = false;
            self.last = Some(TouchDown {
                age: 0.0,
                reach: foot.x,
                change,
            });
        }
        took_off
    }

    /// The next footfall in a gait with cycles of this duration \[s\]; none before the first.
    fn next(&self, duration: f64) -> Option<NextFootfall> {
        let last = self.last?;
        let cycles = 1.0 - last.age / duration;
        Some(NextFootfall {
            cycles: cycles.max(0.0),
            reach: last.reach,
            change: last.change,
        })
    }
}
