//! Pushes: forces and torques from outside on trunk and feet, over a time.

use core::f64::consts::PI;

use libm::sin;
use twinrig_kernel::{SimDuration, SimTime};

/// A push on trunk or foot.
#[derive(Debug, Clone, PartialEq)]
pub struct Push {
    /// Name, for messages.
    pub name: String,
    /// The pushed part.
    pub target: PushTarget,
    /// Begin.
    pub at: SimTime,
    /// Duration.
    pub duration: SimDuration,
    /// Course over the duration.
    pub shape: PushShape,
    /// Greatest force \[N\] or torque \[N·m\], world axes.
    pub peak: [f64; 3],
}

/// Target of a push.
#[derive(Debug, Clone, PartialEq)]
pub enum PushTarget {
    /// A force on the trunk, at a point in trunk axes from its centre of mass \[m\].
    Trunk([f64; 3]),
    /// A torque on the trunk.
    TrunkTorque,
    /// A force on the foot of the named leg.
    Foot(String),
}

/// Course of a push over its duration, relative to its peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PushShape {
    /// Constant.
    Rectangle,
    /// Half a period of a sine.
    HalfSine,
    /// Linear rise and fall of equal length.
    Triangle,
}

impl PushShape {
    /// Returns the value at a share of the duration, from 0 to 1.
    pub fn value(self, share: f64) -> f64 {
        match self {
            Self::Rectangle => 1.0,
            Self::HalfSine => sin(PI * share),
            Self::Triangle => 1.0 - (2.0 * share - 1.0).abs(),
        }
    }

    /// Returns the integral between two shares of the duration, relative to the duration.
    pub fn integral(self, from: f64, to: f64) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        match self {
            Self::Rectangle => to - from,
            // Without the cancellation of a difference of cosines.
            Self::HalfSine => 2.0 / PI * sin(PI * middle) * sin(PI * half),
            Self::Triangle if from < 0.5 && to > 0.5 => {
                self.integral(from, 0.5) + self.integral(0.5, to)
            }
            Self::Triangle => (to - from) * self.value(middle),
        }
    }

    /// Returns whether the shape has a corner in the middle of the duration.
    pub(crate) fn has_corner(self) -> bool {
        self == Self::Triangle
    }
}
