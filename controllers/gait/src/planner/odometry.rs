//! Distance travelled, from the joint angles and loads of the legs.

use serde::{Deserialize, Serialize};

/// Load from which on a foot stands \[N\].
pub(super) const LOAD_STANDING: f64 = 0.5;
/// Greatest load \[N\]: beyond any robot, and sums of it do not overflow.
const LOAD_MAX: f64 = 1e6;

/// A foot as the robot measures it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Foot {
    /// Place in front of the trunk's centre of mass \[m\].
    pub x: f64,
    /// Load \[N\].
    pub load: f64,
}

impl Foot {
    /// Creates a foot of measured values. A foot without a place, or with an impossible load,
    /// carries none.
    pub(super) fn measured(x: f64, load: f64) -> Self {
        if x.is_finite() && load.is_finite() {
            let load = load.clamp(0.0, LOAD_MAX);
            Self { x, load }
        } else {
            Self::default()
        }
    }

    pub(super) fn stands(&self) -> bool {
        self.load >= LOAD_STANDING
    }
}

/// Distance that the trunk has travelled, if no foot slips: by as much as the feet on the ground
/// moved back relative to it, in the mean by load. In flight the trunk keeps its speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Odometry {
    last: Vec<Foot>,
    /// Speed \[m/s\].
    speed: f64,
    /// Distance \[m\].
    pub travelled: f64,
}

impl Odometry {
    pub(super) fn new(legs: usize) -> Self {
        Self {
            last: vec![Foot::default(); legs],
            speed: 0.0,
            travelled: 0.0,
        }
    }

    pub(super) fn legs(&self) -> usize {
        self.last.len()
    }

    /// Processes the feet at the end of `seconds`.
    pub(super) fn step(&mut self, seconds: f64, feet: &[Foot]) {
        let (mut moved, mut loads) = (0.0, 0.0);
        for (last, now) in self.last.iter_mut().zip(feet) {
            // A foot that lands or lifts off has no weight.
            let load = last.load.min(now.load);
            moved += load * (last.x - now.x);
            loads += load;
            *last = *now;
        }
        if seconds > 0.0 {
            if loads >= LOAD_STANDING {
                self.speed = moved / loads / seconds;
            }
            self.travelled += self.speed * seconds;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Feet that stay where they land, of a trunk at any speed: only flight may be wrong.
        #[test]
        fn feet_that_do_not_slip_measure_the_way(
            speeds in prop::collection::vec(-2.0..2.0_f64, 50),
            loads in prop::collection::vec((0.6..20.0_f64, 0.6..20.0_f64), 50),
            first_stands in prop::collection::vec(any::<bool>(), 50),
        ) {
            let mut odometry = Odometry::new(2);
            let (mut trunk, mut places, mut moved_before) = (0.0, [0.1, -0.1], 0.0);
            let start = |places: [f64; 2]| places.map(|x| Foot::measured(x, 5.0));
            odometry.step(0.0, &start(places));
            for n in 0..50 {
                trunk += 2e-3 * speeds[n];
                let lifted = usize::from(first_stands[n]);
                // Within one iteration the other foot stands at both ends.
                let mut feet = [loads[n].0, loads[n].1];
                feet[lifted] = 0.0;
                let measured = [0, 1].map(|leg| Foot::measured(places[leg] - trunk, feet[leg]));
                let before = odometry.travelled;
                odometry.step(2e-3, &measured);
                let stands = |leg: usize| n == 0 || usize::from(first_stands[n - 1]) != leg;
                // A foot that lands says nothing: the trunk keeps its speed.
                let expected = if stands(1 - lifted) { 2e-3 * speeds[n] } else { moved_before };
                let moved = odometry.travelled - before;
                prop_assert!((moved - expected).abs() < 1e-12, "{moved}");
                moved_before = moved;
                places[lifted] = trunk + 0.1 * speeds[n];
            }
        }
    }

    #[test]
    fn impossible_readings_move_nothing() {
        let mut odometry = Odometry::new(1);
        for (x, load) in [
            (0.1, 5.0),
            (f64::NAN, 5.0),
            (0.3, f64::INFINITY),
            (0.5, -3.0),
        ] {
            odometry.step(2e-3, &[Foot::measured(x, load)]);
            assert_eq!(odometry.travelled, 0.0, "{x} {load}");
        }
    }
}
