//! Axial stiffness of the leg, and its length under a load.

use crate::leg::LegError;
use crate::leg::equilibrium::Stop;
use crate::leg::pantograph::Pantograph;

/// Range of lengths for the greatest stiffness, as shares of the greatest length: shorter ones are
/// not reached in a gait, and at the end the preload closes the pantograph.
const LENGTHS: [f64; 2] = [0.7, 0.98];
/// Intervals of that range.
const INTERVALS: u32 = 400;
/// Intervals in which a load is sought, before bisection.
const SCAN: u32 = 64;
/// Step of differences, as a share of the greatest length: 0.1 mm for 148 mm.
const STEP: f64 = 1e-4 / 0.148;

/// Length of a leg that carries a load without a hip torque, its cable slack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadedLength {
    /// Distance from hip to foot \[m\].
    pub length: f64,
    /// Stop that carries the part of the load that the springs do not: [`Stop::Extended`] where the
    /// preload alone carries the load, [`Stop::Bottomed`] where the springs are too weak for it.
    pub stop: Option<Stop>,
}

impl Pantograph {
    /// Returns the slope of the axial force over the length, without a hip torque and with a slack
    /// cable: the stiffness of thesis, eq. 2.21 \[N/m\]. At full extension the slope is that of
    /// shorter legs, where the stop carries nothing.
    ///
    /// # Errors
    /// [`LegError::OutOfReach`] beyond the longest leg, and within 0.1 % of the shortest one.
    pub fn axial_stiffness(&self, length: f64) -> Result<f64, LegError> {
        self.push(length)?;
        let step = STEP * self.length_max();
        let (shorter, longer) = (length - step, (length + step).min(self.nearly_extended()));
        Ok((self.push(shorter)? - self.push(longer)?) / (longer - shorter))
    }

    /// Returns the greatest axial stiffness in the range of a gait, 0.7 to 0.98 of the greatest
    /// length or the part of it that the leg reaches (thesis, section 2.7.1) \[N/m\].
    ///
    /// # Errors
    /// [`LegError::OutOfReach`] if the leg reaches no part of that range.
    pub fn greatest_axial_stiffness(&self) -> Result<f64, LegError> {
        let [shortest, longest] = LENGTHS;
        let stiffness = |point: u32| {
            let share = shortest + (longest - shortest) * f64::from(point) / f64::from(INTERVALS);
            self.axial_stiffness(share * self.length_max())
        };
        let reached = (0..=INTERVALS).filter_map(|point| stiffness(point).ok());
        match reached.reduce(f64::max) {
            Some(greatest) => Ok(greatest),
            None => stiffness(INTERVALS),
        }
    }

    /// Returns the greatest load that the preload alone carries, the leg extended \[N\].
    ///
    /// # Errors
    /// [`LegError`] never for a mechanism that [`Self::new`] accepts.
    pub fn preload_force(&self) -> Result<f64, LegError> {
        self.push(self.nearly_extended())
    }

    /// Returns a length within a millionth of the extended leg, where the stop carries nothing.
    fn nearly_extended(&self) -> f64 {
        self.length_max() * (1.0 - 1e-6)
    }

    /// Returns the length of the leg under an axial load \[N\].
    ///
    /// # Errors
    /// [`LegError::NotFinite`] for a load that is NaN or infinite.
    pub fn length_under(&self, load: f64) -> Result<LoadedLength, LegError> {
        if !load.is_finite() {
            return Err(LegError::NotFinite { what: "load" });
        }
        let step = (self.length_max() - self.length_min()) / f64::from(SCAN);
        let mut longer = self.nearly_extended();
        if self.preload_force()? >= load {
            return Ok(LoadedLength {
                length: self.length_max(),
                stop: Some(Stop::Extended),
            });
        }
        for point in 1..SCAN {
            let mut shorter = self.length_max() - step * f64::from(point);
            match self.push(shorter) {
                Ok(force) if force < load => longer = shorter,
                Ok(_) => {
                    for _ in 0..50 {
                        let middle = 0.5 * (shorter + longer);
                        if self.push(middle)? < load {
                            longer = middle;
                        } else {
                            shorter = middle;
                        }
                    }
                    return Ok(LoadedLength {
                        length: 0.5 * (shorter + longer),
                        stop: None,
                    });
                }
                Err(_) => break,
            }
        }
        Ok(LoadedLength {
            length: self.length_min(),
            stop: Some(Stop::Bottomed),
        })
    }

