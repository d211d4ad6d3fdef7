//! Expectations of the whole run: energy balance and cost.

use super::RunEnd;
use super::outcome::Finding;
use crate::expect::CostMeasure;
use crate::limits::Limits;

pub(super) fn energy(balance: Option<(f64, f64)>, limits: &Limits) -> Finding {
    let Some((residual, exchanged)) = balance else {
        return Finding::unobserved("nobody keeps energy books");
    };
    if exchanged == 0.0 {
        return Finding::unobserved("no energy was exchanged");
    }
    let share = residual.abs() / exchanged;
    if share.is_finite() {
        Finding::of(limits.compare(share, share), None, "")
    } else {
        Finding::not_a_number(None)
    }
}

pub(super) fn cost(measure: CostMeasure, limits: &Limits, run: &RunEnd<'_>) -> Finding {
    let value = match measure {
        CostMeasure::RealTimeFactor => run.real_time_factor,
        CostMeasure::Count(name) => {
            let count = run.work.iter().find(|(known, _)| *known == name);
            count.map(|(_, count)| *count as f64)
        }
    };
    match value {
        Some(value) if value.is_finite() => Finding::of(limits.compare(value, value), None, ""),
        Some(_) => Finding::not_a_number(None),
        None => Finding::unobserved("nobody counted"),
    }
}
