//! A pose of the leg as points in the leg plane, its velocity, and the statics of its segments.

use libm::{atan2, cos, sqrt};

use crate::LegError;
use crate::pantograph::{Pantograph, Planar, along, cross, turned};

/// Below this sine of the ankle angle a pose counts as straight: forces in the segments would grow past 1e9 of the
/// force on the foot.
const STRAIGHT: f64 = 1e-9;

/// Points, directions and lengths of the leg in one pose, hip frame, x forward and z up \[m\].
///
/// Two closed-form ways lead here: hip angle and foot position (the mass-less plant) and joint angles (the full one).
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
    /// Hip to ankle: the length of the taut cable.
    pub cable: f64,
    /// From the diagonal's end on the first segment to the ankle.
    diagonal_vector: Planar,
    /// From the parallel rod's end on the first segment to its end on the third.
    parallel_vector: Planar,
}

/// How near the ankle may be folded up to where the third segment lies on the second, in plants that know a pose by hip angle
/// and foot \[rad\]: there foot and hip do not tell the pose, and springs push a foot without bounds.
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

/// A length of the leg that a spring, a stop or the cable acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// The diagonal spring.
    Diagonal,
    /// The parallel rod.
    Parallel,
    /// The cable, hip to ankle.
    Cable,
    /// Knee to foot: what the second and the third segment span.
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

/// Derivative of a scalar with respect to the points of the leg, before the segments' constraints are applied.
#[derive(Debug, Clone, Copy)]
struct Pull {
    inner: Planar,
    knee: Planar,
    ankle: Planar,
    foot: Planar,
}

