//! Bound of an expectation, from its outcome.

use twinrig_scenario::Outcome;

/// Returns least and greatest accepted value of an outcome with a bound.
pub fn limits(outcome: &Outcome) -> [Option<f64>; 2] {
    match sign(outcome) {
        "≤" => [outcome.other_bound, outcome.bound],
        "≥" => [outcome.bound, outcome.other_bound],
        _ => [None; 2],
    }
}

/// Returns the required relation of the measured value to its bound.
pub fn sign(outcome: &Outcome) -> &'static str {
    match (outcome.measured, outcome.bound, outcome.margin) {
        (Some(measured), Some(bound), Some(margin)) => {
            // The margin is bound − value for an upper bound and value − bound for a lower bound.
            let upper = (bound - measured - margin).abs() <= (measured - bound - margin).abs();
            if upper { "≤" } else { "≥" }
        }
        _ => "",
    }
}
