//! Parameters of a study of coupling.

use twinrig_kernel::SimDuration;

/// Parameters of a study of coupling.
#[derive(Clone, Debug)]
pub struct CouplingPlan {
    /// Simulated duration; `None`: the first second of the scenario, or all of it if shorter.
    pub duration: Option<SimDuration>,
    /// Steps of the grid, the longest first. All divide the first, whose multiples are the sampling
    /// instants.
    pub steps: Vec<SimDuration>,
    /// Step of the plant in the reference; its check has twice the step.
    pub fine: SimDuration,
    /// Number of runs whose median is the run time.
    pub repetitions: u64,
    /// Time budget of the whole study; truncated runs are rows of it \[s\].
    pub budget_s: f64,
}

impl Default for CouplingPlan {
    fn default() -> Self {
        let micros = [10_000, 5_000, 2_000, 1_000, 500, 200, 100, 50];
        Self {
            duration: None,
            steps: micros.map(SimDuration::from_micros).into(),
            fine: SimDuration::from_micros(25),
            repetitions: 3,
            budget_s: 200.0,
        }
    }
}