    /// Returns the force with which the leg pushes at a length \[N\].
    fn push(&self, length: f64) -> Result<f64, LegError> {
        Ok(self.equilibrium(length, 0.0, f64::INFINITY)?.axial)
    }
}

#[cfg(test)]
mod tests {
    use crate::Leg;
    use libm::sqrt;
    use proptest::prelude::*;

    use super::*;

    /// Returns a leg whose pantograph stays closed, and its axial force by the closed form
    /// `k (rest − l_d) · dl_d/dL`, with the diagonal `l_d` and the length `L` of one knee angle.
    fn closed(length: f64) -> (Pantograph, f64) {
        let mut leg = Leg::example();
        leg.parallel.stiffness = 1e9;
        let a = leg.l1 + leg.l3 - leg.l_delta;
        let cosine = (length * length - leg.l2 * leg.l2 - a * a) / (2.0 * leg.l2 * a);
        let squares = leg.l2 * leg.l2 + leg.l_delta * leg.l_delta;
        let diagonal = sqrt(squares + 2.0 * leg.l2 * leg.l_delta * cosine);
        let pantograph = Pantograph::new(&leg).unwrap();
        let rest = pantograph.diagonal_max() + leg.diagonal.preload;
        let slope = leg.l_delta * length / (a * diagonal);
        let force = leg.diagonal.stiffness * (rest - diagonal) * slope;
        (pantograph, force)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn leg_with_closed_pantograph_has_the_length_of_the_closed_form(length in 0.09..0.147_f64) {
            let (leg, force) = closed(length);
            let loaded = leg.length_under(force).unwrap();
            prop_assert_eq!(loaded.stop, None);
            // The parallel spring of 1e9 N/m gives by less than 1 µm.
            prop_assert!((loaded.length - length).abs() < 1e-6, "{loaded:?} {length}");
            let stiffness = leg.axial_stiffness(length).unwrap();
            let (shorter, longer) = (closed(length - 1e-6).1, closed(length + 1e-6).1);
            let slope = (shorter - longer) / 2e-6;
            prop_assert!((stiffness / slope - 1.0).abs() < 1e-3, "{stiffness} {slope}");
        }

        #[test]
        fn length_under_is_the_inverse_of_the_axial_force(load in 0.0..40.0_f64) {
            let leg = Pantograph::new(&Leg::example()).unwrap();
            let loaded = leg.length_under(load).unwrap();
            let force = leg.push(loaded.length.min(leg.nearly_extended()));
            match loaded.stop {
                None => prop_assert!((force.unwrap() - load).abs() < 1e-6),
                Some(Stop::Extended) => prop_assert!(load <= force.unwrap()),
                Some(_) => prop_assert_eq!(loaded.length, leg.length_min()),
            }
        }
    }

    #[test]
    fn stiffness_at_full_extension_is_that_of_shorter_legs() {
        let leg = Pantograph::new(&Leg::example()).unwrap();
        let preload = leg.preload_force().unwrap();
        // There the preload keeps the pantograph closed.
        let longest = leg.length_max();
        let slope = (closed(longest - 1e-4).1 - closed(longest - 1e-5).1) / 9e-5;
        for excess in [1e-9, 1e-6, 1e-3] {
            let loaded = leg.length_under(preload * (1.0 + excess)).unwrap();
            assert_eq!(loaded.stop, None);
            let stiffness = leg.axial_stiffness(loaded.length).unwrap();
            // The slope changes by less than 1 % in 0.1 mm.
            assert!(
                (stiffness / slope - 1.0).abs() < 0.01,
                "{stiffness} {slope}"
            );
        }
        assert!(leg.axial_stiffness(1.001 * longest).is_err());
    }

    #[test]
    fn greatest_axial_stiffness_matches_the_thesis() {
        let leg = Pantograph::new(&Leg::example()).unwrap();
        let stiffness = leg.greatest_axial_stiffness().unwrap();
        // Thesis, section 2.7.1: 253.27 N/m; the geometry has three digits.
        assert!((stiffness - 253.27).abs() < 0.01 * 253.27, "{stiffness}");
    }

    #[test]
    fn load_without_end_is_refused_and_one_beyond_the_springs_bottoms_out() {
        let leg = Pantograph::new(&Leg::example()).unwrap();
        assert!(leg.length_under(f64::NAN).is_err());
        assert!(leg.length_under(f64::INFINITY).is_err());
        let bottomed = leg.length_under(1e6).unwrap();
        assert_eq!(bottomed.stop, Some(Stop::Bottomed));
    }
}
