//! Static equilibrium of the mass-less leg: balance of springs, stops, cable and a hip torque at a
//! given leg length.

use libm::{acos, atan2, cos, sin};

use crate::leg::LegError;
use crate::leg::joints::Joints;
use crate::leg::pantograph::{Pantograph, Planar, cross};
use crate::leg::pose::{Length, Pose};

/// Tolerance for rounding errors of poses at a stop \[m\].
const ROUNDING: f64 = 1e-12;

/// Mass-less leg in equilibrium, its axis vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium {
    /// Absolute angle of the first segment, with the foot vertically below the hip \[rad\].
    pub hip: f64,
    /// Opening of the pantograph, q2 + q3 \[rad\].
    pub opening: f64,
    /// Passive joints.
    pub joints: Joints,
    /// Spring energy \[J\].
    pub energy: f64,
    /// Force of the leg on the ground along its axis, pushing positive \[N\].
    pub axial: f64,
    /// Force of the leg on the ground across its axis, backwards (−x) positive \[N\]: hip torque
    /// over length.
    pub transverse: f64,
    /// Force in the middle segment, tension positive \[N\].
    pub middle_segment: f64,
    /// Stop that keeps the leg from the free energy minimum, and its force along the length it
    /// limits \[N\].
    pub active_stop: Option<(Stop, f64)>,
}

/// Unilateral limits of the mechanism.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stop {
    /// Pantograph closed: the parallel rod at its shortest, `l_p` ≥ `l2`.
    Closed,
    /// Pantograph fully open: the parallel rod at its longest.
    Open,
    /// Knee extended: the diagonal at its longest.
    Extended,
    /// Leg bottomed out: the diagonal at its shortest.
    Bottomed,
    /// The cable is taut.
    Cable,
}

impl Stop {
    /// All stops, in the order that the plants use.
    pub const ALL: [Self; 5] = [
        Self::Closed,
        Self::Open,
        Self::Extended,
        Self::Bottomed,
        Self::Cable,
    ];

    /// Returns the limited length, and +1 for a lower limit of it or −1 for an upper one.
    pub const fn limits(self) -> (Length, f64) {
        match self {
            Self::Closed => (Length::Parallel, 1.0),
            Self::Open => (Length::Parallel, -1.0),
            Self::Extended => (Length::Diagonal, -1.0),
            Self::Bottomed => (Length::Diagonal, 1.0),
            Self::Cable => (Length::Cable, -1.0),
        }
    }
}

impl Pantograph {
    /// Returns the distance of a pose from a stop \[m\], negative beyond it. `cable` is the length
    /// of the taut cable.
    pub fn gap(&self, pose: &Pose, stop: Stop, cable: f64) -> f64 {
        match stop {
            Stop::Closed => pose.parallel - self.l2,
            Stop::Open => self.parallel_max - pose.parallel,
            Stop::Extended => self.diagonal_max - pose.diagonal,
            Stop::Bottomed => pose.diagonal - self.diagonal_min,
            Stop::Cable => cable - pose.cable,
        }
    }

    /// Returns whether a pose lies within the stops of the mechanism, excluding the cable, and
    /// bends knee and ankle to the correct side: the lengths that the stops limit are equal in the
    /// mirrored pose.
    pub fn allows(&self, pose: &Pose) -> bool {
        let bends = cross(pose.along[0], pose.along[1]) < 0.0 && pose.ankle_sine > 0.0;
        bends && self.least_gap(pose, f64::INFINITY) >= -ROUNDING
    }

    /// Minimises `E − τ·hip` over the opening of the pantograph at a leg length (thesis, eq. 2.21
    /// and 2.22, supplemented by the stops of both rods and the hip torque). `cable` is the
    /// greatest length between hip and ankle \[m\].
    ///
    /// The scan that brackets the minimum and the bisection that refines it take some 100
    /// evaluations. It is intended for design and verification; a plant that integrates the hip
    /// angle needs neither.
    ///
    /// # Errors
    /// [`LegError::OutOfReach`] where no opening within the stops results in that length.
    pub fn equilibrium(
        &self,
        length: f64,
        hip_torque: f64,
        cable: f64,
    ) -> Result<Equilibrium, LegError> {
        const SCAN: usize = 240;
        const OPENING_MAX: f64 = 1.6;
        let inside = |opening: f64| {
            self.at_length(length, opening)
                .filter(|pose| self.allows(pose) && cable - pose.cable >= -ROUNDING)
        };
        let at = |i: usize| OPENING_MAX * i as f64 / SCAN as f64;
        let objective = |pose: &Pose| self.spring_energy(pose) - hip_torque * pose.angles()[0];
        let best = (0..=SCAN)
            .filter_map(|i| inside(at(i)).map(|pose| (objective(&pose), i)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i)) = best else {
            return Err(LegError::OutOfReach {
                length,
                least: self.length_min,
                greatest: self.length_max,
            });
        };
        let (left, right) = (at(i.saturating_sub(1)), at(i + 1));
        let low = edge(at(i), left, &inside);
        let high = edge(at(i), right, &inside);
        let opening = self.stationary(length, hip_torque, low, high);
        let pose = self
            .at_length(length, opening)
            .ok_or(LegError::NotFinite { what: "leg length" })?;
        Ok(self.with_stop_force(&pose, opening, hip_torque, cable))
    }

