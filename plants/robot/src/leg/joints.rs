//! Joint space: spring energy with gradient and Hessian, cable length, and the state-dependent stop
//! of the opening.

use libm::{cos, sin, sqrt};

use crate::leg::LegError;
use crate::leg::pantograph::{Pantograph, angle_of};

/// Passive joints of the leg relative to the reference pose, as in the thesis (A.2): both zero when
/// extended, `q2 ≤ 0` flexes the knee, `q2 + q3 ≥ 0` opens the pantograph \[rad\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joints {
    /// Angle of the second segment against the first.
    pub q2: f64,
    /// Angle of the third segment against the second.
    pub q3: f64,
}

/// Scalar function of the joints with its first and second derivatives, in the order (q2, q3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// Gradient.
    pub gradient: [f64; 2],
    /// Hessian, symmetric.
    pub hessian: [[f64; 2]; 2],
}

/// Greatest opening of the pantograph, `q2 + q3 ≤ B(q2)`, with its derivatives (thesis, A.19 and
/// eq. 2.13).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpeningStop {
    /// B \[rad\].
    pub value: f64,
    /// dB/dq2.
    pub slope: f64,
    /// d²B/dq2² \[1/rad\].
    pub curvature: f64,
}

impl Jet {
    /// Returns the square root of a jet of a squared length.
    fn root(square: &Self) -> Self {
        let value = sqrt(square.value);
        let gradient = square.gradient.map(|g| g / (2.0 * value));
        let hessian =
            matrix(|i, j| square.hessian[i][j] / (2.0 * value) - gradient[i] * gradient[j] / value);
        Self {
            value,
            gradient,
            hessian,
        }
    }

    /// Returns the energy of a linear spring of this length.
    fn spring(&self, stiffness: f64, rest: f64) -> Self {
        let stretch = self.value - rest;
        let by = self.gradient;
        let hessian = matrix(|i, j| stiffness * (by[i] * by[j] + stretch * self.hessian[i][j]));
        Self {
            value: 0.5 * stiffness * stretch * stretch,
            gradient: self.gradient.map(|g| stiffness * stretch * g),
            hessian,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            value: self.value + other.value,
            gradient: [
                self.gradient[0] + other.gradient[0],
                self.gradient[1] + other.gradient[1],
            ],
            hessian: matrix(|i, j| self.hessian[i][j] + other.hessian[i][j]),
        }
    }
}

