//! Expectations of the whole run: energy balance and cost.

use twinrig_kernel::SimTime;
use twinrig_runtime::{BusSummary, EnergyBalance, WorkCounts};

use super::outcome::Finding;
use crate::expect::CostMeasure;
use crate::limits::Limits;

/// Final data of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunEnd<'b> {
    /// Time at which the run ended. If that is before the end of the scenario, no expectation
    /// passes, unless a fall ended the run as configured and the window of the expectation was
    /// complete.
    pub at: SimTime,
    /// Energy balance of the plant; none without a plant.
    pub energy: Option<EnergyBalance>,
    /// Work of the plant; none without a plant.
    pub work: Option<WorkCounts>,
    /// Simulated over wall-clock time; none if it was not measured.
    pub real_time_factor: Option<f64>,
    /// Traffic of the buses.
    pub buses: &'b [BusSummary],
}

/// Least reference for the residual \[J\]. At rest the exchanged energy is round-off, and the
/// residual is no small share of it.
const LEAST_EXCHANGED: f64 = 1e-3;

pub(super) fn energy(balance: Option<&EnergyBalance>, limits: &Limits) -> Finding {
    let Some(balance) = balance else {
        return Finding::unobserved("no energy balance is kept");
    };
    let (residual, exchanged) = (balance.residual, balance.exchanged);
    if exchanged == 0.0 {
        return Finding::unobserved("no energy was exchanged");
    }
    // `f64::max` would discard a NaN.
    let reference = if exchanged < LEAST_EXCHANGED {
        LEAST_EXCHANGED
    } else {
        exchanged
    };
    let share = residual.abs() / reference;
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
            // A plant that counts no steps counts nothing.
            let counted = run.work.iter().filter(|work| work.steps > 0);
            let mut counts = counted.flat_map(WorkCounts::named);
            let count = counts.find(|(known, _)| *known == name);
            count.map(|(_, count)| count as f64)
        }
    };
    match value {
        Some(value) if value.is_finite() => Finding::of(limits.compare(value, value), None, ""),
        Some(_) => Finding::not_a_number(None),
        None => Finding::unobserved("work is not counted"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::Verdict;

    const LIMITS: Limits = Limits {
        min: None,
        max: Some(1e-6),
    };

    fn verdict(residual: f64, exchanged: f64) -> Verdict {
        let balance = EnergyBalance {
            residual,
            exchanged,
            ..EnergyBalance::default()
        };
        energy(Some(&balance), &LIMITS).verdict
    }

    #[test]
    fn energy_balance_at_rest_closes_within_round_off() {
        assert_eq!(verdict(3e-12, 1e-11), Verdict::Pass);
        assert_eq!(verdict(-3e-12, 1e-11), Verdict::Pass);
    }

    #[test]
    fn open_energy_balance_fails_for_any_exchanged_energy() {
        assert_eq!(verdict(2e-9, 1e-11), Verdict::Fail);
        assert_eq!(verdict(-2e-9, 1e-3), Verdict::Fail);
        assert_eq!(verdict(2e-6, 1.0), Verdict::Fail);
        assert_eq!(verdict(5e-7, 1.0), Verdict::Pass);
    }

    #[test]
    fn cost_without_counts_is_unobserved() {
        let end = |work| RunEnd {
            at: twinrig_kernel::SimTime::ZERO,
            energy: None,
            work,
            real_time_factor: None,
            buses: &[],
        };
        let verdict = |work| cost(CostMeasure::Count("steps"), &LIMITS, &end(work)).verdict;
        assert_eq!(verdict(Some(WorkCounts::of_steps(1))), Verdict::Fail);
        assert_eq!(verdict(Some(WorkCounts::default())), Verdict::Unobserved);
        assert_eq!(verdict(None), Verdict::Unobserved);
    }

    #[test]
    fn nan_exchanged_energy_does_not_pass() {
        assert_ne!(verdict(0.0, f64::NAN), Verdict::Pass);
    }
}
