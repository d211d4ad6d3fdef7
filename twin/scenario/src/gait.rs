//! Claims about a gait as a whole, and the fitness by which gaits are optimised.

use twinrig_document::Place;
use twinrig_kernel::Unit;

use crate::limits::Limits;

/// A claim about the gait within the window.
#[derive(Clone, Debug, PartialEq)]
pub struct GaitClaim {
    /// Measure.
    pub measure: GaitMeasure,
    /// Its limits.
    pub limits: Limits,
    /// Place of the measure in the scenario.
    pub place: Place,
}

/// Measure of a gait.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GaitMeasure {
    /// Staged fitness of the thesis, table 3.4, as one number \[1\]: see [`Fitness`].
    Fitness(FitnessScales),
    /// Share of time in which a foot is on the ground in its swing phase or off the ground in its
    /// stance phase, mean of the legs \[1\].
    Mismatch,
    /// Sum of the slips of all footsteps of all legs \[m\].
    Slip,
    /// Share of time in which no foot is on the ground \[1\].
    FlightShare,
    /// Positive work of the drives over weight and distance along the initial heading \[1\].
    CostOfTransport,
    /// Froude number V²/(g h) \[1\], of the speed V along the initial heading and the mean height
    /// h of the trunk (thesis, section 4.1.1).
    Froude,
    /// Strouhal number f h/V \[1\], of the frequency f of the touch-downs of the first leg (thesis,
    /// section 4.1.1).
    Strouhal,
    /// Change of the trunk's state from one cycle to the next \[1\]: root mean square over the
    /// touch-downs of the first leg, of height over its first value, roll, pitch, and speed over
    /// the root of gravity and height. 0 for a limit cycle.
    CycleResidual,
}

impl GaitMeasure {
    /// Returns the unit of the measured value.
    pub const fn unit(self) -> Unit {
        match self {
            Self::Slip => Unit::Meter,
            Self::Fitness(_)
            | Self::Mismatch
            | Self::FlightShare
            | Self::CostOfTransport
            | Self::Froude
            | Self::Strouhal
            | Self::CycleResidual => Unit::One,
        }
    }

    /// Returns whether the measure compares contacts with the phases of the controller.
    pub(crate) fn requires_phases(self) -> bool {
        matches!(self, Self::Fitness(_) | Self::Mismatch)
    }

    /// Returns whether a fall is a part of the measured value, not a reason against having one.
    pub(crate) fn includes_falls(self) -> bool {
        matches!(self, Self::Fitness(_))
    }
}

/// Scales of the staged fitness that its source does not print.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitnessScales {
    /// Unit of the slip in exp(−slip²/500) \[m\].
    pub slip: f64,
    /// Unit of the sum of pitch and roll in exp(−(α + β)/0.3) \[rad\].
    pub angle: f64,
    /// Cycle residual at which the fitness falls to 1/e, from stage 1 on; none: it has no
    /// influence, as in the thesis.
    pub residual: Option<f64>,
}

impl FitnessScales {
    /// Unit of the slip: ASSUMED, the thesis prints none.
    pub const SLIP_M: f64 = 1.0;
    /// Unit of the angles: ASSUMED, the thesis prints none.
    pub const ANGLE_RAD: f64 = 1.0;
}

impl Default for FitnessScales {
    fn default() -> Self {
        Self {
            slip: Self::SLIP_M,
            angle: Self::ANGLE_RAD,
            residual: None,
        }
    }
}

/// Quantities of the staged fitness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitnessTerms {
    /// Mean speed along the initial heading, up to a fall \[m/s\].
    pub speed: f64,
    /// Share of the run before a fall; 1 without one.
    pub survived: f64,
    /// [`GaitMeasure::Mismatch`].
    pub mismatch: f64,
    /// [`GaitMeasure::Slip`] \[m\].
    pub slip: f64,
    /// Peak-to-peak roll \[rad\].
    pub roll: f64,
    /// Peak-to-peak pitch \[rad\].
    pub pitch: f64,
    /// [`GaitMeasure::CycleResidual`]; none with less than two cycles.
    pub residual: Option<f64>,
}

/// Staged fitness of the thesis, table 3.4: a gait of a higher stage is better than any of a lower
/// one; gaits of one stage are ordered by their values.
///
/// | stage | value | next stage if |
/// |---|---|---|
/// | 0 | V exp(t − 1) | survived share t > 0.5 |
/// | 1 | V exp(−10 c²) | mismatch c < 0.3 |
/// | 2 | stage 1 · exp(−slip²/500) | mismatch c < 0.3 |
/// | 3 | stage 2 · exp(−(pitch + roll)/0.3) | – |
///
/// The thesis prints "c > 0.3", which would let mismatched gaits advance. Stage 2 has the condition
/// of stage 1, so no gait stays in it: a gait that is not in stages 0 and 1 is in stage 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitness {
    /// Stage: 0, 1 or 3.
    pub stage: u8,
    /// Value within the stage: the speed, reduced by the factors of the stage \[m/s\].
    pub value: f64,
}

