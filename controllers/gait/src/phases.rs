//! Phases of the legs, from which their commands follow.

/// Phases of all legs after a step.
pub(crate) trait Phases {
    /// Phase Θ in `[0, 2π]` of the locus of the leg with index `leg`, which is at `end` of the
    /// robot.
    fn phase(&self, leg: usize, end: usize) -> f64;

    /// Expected phase of the leg after a time \[s\].
    fn phase_after(&self, leg: usize, end: usize, seconds: f64) -> f64;

    /// Fraction of the cycle of the leg, in `[0, 1)`.
    fn turn(&self, leg: usize) -> f64;

    /// Expected cycle frequency \[Hz\].
    fn frequency(&self) -> f64;

    /// Expected share of stance in the cycle of legs at `end` of the robot.
    fn stance_share(&self, end: usize) -> f64;
}
