//! Pose of the leg as points in the leg plane, its velocity, and the statics of its segments.

use libm::{atan2, cos, sqrt};

use crate::leg::LegError;
use crate::leg::pantograph::{Pantograph, Planar, along, cross, rotated};

/// Sine of the ankle angle below which a pose is straight: forces in the segments would exceed 1e9
/// times the force on the foot.
const STRAIGHT: f64 = 1e-9;

/// Points, directions and lengths of the leg in one pose, hip frame, x forward and z up \[m\].
///
/// Computed in closed form from hip angle and foot position (mass-less plant) or from joint angles
/// (full plant).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Knee: end of the first segment.
    pub knee: Planar,
    /// Ankle: end of the second segment.
    pub ankle: Planar,
    /// Foot: end of the third segment.
    pub foot: Planar,
    /// Unit vectors along the three segments, downwards.
    pub along: [Planar; 3],
    /// Sine of the angle from second to third segment.
    pub ankle_sine: f64,
    /// Length of the diagonal spring.
    pub diagonal: f64,
    /// Length of the parallel rod.
    pub parallel: f64,
    /// Distance from hip to ankle, the length of the taut cable.
    pub cable: f64,
    /// Vector from the diagonal's end on the first segment to the ankle.
    diagonal_vector: Planar,
    /// Vector from the parallel rod's end on the first segment to its end on the third.
    parallel_vector: Planar,
}

/// Least angle between second and third segment in plants whose coordinates are hip angle and foot
/// \[rad\]: when the ankle is folded flat, these do not determine the pose, and spring forces on
/// the foot are unbounded.
const FOLDED: f64 = 0.1;

/// Velocity of the leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    knee: Planar,
    ankle: Planar,
    foot: Planar,
    /// Angular velocities of the three segments \[rad/s\].
    pub omega: [f64; 3],
}

/// Length within the leg that a spring, a stop or the cable acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// The diagonal spring.
    Diagonal,
    /// The parallel rod.
    Parallel,
    /// The cable, hip to ankle.
    Cable,
    /// Distance from knee to foot, spanned by the second and the third segment.
    Span,
}

/// Derivative of a scalar with respect to hip angle and foot position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gradient {
    /// Per radian of hip angle.
    pub hip: f64,
    /// Per metre of foot position, hip frame.
    pub foot: Planar,
}

impl core::ops::Add for Gradient {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            hip: self.hip + other.hip,
            foot: self.foot + other.foot,
        }
    }
}

impl core::ops::Mul<f64> for Gradient {
    type Output = Self;
    fn mul(self, scale: f64) -> Self {
        Self {
            hip: self.hip * scale,
            foot: self.foot * scale,
        }
    }
}

/// Derivative of a scalar with respect to the points of the leg, without the constraints of the
/// segments.
#[derive(Debug, Clone, Copy)]
struct PointForces {
    inner: Planar,
    knee: Planar,
    ankle: Planar,
    foot: Planar,
}

impl Pantograph {
    /// Returns the pose of a hip angle (as its sine and cosine, absolute: zero points down) and a
    /// foot position.
    ///
    /// The ankle is the intersection of two circles, on the side to which the leg bends.
    ///
    /// # Errors
    /// [`LegError::NoTriangle`], [`LegError::Straight`], [`LegError::NotFinite`].
    pub fn pose(&self, hip_sine: f64, hip_cosine: f64, foot: Planar) -> Result<Pose, LegError> {
        let first = Planar::new(hip_sine, -hip_cosine);
        let knee = first * self.l1;
        let span = foot - knee;
        let square = span.norm_squared();
        let inverse = 1.0 / square;
        let on_span = 0.5 * (self.l2 * self.l2 + square - self.b * self.b) * inverse;
        let across_square = self.l2 * self.l2 * inverse - on_span * on_span;
        if across_square.is_nan() {
            return Err(LegError::NotFinite {
                what: "hip angle or foot position",
            });
        }
        if across_square <= 0.0 {
            let (least, greatest) = ((self.l2 - self.b).abs(), self.l2 + self.b);
            return Err(LegError::NoTriangle {
                distance: sqrt(square),
                least,
                greatest,
            });
        }
        let ankle = knee + span * on_span - rotated(span) * sqrt(across_square);
        self.pose_of_points(first, knee, ankle, foot)
    }

    /// Returns the pose of the absolute angles of the three segments \[rad\].
    ///
    /// # Errors
    /// [`LegError::Straight`].
    pub fn pose_of_angles(&self, angles: [f64; 3]) -> Result<Pose, LegError> {
        let [first, second, third] = angles.map(along);
        let knee = first * self.l1;
        let ankle = knee + second * self.l2;
        self.pose_of_points(first, knee, ankle, ankle + third * self.b)
    }

