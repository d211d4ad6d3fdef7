//! Limits of a plant's model that its parts exceed while the run goes on.

use std::fmt;

use twinrig_kernel::SimTime;

/// Limit of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// A stop, which yields.
    Stop,
    /// The ground, below a part without contact.
    Ground,
    /// The reach of a leg, beyond which a controller commands its foot.
    Reach,
}

/// Part beyond a limit at some instants of observation.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitViolation {
    /// The part: `leg/LF`, `body`.
    pub part: String,
    /// The limit.
    pub limit: Limit,
    /// First instant.
    pub first: SimTime,
    /// Greatest distance beyond the limit \[m\].
    pub worst_m: f64,
}

impl fmt::Display for LimitViolation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (part, first, worst_mm) = (&self.part, self.first, 1e3 * self.worst_m);
        match self.limit {
            Limit::Stop => write!(
                f,
                "{part} is up to {worst_mm:.1} mm beyond a stop, first at {first}: the stop yields \
                 more than one of the robot would"
            ),
            Limit::Ground => write!(
                f,
                "{part} is up to {worst_mm:.0} mm below the ground, first at {first}: only feet have \
                 contact with it"
            ),
            Limit::Reach => write!(
                f,
                "the foot of {part} is commanded up to {worst_mm:.1} mm out of reach, first at {first} \
                 of control: it moves to the nearest point in reach"
            ),
        }
    }
}