/// Survived share above which a gait leaves stage 0.
const SURVIVED: f64 = 0.5;
/// Mismatch below which a gait leaves stage 1, and stage 2.
const MISMATCH: f64 = 0.3;
const MISMATCH_WEIGHT: f64 = 10.0;
const SLIP_SQUARED: f64 = 500.0;
const ANGLE: f64 = 0.3;

impl Fitness {
    /// Greatest value of [`Fitness::number`], exclusive.
    pub(crate) const END: f64 = 4.0;

    /// Returns the fitness of a gait.
    pub fn of(terms: &FitnessTerms, scales: &FitnessScales) -> Self {
        if terms.survived <= SURVIVED {
            let value = terms.speed * libm::exp(terms.survived - 1.0);
            return Self { stage: 0, value };
        }
        let mismatch = libm::exp(-MISMATCH_WEIGHT * terms.mismatch * terms.mismatch);
        let regularity = scales.residual.map_or(1.0, |scale| {
            let residual = terms.residual.unwrap_or(f64::INFINITY);
            libm::exp(-residual / scale)
        });
        let value = terms.speed * mismatch * regularity;
        if terms.mismatch >= MISMATCH {
            return Self { stage: 1, value };
        }
        let slip = terms.slip / scales.slip;
        let angles = (terms.pitch + terms.roll) / scales.angle;
        let value = value * libm::exp(-slip * slip / SLIP_SQUARED) * libm::exp(-angles / ANGLE);
        Self { stage: 3, value }
    }

    /// Returns stage and value as one number with the same order: the stage, and in addition a
    /// share of 1 that rises with the value v \[m/s\] as (1 + v/(1 + |v|))/2.
    pub fn number(&self) -> f64 {
        let value = self.value;
        f64::from(self.stage) + 0.5 * (1.0 + value / (1.0 + value.abs()))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn terms() -> impl Strategy<Value = FitnessTerms> {
        let shares = (0.0..=1.0_f64, 0.0..=1.0_f64);
        let angles = (0.0..1.0_f64, 0.0..1.0_f64);
        (-2.0..2.0_f64, shares, 0.0..30.0_f64, angles).prop_map(
            |(speed, (survived, mismatch), slip, (roll, pitch))| FitnessTerms {
                speed,
                survived,
                mismatch,
                slip,
                roll,
                pitch,
                residual: Some(0.01),
            },
        )
    }

    proptest! {
        /// The weak ordering of the thesis: first the stage, then the value.
        #[test]
        fn number_orders_gaits_as_stages_and_values_do(a in terms(), b in terms()) {
            let scales = FitnessScales::default();
            let (a, b) = (Fitness::of(&a, &scales), Fitness::of(&b, &scales));
            let staged = (a.stage.cmp(&b.stage)).then(a.value.total_cmp(&b.value));
            prop_assert!(a.number() >= 0.0 && a.number() < Fitness::END);
            if (a.value - b.value).abs() > 1e-12 || a.stage != b.stage {
                prop_assert_eq!(a.number().total_cmp(&b.number()), staged);
            }
        }

        #[test]
        fn forward_gait_gains_by_less_mismatch_slip_and_swaying(gait in terms(), less in 0.0..1.0_f64) {
            let number = |gait: &FitnessTerms| Fitness::of(gait, &FitnessScales::default()).number();
            let gait = FitnessTerms { speed: gait.speed.abs(), ..gait };
            let better = [
                FitnessTerms { mismatch: less * gait.mismatch, ..gait },
                FitnessTerms { slip: less * gait.slip, ..gait },
                FitnessTerms { roll: less * gait.roll, ..gait },
                FitnessTerms { pitch: less * gait.pitch, ..gait },
            ];
            for better in better {
                // A gait that enters stage 3 pays for slip and swaying, but gains a stage.
                prop_assert!(number(&better) >= number(&gait));
            }
        }
    }

    #[test]
    fn values_are_those_of_the_table() {
        let terms = FitnessTerms {
            speed: 0.8,
            survived: 1.0,
            mismatch: 0.2,
            slip: 5.0,
            roll: 0.05,
            pitch: 0.04,
            residual: Some(0.02),
        };
        let fitness = |terms| Fitness::of(&terms, &FitnessScales::default());
        let close = |a: Fitness, stage, value: f64| {
            assert_eq!(a.stage, stage);
            assert!((a.value - value).abs() < 1e-12, "{a:?} for {value}");
        };
        // 0.8 e^(−0.4) e^(−0.05) e^(−0.3), by SciPy.
        close(fitness(terms), 3, 0.377_893_242_192_811_84);
        let mismatched = FitnessTerms {
            mismatch: 0.3,
            ..terms
        };
        close(fitness(mismatched), 1, 0.325_255_727_792_479_3); // 0.8 e^(−0.9)
        let fallen = FitnessTerms {
            survived: 0.5,
            ..terms
        };
        close(fitness(fallen), 0, 0.485_224_527_770_106_7); // 0.8 e^(−0.5)
        let scales = FitnessScales {
            residual: Some(0.02),
            ..FitnessScales::default()
        };
        close(
            Fitness::of(&terms, &scales),
            3,
            0.377_893_242_192_811_84 / std::f64::consts::E,
        );
    }
}
