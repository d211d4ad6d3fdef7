//! Lift of a cam as a function of its angle.

use std::f64::consts::{E, PI, TAU};

use crate::spline;

/// Lift of the roller over one turn of the cam, before scratches.
#[derive(Clone, Debug, PartialEq)]
pub enum CamProfile {
    /// Harmonic rise and return: lift/2 (1 − cos φ) \[m\].
    Harmonic {
        /// Greatest lift \[m\].
        lift: f64,
    },
    /// Bump of the thesis' simulation (eq. 4.17 with its sign corrected), greatest at half a turn:
    /// lift · e · e^(−1/(1 − x²)) with x = φ/π − 1.
    Bump {
        /// Greatest lift \[m\].
        lift: f64,
    },
    /// Given lifts at even distances over one turn, the last equal to the first; between them a
    /// periodic cubic spline \[m\].
    Table {
        /// Lifts \[m\].
        lifts: Vec<f64>,
    },
}

/// Lift with its first and second derivative by the angle \[m, m/rad, m/rad²\].
pub(crate) type Lift = [f64; 3];

/// Values of a profile from which lifts at any angle are computed.
pub(crate) enum Sampled<'p> {
    Closed(&'p CamProfile),
    Spline { lifts: &'p [f64], slopes: Vec<f64> },
}

impl CamProfile {
    pub(crate) fn sampled(&self) -> Sampled<'_> {
        match self {
            Self::Table { lifts } => {
                let lifts = &lifts[..lifts.len() - 1];
                Sampled::Spline {
                    lifts,
                    slopes: spline::slopes(lifts, TAU / lifts.len() as f64),
                }
            }
            closed => Sampled::Closed(closed),
        }
    }

    /// Returns the greatest lift \[m\].
    pub fn lift(&self) -> f64 {
        match self {
            Self::Harmonic { lift } | Self::Bump { lift } => *lift,
            Self::Table { lifts } => lifts.iter().copied().fold(0.0, f64::max),
        }
    }
}

impl Sampled<'_> {
    /// Returns the lift at an angle in 0 … 2π \[rad\].
    pub(crate) fn at(&self, angle: f64) -> Lift {
        match self {
            Self::Closed(CamProfile::Harmonic { lift }) => {
                let half = 0.5 * lift;
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                [half * (1.0 - cos), half * sin, half * cos]
            }
            Self::Closed(CamProfile::Bump { lift }) => bump(*lift, angle),
            Self::Closed(CamProfile::Table { .. }) => [0.0; 3],
            Self::Spline { lifts, slopes } => spline::at(lifts, slopes, angle),
        }
    }
}

fn bump(lift: f64, angle: f64) -> Lift {
    let x = angle / PI - 1.0;
    let rest = 1.0 - x * x;
    if rest <= 0.0 {
        return [0.0; 3];
    }
    let value = lift * E * libm::exp(-1.0 / rest);
    let square = rest * rest;
    [
        value,
        value * -2.0 * x / square / PI,
        value * (6.0 * x * x * x * x - 2.0) / (square * square) / (PI * PI),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(points: u32) -> CamProfile {
        let lift = |n: u32| {
            let angle = TAU * f64::from(n) / f64::from(points);
            5e-3 * (1.0 - libm::cos(angle)) + 1e-3 * (1.0 - libm::cos(3.0 * angle))
        };
        let mut lifts: Vec<f64> = (0..points).map(lift).collect();
        lifts.push(lifts[0]);
        CamProfile::Table { lifts }
    }

    #[test]
    fn derivatives_are_those_of_the_lift() {
        let profiles = [
            CamProfile::Harmonic { lift: 12e-3 },
            CamProfile::Bump { lift: 12e-3 },
            table(72),
        ];
        for profile in &profiles {
            let sampled = profile.sampled();
            for n in 1..100 {
                let (angle, h) = (f64::from(n) * 0.0628, 1e-5);
                let [before, at, after] = [-h, 0.0, h].map(|by| sampled.at(angle + by));
                for order in 0..2 {
                    let slope = (after[order] - before[order]) / (2.0 * h);
                    // Truncation of the difference: h²/6 times the third derivative.
                    let error = (slope - at[order + 1]).abs();
                    assert!(error < 1e-8, "{profile:?} at {angle}: {error}");
                }
            }
        }
    }

    #[test]
    fn spline_of_a_smooth_lift_converges_with_the_fourth_power() {
        let error = |points: u32| {
            let profile = table(points);
            let sampled = profile.sampled();
            let exact = |angle: f64| {
                5e-3 * (1.0 - libm::cos(angle)) + 1e-3 * (1.0 - libm::cos(3.0 * angle))
            };
            let angles = (0..1000).map(|n| TAU * f64::from(n) / 1000.0);
            let errors = angles.map(|angle| (sampled.at(angle)[0] - exact(angle)).abs());
            errors.fold(0.0, f64::max)
        };
        let ratio = error(36) / error(72);
        assert!((ratio - 16.0).abs() < 2.0, "{ratio}");
    }
}