    fn pose_of_points(
        &self,
        first: Planar,
        knee: Planar,
        ankle: Planar,
        foot: Planar,
    ) -> Result<Pose, LegError> {
        let second = (ankle - knee) * self.per_l2;
        let third = (foot - ankle) * self.per_b;
        let ankle_sine = cross(second, third);
        if ankle_sine.abs() < STRAIGHT {
            return Err(LegError::Straight { sine: ankle_sine });
        }
        let inner = first * (self.l1 - self.l_delta);
        let diagonal_vector = ankle - inner;
        let parallel_vector = diagonal_vector - third * self.l_delta;
        Ok(Pose {
            knee,
            ankle,
            foot,
            along: [first, second, third],
            ankle_sine,
            diagonal: diagonal_vector.norm(),
            parallel: parallel_vector.norm(),
            cable: ankle.norm(),
            diagonal_vector,
            parallel_vector,
        })
    }

    /// Returns the potential energy of the two springs (thesis, eq. 2.21 without the toe) \[J\].
    pub fn spring_energy(&self, pose: &Pose) -> f64 {
        let (d, p) = (
            pose.diagonal - self.diagonal_rest,
            pose.parallel - self.parallel_rest,
        );
        0.5 * (self.k_d * d * d + self.k_p * p * p)
    }

    /// Returns the tension of diagonal and parallel spring along the vectors of the pose \[N\].
    fn spring_forces(&self, pose: &Pose) -> (Planar, Planar) {
        (
            pose.diagonal_vector * (self.k_d * (1.0 - self.diagonal_rest / pose.diagonal)),
            pose.parallel_vector * (self.k_p * (1.0 - self.parallel_rest / pose.parallel)),
        )
    }

    /// Returns the gradient of [`Self::spring_energy`] \[N·m, N\]: hip torque and foot force in
    /// equilibrium with the springs.
    pub fn spring_gradient(&self, pose: &Pose) -> Gradient {
        let (diagonal, parallel) = self.spring_forces(pose);
        let lever = self.l_delta * self.per_b;
        self.pull_back(
            pose,
            &PointForces {
                inner: -(diagonal + parallel),
                knee: Planar::zeros(),
                ankle: diagonal + parallel * (1.0 + lever),
                foot: parallel * -lever,
            },
        )
    }

    /// Returns the gradient of one of the leg's lengths.
    pub fn length_gradient(&self, pose: &Pose, length: Length) -> Gradient {
        let none = Planar::zeros();
        let forces = match length {
            Length::Diagonal => {
                let n = pose.diagonal_vector / pose.diagonal;
                PointForces {
                    inner: -n,
                    knee: none,
                    ankle: n,
                    foot: none,
                }
            }
            Length::Parallel => {
                let n = pose.parallel_vector / pose.parallel;
                let lever = self.l_delta * self.per_b;
                PointForces {
                    inner: -n,
                    knee: none,
                    ankle: n * (1.0 + lever),
                    foot: n * -lever,
                }
            }
            Length::Cable => PointForces {
                inner: none,
                knee: none,
                ankle: pose.ankle / pose.cable,
                foot: none,
            },
            Length::Span => {
                let span = pose.foot - pose.knee;
                let n = span / span.norm();
                PointForces {
                    inner: none,
                    knee: -n,
                    ankle: none,
                    foot: n,
                }
            }
        };
        self.pull_back(pose, &forces)
    }

    /// Returns the margin of the distance of knee and foot over its least value, at which hip angle
    /// and foot still determine the pose \[m\]; negative beyond.
    pub fn unfolded(&self, pose: &Pose) -> f64 {
        (pose.foot - pose.knee).norm() - self.span_min
    }

    /// Returns whether the margin is non-negative and the ankle bends to the correct side, which
    /// the distance alone does not determine.
    pub fn is_unfolded(&self, pose: &Pose) -> bool {
        pose.ankle_sine > 0.0 && self.unfolded(pose) >= 0.0
    }

    /// Returns the least distance of knee and foot for such poses \[m\].
    pub(crate) fn least_span(l2: f64, b: f64) -> f64 {
        sqrt(l2 * l2 + b * b - 2.0 * l2 * b * cos(FOLDED))
    }

    /// Returns the velocity of the leg from the hip's angular velocity \[rad/s\] and the foot's
    /// velocity in the hip frame \[m/s\].
    pub fn velocity(&self, pose: &Pose, hip: f64, foot: Planar) -> Velocity {
        let [first, second, third] = pose.along;
        let knee = rotated(first) * (self.l1 * hip);
        // The segments are rigid: e · (velocity difference of the ends) = 0 along their unit
        // vectors e.
        let ankle = ankle_rate(pose, second.dot(&knee), third.dot(&foot));
        let omega = [
            hip,
            rotated(second).dot(&(ankle - knee)) * self.per_l2,
            rotated(third).dot(&(foot - ankle)) * self.per_b,
        ];
        Velocity {
            knee,
            ankle,
            foot,
            omega,
        }
    }