impl Pantograph {
    /// The pose that has this hip angle (as its sine and cosine, absolute: zero points down) and this foot.
    ///
    /// Closed form: the ankle is where two circles meet, on the side where the leg bends.
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
        let beside_square = self.l2 * self.l2 * inverse - on_span * on_span;
        if beside_square.is_nan() {
            return Err(LegError::NotFinite {
                what: "hip angle or foot position",
            });
        }
        if beside_square <= 0.0 {
            let (least, greatest) = ((self.l2 - self.b).abs(), self.l2 + self.b);
            return Err(LegError::NoTriangle {
                distance: sqrt(square),
                least,
                greatest,
            });
        }
        let ankle = knee + span * on_span - turned(span) * sqrt(beside_square);
        self.pose_of_points(first, knee, ankle, foot)
    }

    /// The pose with these absolute angles of the three segments \[rad\].
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

    /// Potential energy of the two springs (thesis, eq. 2.21 without the toe) \[J\].
    pub fn spring_energy(&self, pose: &Pose) -> f64 {
        let (d, p) = (
            pose.diagonal - self.diagonal_rest,
            pose.parallel - self.parallel_rest,
        );
        0.5 * (self.k_d * d * d + self.k_p * p * p)
    }

    /// What diagonal and parallel spring pull with, along the vectors of the pose \[N\].
    fn spring_pulls(&self, pose: &Pose) -> (Planar, Planar) {
        (
            pose.diagonal_vector * (self.k_d * (1.0 - self.diagonal_rest / pose.diagonal)),
            pose.parallel_vector * (self.k_p * (1.0 - self.parallel_rest / pose.parallel)),
        )
    }

    /// Gradient of [`Self::spring_energy`] \[N·m, N\]: hip torque and foot force that hold the leg against its springs.
    pub fn spring_gradient(&self, pose: &Pose) -> Gradient {
        let (diagonal, parallel) = self.spring_pulls(pose);
        let lever = self.l_delta * self.per_b;
        self.pulled_back(
            pose,
            &Pull {
                inner: -(diagonal + parallel),
                knee: Planar::zeros(),
                ankle: diagonal + parallel * (1.0 + lever),
                foot: parallel * -lever,
            },
        )
    }

    /// Gradient of one of the leg's lengths.
    pub fn length_gradient(&self, pose: &Pose, length: Length) -> Gradient {
        let none = Planar::zeros();
        let pull = match length {
            Length::Diagonal => {
                let n = pose.diagonal_vector / pose.diagonal;
                Pull {
                    inner: -n,
                    knee: none,
                    ankle: n,
                    foot: none,
                }
            }
            Length::Parallel => {
                let n = pose.parallel_vector / pose.parallel;
                let lever = self.l_delta * self.per_b;
                Pull {
                    inner: -n,
                    knee: none,
                    ankle: n * (1.0 + lever),
                    foot: n * -lever,
                }
            }
            Length::Cable => Pull {
                inner: none,
                knee: none,
                ankle: pose.ankle / pose.cable,
                foot: none,
            },
            Length::Span => {
                let span = pose.foot - pose.knee;
                let n = span / span.norm();
                Pull {
                    inner: none,
                    knee: -n,
                    ankle: none,
                    foot: n,
                }
            }
        };
        self.pulled_back(pose, &pull)
    }

    /// How far knee and foot are from where the ankle is folded up as far as hip angle and foot tell the pose \[m\]; negative
    /// beyond it.
    pub fn unfolded(&self, pose: &Pose) -> f64 {
        (pose.foot - pose.knee).norm() - self.span_min
    }

    /// Whether the ankle is on that side of it, which the distance alone does not tell.
    pub fn is_unfolded(&self, pose: &Pose) -> bool {
        pose.ankle_sine > 0.0 && self.unfolded(pose) >= 0.0
    }

    /// The least distance of knee and foot for such poses \[m\].
    pub(crate) fn least_span(l2: f64, b: f64) -> f64 {
        sqrt(l2 * l2 + b * b - 2.0 * l2 * b * cos(FOLDED))
    }

    /// Velocity of the leg from the hip's angular velocity \[rad/s\] and the foot's velocity in the hip frame \[m/s\].
    pub fn velocity(&self, pose: &Pose, hip: f64, foot: Planar) -> Velocity {
        let [first, second, third] = pose.along;
        let knee = turned(first) * (self.l1 * hip);
        // The segments keep their lengths: ė · (velocity difference of their ends) = 0.
        let ankle = meeting(pose, second.dot(&knee), third.dot(&foot));
        let omega = [
            hip,
            turned(second).dot(&(ankle - knee)) * self.per_l2,
            turned(third).dot(&(foot - ankle)) * self.per_b,
        ];
        Velocity {
            knee,
            ankle,
            foot,
            omega,
        }
    }

    /// Rate of one of the leg's lengths \[m/s\].
    pub fn length_rate(&self, pose: &Pose, velocity: &Velocity, length: Length) -> f64 {
        let (vector, rate, value) = self.stretch(pose, velocity, length);
        vector.dot(&rate) / value
    }

    /// Second derivative of a length while hip and foot move without acceleration \[m/s²\]: the velocity-product term
    /// of its acceleration.
    pub fn length_curvature(&self, pose: &Pose, velocity: &Velocity, length: Length) -> f64 {
        let [first, second, _] = pose.along;
        let [w1, ..] = velocity.omega;
        let knee_acceleration = first * (-self.l1 * w1 * w1);
        let ankle_acceleration = meeting(
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

    /// Generalised force that does the work of torques on the three segments \[N·m\]: its negative gradient form.
    pub fn torque_gradient(&self, pose: &Pose, torques: [f64; 3]) -> Gradient {
        let [_, second, third] = pose.along;
        let (on_second, on_third) = (
            turned(second) * (torques[1] * self.per_l2),
            turned(third) * (torques[2] * self.per_b),
        );
        let pull = Pull {
            inner: Planar::zeros(),
            knee: -on_second,
            ankle: on_second - on_third,
            foot: on_third,
        };
        let mut gradient = self.pulled_back(pose, &pull);
        gradient.hip += torques[0];
        gradient
    }

    /// Force in the second segment: what the third leaves of the springs' pull on the ankle. Tension is positive \[N\].
    pub fn middle_segment_force(&self, pose: &Pose) -> f64 {
        let (diagonal, parallel) = self.spring_pulls(pose);
        let on_ankle = diagonal + parallel * (1.0 + self.l_delta * self.per_b);
        -cross(on_ankle, pose.along[2]) / pose.ankle_sine
    }

    /// Vector, its rate and its length, of one of the leg's lengths.
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

    /// Turns derivatives with respect to the leg's points into derivatives with respect to hip angle and foot.
    ///
    /// The ankle is not free: its pull is carried by forces µ₂, µ₃ along second and third segment, which arrive at knee
    /// and foot (virtual work; the transpose of [`Self::velocity`]).
    fn pulled_back(&self, pose: &Pose, pull: &Pull) -> Gradient {
        let [first, second, third] = pose.along;
        let per_sine = 1.0 / pose.ankle_sine;
        let in_second = cross(pull.ankle, third) * per_sine;
        let in_third = cross(second, pull.ankle) * per_sine;
        let at_knee = pull.knee + second * in_second;
        let hip = turned(first).dot(&(at_knee * self.l1 + pull.inner * (self.l1 - self.l_delta)));
        Gradient {
            hip,
            foot: pull.foot + third * in_third,
        }
    }
}

impl Pose {
    /// Absolute angles of the three segments \[rad\]; zero points down.
    pub fn angles(&self) -> [f64; 3] {
        self.along.map(|e| atan2(e.x, -e.y))
    }
}

/// Velocity (or acceleration) of the ankle whose components along second and third segment are given.
fn meeting(pose: &Pose, along_second: f64, along_third: f64) -> Planar {
    let [_, second, third] = pose.along;
    (turned(second) * along_third - turned(third) * along_second) * (1.0 / pose.ankle_sine)
}
