//! Study of a gait over frequency and step length: speed, cost of transport and Froude number.

mod options;
mod results;
mod view;

pub use options::GaitMapOptions;
pub use results::{GaitMap, GaitMapInput};

use serde::Serialize;
use twinrig_campaign::sweep::{ExpectationVerdict, SweepRow};

use crate::parallel::RunResult;

/// Names of the expectations that measure, with their claims. The bounds are beyond all gaits.
const SPEED: Measure = Measure("speed", "body = { speed = { max = \"1000 m/s\" } }");
const COST: Measure = Measure(
    "cost of transport",
    "gait = { cost_of_transport = { max = 1e9 } }",
);
const FROUDE: Measure = Measure("Froude number", "gait = { froude = { max = 1e9 } }");
const FALL: Measure = Measure("does not fall", "body = { fall = false }");

/// Expectation that measures: its name and claim.
struct Measure(&'static str, &'static str);

/// Returns the value of `expect` for runs of which the time from `after_s` on counts \[s\].
fn expectations(after_s: f64) -> String {
    let measured = [SPEED, COST, FROUDE].map(|Measure(name, claim)| {
        format!("{{ name = \"{name}\", {claim}, after = \"{after_s} s\", optional = true }}")
    });
    let Measure(name, claim) = FALL;
    format!(
        "[{{ name = \"{name}\", {claim} }}, {}]",
        measured.join(", ")
    )
}

/// Gait at one frequency and step length.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GaitPoint {
    /// Plant.
    pub plant: String,
    /// Commanded frequency \[Hz\].
    pub frequency_hz: f64,
    /// Commanded step length \[m\].
    pub step_length_m: f64,
    /// Mean speed along the initial heading \[m/s\]; as the others none after a fall.
    pub speed_m_s: Option<f64>,
    /// Positive work of the drives over weight and distance.
    pub cost_of_transport: Option<f64>,
    /// Square of the speed over gravity and mean height of the trunk.
    pub froude: Option<f64>,
    /// Time of the fall \[s\].
    pub fell_at_s: Option<f64>,
    /// Reason why there are no values beside a fall.
    pub why: Option<String>,
}

impl GaitPoint {
    /// Returns the point of a run.
    fn new(
        plant: &str,
        [frequency_hz, step_length_m]: [f64; 2],
        run: &RunResult<SweepRow>,
    ) -> Self {
        let why = run
            .as_ref()
            .map_or_else(|why| Some(why.clone()), |row| row.error.clone());
        let row = run.as_ref().ok();
        let fell_at_s = row.and_then(|row| row.fell_at_s);
        let measured = |Measure(name, _): Measure| {
            let one = row.filter(|_| fell_at_s.is_none())?.expectation(name)?;
            let is_observed = one.verdict != ExpectationVerdict::Unobserved;
            one.measured
                .filter(|value| is_observed && value.is_finite())
        };
        Self {
            plant: plant.to_owned(),
            frequency_hz,
            step_length_m,
            speed_m_s: measured(SPEED),
            cost_of_transport: measured(COST),
            froude: measured(FROUDE),
            fell_at_s,
            why,
        }
    }
}

#[cfg(test)]
mod tests {
    use twinrig_campaign::sweep::{RowExpectation, RowVerdict};

    use super::*;

    fn measured(name: &str, value: f64, verdict: ExpectationVerdict) -> RowExpectation {
        RowExpectation {
            name: name.to_owned(),
            verdict,
            holds: true,
            measured: Some(value),
            bound: None,
            margin: None,
            unit: String::new(),
            detail: String::new(),
        }
    }

    fn row(fell_at_s: Option<f64>) -> SweepRow {
        let observed = ExpectationVerdict::Pass;
        SweepRow {
            verdict: RowVerdict::Pass,
            seed: Some(1),
            simulated_s: Some(10.0),
            fell_at_s,
            fingerprint: None,
            error: None,
            expectations: vec![
                measured("does not fall", 9.0, observed),
                measured("speed", 0.5, observed),
                measured("cost of transport", 1.5, ExpectationVerdict::Unobserved),
                measured("Froude number", 2.5, observed),
            ],
        }
    }

    #[test]
    fn gait_that_falls_or_is_not_observed_has_no_values() {
        let values = |run: &RunResult<SweepRow>| {
            let point = GaitPoint::new("a", [2.0, 0.1], run);
            (point.speed_m_s, point.cost_of_transport, point.froude)
        };
        assert_eq!(values(&Ok(row(None))), (Some(0.5), None, Some(2.5)));
        assert_eq!(values(&Ok(row(Some(3.0)))), (None, None, None));
        let mut infinite = row(None);
        infinite.expectations[1].measured = Some(f64::INFINITY);
        assert_eq!(values(&Ok(infinite)), (None, None, Some(2.5)));
        let refused = Err("refused".to_owned());
        assert_eq!(values(&refused), (None, None, None));
        let point = GaitPoint::new("a", [2.0, 0.1], &refused);
        assert_eq!(point.why.as_deref(), Some("refused"));
    }
}