    /// Returns the rate of one of the leg's lengths \[m/s\].
    pub fn length_rate(&self, pose: &Pose, velocity: &Velocity, length: Length) -> f64 {
        let (vector, rate, value) = self.stretch(pose, velocity, length);
        vector.dot(&rate) / value
    }

    /// Returns the second derivative of a length without acceleration of hip and foot \[m/s²\]: the
    /// velocity-product term of its acceleration.
    pub fn length_curvature(&self, pose: &Pose, velocity: &Velocity, length: Length) -> f64 {
        let [first, second, _] = pose.along;
        let [w1, ..] = velocity.omega;
        let knee_acceleration = first * (-self.l1 * w1 * w1);
        let ankle_acceleration = ankle_rate(
            pose,
            second.dot(&knee_acceleration)
                - (velocity.ankle - velocity.knee).norm_squared() * self.per_l2,
            (velocity.foot - velocity.ankle).norm_squared() * self.per_b,
        );
        let lever = self.l_delta * self.per_b;
        let inner_acceleration = knee_acceleration * (1.0 - self.l_delta / self.l1);
        let acceleration = match length {
            Length::Diagonal => ankle_acceleration - inner_acceleration,
            Length::Parallel => ankle_acceleration * (1.0 + lever) - inner_acceleration,
            Length::Cable => ankle_acceleration,
            Length::Span => -knee_acceleration,
        };
        let (vector, rate, value) = self.stretch(pose, velocity, length);
        let along = vector.dot(&rate) / value;
        (vector.dot(&acceleration) + rate.norm_squared() - along * along) / value
    }

    /// Returns the generalised force equivalent to torques on the three segments \[N·m\].
    pub fn torque_gradient(&self, pose: &Pose, torques: [f64; 3]) -> Gradient {
        let [_, second, third] = pose.along;
        let (on_second, on_third) = (
            rotated(second) * (torques[1] * self.per_l2),
            rotated(third) * (torques[2] * self.per_b),
        );
        let forces = PointForces {
            inner: Planar::zeros(),
            knee: -on_second,
            ankle: on_second - on_third,
            foot: on_third,
        };
        let mut gradient = self.pull_back(pose, &forces);
        gradient.hip += torques[0];
        gradient
    }

    /// Returns the force in the second segment, tension positive \[N\]: the component of the spring
    /// forces on the ankle that the third segment does not carry.
    pub fn middle_segment_force(&self, pose: &Pose) -> f64 {
        let (diagonal, parallel) = self.spring_forces(pose);
        let on_ankle = diagonal + parallel * (1.0 + self.l_delta * self.per_b);
        -cross(on_ankle, pose.along[2]) / pose.ankle_sine
    }

    /// Returns vector, rate of the vector, and value of one of the leg's lengths.
    fn stretch(&self, pose: &Pose, velocity: &Velocity, length: Length) -> (Planar, Planar, f64) {
        let inner = velocity.knee * (1.0 - self.l_delta / self.l1);
        match length {
            Length::Diagonal => (pose.diagonal_vector, velocity.ankle - inner, pose.diagonal),
            Length::Parallel => {
                let outer =
                    velocity.ankle - (velocity.foot - velocity.ankle) * (self.l_delta * self.per_b);
                (pose.parallel_vector, outer - inner, pose.parallel)
            }
            Length::Cable => (pose.ankle, velocity.ankle, pose.cable),
            Length::Span => {
                let span = pose.foot - pose.knee;
                (span, velocity.foot - velocity.knee, span.norm())
            }
        }
    }

    /// Transforms derivatives with respect to the points of the leg to derivatives with respect to
    /// hip angle and foot.
    ///
    /// The ankle is a dependent point: its force is carried by forces µ₂, µ₃ along second and third
    /// segment, which act on knee and foot (virtual work; the transpose of [`Self::velocity`]).
    fn pull_back(&self, pose: &Pose, forces: &PointForces) -> Gradient {
        let [first, second, third] = pose.along;
        let per_sine = 1.0 / pose.ankle_sine;
        let in_second = cross(forces.ankle, third) * per_sine;
        let in_third = cross(second, forces.ankle) * per_sine;
        let at_knee = forces.knee + second * in_second;
        let hip =
            rotated(first).dot(&(at_knee * self.l1 + forces.inner * (self.l1 - self.l_delta)));
        Gradient {
            hip,
            foot: forces.foot + third * in_third,
        }
    }
}

impl Pose {
    /// Returns the absolute angles of the three segments \[rad\]; zero points down.
    pub fn angles(&self) -> [f64; 3] {
        self.along.map(|e| atan2(e.x, -e.y))
    }
}

/// Returns the velocity (or acceleration) of the ankle with given components along second and third
/// segment.
fn ankle_rate(pose: &Pose, along_second: f64, along_third: f64) -> Planar {
    let [_, second, third] = pose.along;
    (rotated(second) * along_third - rotated(third) * along_second) * (1.0 / pose.ankle_sine)
}
