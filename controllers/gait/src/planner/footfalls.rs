//! Prediction of footfalls, and the change of the step length that keeps them off an obstacle.

/// Cycles ahead in which footfalls are predicted.
const CYCLES_AHEAD: f64 = 8.0;
/// Number of changes that are tried in each direction.
const TRIALS: u32 = 40;
/// Missing margin that is accepted for an unaltered change, over the alteration: every alteration
/// disturbs the gait for some steps, which are predicted worse.
const RELUCTANCE: f64 = 0.5;

/// Section of the way that no foot may touch, in front of the place of the start \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Obstacle {
    pub near: f64,
    pub far: f64,
}

impl Obstacle {
    /// Distance of a place from the obstacle \[m\]; negative within.
    fn clearance(self, x: f64) -> f64 {
        (self.near - x).max(x - self.far)
    }
}

/// Next footfall of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NextFootfall {
    /// Time to it, in cycles.
    pub cycles: f64,
    /// Place at which the leg last landed in front of the trunk \[m\].
    pub reach: f64,
    /// Change of the step length with which it landed there \[m\].
    pub change: f64,
}

/// State of the gait from which footfalls follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prediction<'a> {
    /// Distance of the trunk from the start \[m\].
    pub travelled: f64,
    /// Stride without a change \[m\].
    pub stride: f64,
    /// Change of the stride over change of the step length.
    pub slope: f64,
    pub legs: &'a [NextFootfall],
}

impl Prediction<'_> {
    /// Places of the footfalls of a leg under a change of the step length from now on \[m\].
    ///
    /// The trunk takes its new stride at once, and a foot lands half of the change farther ahead.
    fn footfalls(&self, leg: &NextFootfall, change: f64) -> impl Iterator<Item = f64> {
        let stride = self.stride + self.slope * change;
        let first = self.travelled + leg.reach + 0.5 * (change - leg.change);
        let cycles = std::iter::successors(Some(leg.cycles), |cycles| Some(cycles + 1.0));
        cycles
            .take_while(|&cycles| cycles <= CYCLES_AHEAD)
            .map(move |cycles| first + stride * cycles)
    }

    /// Least clearance of all footfalls \[m\].
    fn clearance(&self, obstacle: Obstacle, change: f64) -> f64 {
        let legs = self.legs.iter();
        let places = legs.flat_map(|leg| self.footfalls(leg, change));
        places
            .map(|x| obstacle.clearance(x))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the change of the step length, up to `most` either way, with the least sum of the
    /// missing `margin` from the obstacle and [`RELUCTANCE`] times the alteration of the `present`
    /// change; 0 beyond the obstacle.
    pub(super) fn change(&self, obstacle: Obstacle, margin: f64, most: f64, present: f64) -> f64 {
        if self.is_beyond(obstacle) {
            return 0.0;
        }
        let sizes = (1..=TRIALS).map(|trial| most * f64::from(trial) / f64::from(TRIALS));
        let trials = std::iter::once(0.0).chain(sizes.flat_map(|size| [size, -size]));
        let mut best = (f64::INFINITY, 0.0);
        for change in trials {
            let missing = (margin - self.clearance(obstacle, change)).max(0.0);
            let cost = missing + RELUCTANCE * (change - present).abs();
            if cost < best.0 {
                best = (cost, change);
            }
        }
        best.1
    }

    /// Whether all legs next land beyond the obstacle, without a change.
    fn is_beyond(&self, obstacle: Obstacle) -> bool {
        let mut next = self.legs.iter().map(|leg| self.footfalls(leg, 0.0).next());
        next.all(|x| x.is_some_and(|x| x > obstacle.far))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Footfalls of a gait that obeys the closed form, by stepping through time.
    fn walked(prediction: &Prediction<'_>, change: f64) -> Vec<f64> {
        let stride = prediction.stride + prediction.slope * change;
        let (mut places, ticks) = (Vec::new(), 50);
        for leg in prediction.legs {
            let reach = leg.reach + 0.5 * (change - leg.change);
            for tick in 0..=8 * ticks {
                let cycles = f64::from(tick) / f64::from(ticks);
                let turn = cycles - leg.cycles;
                if turn >= -1e-9 && (turn - turn.round()).abs() < 1e-9 {
                    places.push(prediction.travelled + stride * cycles + reach);
                }
            }
        }
        places
    }

    /// Sum that the change minimises, by footfalls found in time.
    fn cost(p: &Prediction<'_>, obstacle: Obstacle, change: f64, present: f64) -> f64 {
        let middle = 0.5 * (obstacle.near + obstacle.far);
        let half = obstacle.far - middle;
        let places = walked(p, change);
        let clearance = places.iter().map(|x| (x - middle).abs() - half);
        let missing = (MARGIN - clearance.fold(f64::INFINITY, f64::min)).max(0.0);
        missing + RELUCTANCE * (change - present).abs()
    }

    const MARGIN: f64 = 0.012;

    proptest! {
        #[test]
        fn chosen_change_is_the_best_of_all(
            phases in prop::array::uniform4(1_u32..=50),
            reaches in prop::array::uniform4(-0.1..0.15_f64),
            near in 0.8..1.5_f64,
            present in -40_i32..=40,
        ) {
            let leg = |n: usize| NextFootfall {
                cycles: f64::from(phases[n]) / 50.0,
                reach: reaches[n],
                change: 0.0,
            };
            let legs = [0, 1, 2, 3].map(leg);
            let prediction = Prediction { travelled: 0.4, stride: 0.17, slope: 1.7, legs: &legs };
            let obstacle = Obstacle { near, far: near + 0.025 };
            let trial = |n: i32| 0.02 * f64::from(n) / 40.0;
            let present = trial(present);
            let change = prediction.change(obstacle, MARGIN, 0.02, present);
            let found = cost(&prediction, obstacle, change, present);
            for n in -40..=40 {
                let other = cost(&prediction, obstacle, trial(n), present);
                prop_assert!(found <= other + 1e-9, "{} is better than {change}", trial(n));
            }
        }
    }

    #[test]
    fn steps_are_unchanged_beyond_the_obstacle() {
        let leg = |cycles, reach| NextFootfall {
            cycles,
            reach,
            change: 0.01,
        };
        let legs = [leg(0.3, 0.1), leg(0.8, -0.1)];
        let prediction = Prediction {
            travelled: 1.0,
            stride: 0.17,
            slope: 1.7,
            legs: &legs,
        };
        // The hind leg next lands at 1.031.
        for (far, expected) in [(1.02, 0.0), (1.04, 0.01)] {
            let obstacle = Obstacle {
                near: far - 0.025,
                far,
            };
            let change = prediction.change(obstacle, 0.0, 0.02, 0.01);
            assert_eq!(change, expected, "{far}");
        }
    }
}
