//! Parameters of a study of precision.

use twinrig_kernel::SimDuration;

/// Parameters of a study of precision.
#[derive(Clone, Debug)]
pub struct PrecisionPlan {
    /// Simulated duration; `None`: the first 300 ms of the scenario, or all of it if shorter.
    pub duration: Option<SimDuration>,
    /// Step sizes, the longest first. The sampling period is the longest, or the command period if
    /// that is shorter.
    pub steps: Vec<SimDuration>,
    /// Tolerances, the loosest first.
    pub tolerances: Vec<f64>,
    /// Factors of the segment masses at which a plant without segment masses is compared with one
    /// that has them.
    pub masses: Vec<f64>,
    /// Number of perturbed walks of each plant, where the scenario walks; 0 for none.
    pub ensemble: usize,
    /// Number of runs whose median is the run time.
    pub repetitions: u64,
    /// Time budget of the whole study; truncated runs are rows of it \[s\].
    pub budget_s: f64,
}

impl Default for PrecisionPlan {
    fn default() -> Self {
        let micros = [10_000, 5_000, 2_000, 1_000, 500, 200, 100, 50, 20, 10];
        Self {
            duration: None,
            steps: micros.map(SimDuration::from_micros).into(),
            tolerances: vec![1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11],
            masses: vec![1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4, 0.0],
            ensemble: 100,
            repetitions: 7,
            budget_s: 200.0,
        }
    }
}