fn matrix(entry: impl Fn(usize, usize) -> f64) -> [[f64; 2]; 2] {
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

impl Pantograph {
    /// Returns the joint angles of a pose given by the absolute angles of its segments.
    pub fn joints(&self, angles: [f64; 3]) -> Joints {
        Joints {
            q2: angles[1] - angles[0] + self.q2_ref,
            q3: angles[2] - angles[1] - self.q2_ref,
        }
    }

    /// Returns the absolute angles of the segments from the hip angle (zero in the reference pose)
    /// and the joints.
    pub fn angles(&self, q1: f64, joints: Joints) -> [f64; 3] {
        let first = q1 + self.hip_ref;
        let second = first + joints.q2 - self.q2_ref;
        [first, second, second + joints.q3 + self.q2_ref]
    }

    /// Returns the length of the taut cable (thesis, A.4) \[m\].
    pub fn cable_of_knee(&self, q2: f64) -> f64 {
        sqrt(
            self.l1 * self.l1 + self.l2 * self.l2 + 2.0 * self.l1 * self.l2 * cos(q2 - self.q2_ref),
        )
    }

    /// Returns the knee angle at which the cable is taut (thesis, A.5) \[rad\].
    ///
    /// # Errors
    /// [`LegError::NoAngle`] outside |l1 − l2| … l1 + l2.
    pub fn knee_of_cable(&self, cable: f64) -> Result<f64, LegError> {
        // A pulley that has wound up more than the cable length leaves a negative length: with its
        // sign, no cosine fits.
        let square = cable * cable.abs();
        let cosine = (square - self.l1 * self.l1 - self.l2 * self.l2) / (2.0 * self.l1 * self.l2);
        Ok(self.q2_ref - angle_of(cosine, "cable", cable)?)
    }

    /// Returns the length of the diagonal (thesis, A.16) \[m\].
    pub fn diagonal_of(&self, joints: Joints) -> Jet {
        let (l2, ld) = (self.l2, self.l_delta);
        let q2_bar = joints.q2 - self.q2_ref;
        let product = 2.0 * l2 * ld;
        Jet::root(&Jet {
            value: l2 * l2 + ld * ld + product * cos(q2_bar),
            gradient: [-product * sin(q2_bar), 0.0],
            hessian: [[-product * cos(q2_bar), 0.0], [0.0, 0.0]],
        })
    }

    /// Returns the length of the parallel rod (thesis, A.21) \[m\].
    pub fn parallel_of(&self, joints: Joints) -> Jet {
        let (l2, ld) = (self.l2, self.l_delta);
        let (q2_bar, q3_bar) = (joints.q2 - self.q2_ref, joints.q3 + self.q2_ref);
        let opening = joints.q2 + joints.q3;
        let (square, product) = (2.0 * ld * ld, 2.0 * l2 * ld);
        let (s, c) = (square * sin(opening), square * cos(opening));
        Jet::root(&Jet {
            value: l2 * l2 + square - c + product * (cos(q2_bar) - cos(q3_bar)),
            gradient: [s - product * sin(q2_bar), s + product * sin(q3_bar)],
            hessian: [
                [c - product * cos(q2_bar), c],
                [c, c + product * cos(q3_bar)],
            ],
        })
    }

    /// Returns the potential energy of both springs \[J\], whose negative gradient is the joint
    /// torques (thesis, A.24 and A.25 with the missing factors and the torque of the parallel
    /// spring on q2, omitted there).
    pub fn spring_energy_of(&self, joints: Joints) -> Jet {
        let diagonal = self
            .diagonal_of(joints)
            .spring(self.k_d, self.diagonal_rest);
        diagonal.plus(
            &self
                .parallel_of(joints)
                .spring(self.k_p, self.parallel_rest),
        )
    }

    /// Returns the torque of a unit cable tension on the knee \[N·m/N\] (thesis, A.26 corrected):
    /// −d(cable)/dq2, which flexes.
    pub fn cable_lever(&self, q2: f64) -> f64 {
        self.l1 * self.l2 * sin(q2 - self.q2_ref) / self.cable_of_knee(q2)
    }

    /// Returns the upper stop of the pantograph's opening, where the parallel rod has used up its
    /// travel.
    ///
    /// # Errors
    /// [`LegError::NoAngle`] where the rod cannot reach its greatest length at this knee angle.
    pub fn opening_stop(&self, q2: f64) -> Result<OpeningStop, LegError> {
        let (l2, ld) = (self.l2, self.l_delta);
        let q2_bar = q2 - self.q2_ref;
        let diagonal = sqrt(l2 * l2 + ld * ld + 2.0 * l2 * ld * cos(q2_bar));
        let beta = |rod: f64| {
            angle_of(
                (diagonal * diagonal + ld * ld - rod * rod) / (2.0 * ld * diagonal),
                "parallel rod",
                rod,
            )
        };
        let opening = beta(self.parallel_max)? - beta(l2)?;
        // Implicit differentiation of l_p²(q2, opening) = const.
        let (square, product) = (2.0 * ld * ld, 2.0 * l2 * ld);
        let q3_bar = opening - q2_bar;
        let by_opening = square * sin(opening) + product * sin(q3_bar);
        let by_q2 = -product * (sin(q2_bar) + sin(q3_bar));
        let slope = -by_q2 / by_opening;
        let second = product * (cos(q3_bar) - cos(q2_bar));
        let mixed = -product * cos(q3_bar);
        let opening_twice = square * cos(opening) + product * cos(q3_bar);
        let curvature =
            -(second + 2.0 * mixed * slope + opening_twice * slope * slope) / by_opening;
        Ok(OpeningStop {
            value: opening,
            slope,
            curvature,
        })
    }
}