    /// Returns the pose with this length and opening, the foot vertically below the hip.
    fn at_length(&self, length: f64, opening: f64) -> Option<Pose> {
        let (rho, psi) = self.virtual_link(opening);
        let cosine = (length * length - rho * rho - self.l2 * self.l2) / (2.0 * self.l2 * rho);
        if cosine.is_nan() || cosine.abs() > 1.0 {
            return None;
        }
        let (x, z) = self.foot_from_first(psi - acos(cosine), opening);
        let hip = -atan2(z, x);
        self.pose(sin(hip), cos(hip), Planar::new(0.0, -length))
            .ok()
    }

    fn least_gap(&self, pose: &Pose, cable: f64) -> f64 {
        Stop::ALL
            .iter()
            .map(|&stop| self.gap(pose, stop, cable))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the opening at which the derivative of the objective changes sign; the better end if
    /// it does not.
    fn stationary(&self, length: f64, hip_torque: f64, low: f64, high: f64) -> f64 {
        // At a fixed foot the opening affects the hip angle only: the slope of the objective has
        // the sign of (∂E/∂hip − τ) · dhip/dopening, and dhip/dopening does not change sign between
        // two stops.
        let slope = |opening: f64| {
            self.at_length(length, opening).map_or(f64::NAN, |pose| {
                self.spring_gradient(&pose).hip - hip_torque
            })
        };
        let (mut low, mut high) = (low, high);
        let at_low = slope(low);
        if at_low * slope(high) > 0.0 || at_low.is_nan() {
            let objective = |opening: f64| {
                let pose = self.at_length(length, opening);
                pose.map_or(f64::INFINITY, |pose| {
                    self.spring_energy(&pose) - hip_torque * pose.angles()[0]
                })
            };
            return if objective(low) <= objective(high) {
                low
            } else {
                high
            };
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) * at_low > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    fn with_stop_force(
        &self,
        pose: &Pose,
        opening: f64,
        hip_torque: f64,
        cable: f64,
    ) -> Equilibrium {
        const TOUCHING: f64 = 1e-9;
        const UNBALANCED: f64 = 1e-9;
        let angles = pose.angles();
        let mut gradient = self.spring_gradient(pose);
        let excess = gradient.hip - hip_torque;
        let nearest = Stop::ALL
            .into_iter()
            .min_by(|&a, &b| {
                self.gap(pose, a, cable)
                    .total_cmp(&self.gap(pose, b, cable))
            })
            .filter(|&stop| self.gap(pose, stop, cable) < TOUCHING && excess.abs() > UNBALANCED);
        let active_stop = nearest.map(|stop| {
            let (length, sign) = stop.limits();
            let row = self.length_gradient(pose, length) * sign;
            let force = excess / row.hip;
            gradient = gradient + row * -force;
            (stop, force)
        });
        Equilibrium {
            hip: angles[0],
            opening,
            joints: self.joints(angles),
            energy: self.spring_energy(pose),
            axial: gradient.foot.y,
            transverse: gradient.foot.x,
            middle_segment: self.middle_segment_force(pose),
            active_stop,
        }
    }
}

/// Returns the last admissible opening on the path from an admissible one towards another.
fn edge(from: f64, to: f64, inside: &impl Fn(f64) -> Option<Pose>) -> f64 {
    if inside(to).is_some() {
        return to;
    }
    let (mut admissible, mut inadmissible) = (from, to);
    for _ in 0..60 {
        let middle = 0.5 * (admissible + inadmissible);
        if inside(middle).is_some() {
            admissible = middle;
        } else {
            inadmissible = middle;
        }
    }
    admissible
}
