//! Parameters of a study of stability.

use twinrig_kernel::SimDuration;

use crate::plants::factor::Factor;

/// Parameters of a study of stability.
#[derive(Clone, Debug)]
pub struct StabilityPlan {
    /// Duration over which a run must stay bounded. It may exceed that of the scenario; the last
    /// commands then stay constant.
    pub duration: SimDuration,
    /// Duration compared with the reference; `None`: that of the scenario, at most the whole run.
    pub compared: Option<SimDuration>,
    /// Shortest step of the search.
    pub least: SimDuration,
    /// Longest step of the search.
    pub most: SimDuration,
    /// The search ends when the shortest unstable step is at most this multiple of the longest
    /// stable one.
    pub ratio: f64,
    /// Greatest RMS distance of the feet from the reference at which a stable step is accurate
    /// \[m\].
    pub wrong_m: f64,
    /// Tolerance of adaptive methods.
    pub tolerance: f64,
    /// Factors to vary.
    pub factors: Vec<Factor>,
    /// Values of each of them; `None`: those of a complete study.
    pub values: Option<Vec<f64>>,
    /// Time budget of the whole study \[s\].
    pub budget_s: f64,
}

impl Default for StabilityPlan {
    fn default() -> Self {
        Self {
            duration: SimDuration::from_secs(2),
            compared: Some(SimDuration::from_millis(300)),
            least: SimDuration::from_micros(1),
            most: SimDuration::from_millis(100),
            ratio: 1.05,
            wrong_m: 1e-3,
            tolerance: 1e-6,
            factors: Factor::ALL.into(),
            values: None,
            budget_s: 200.0,
        }
    }
}
