//! Reading expectations of cycles and of the computational work.

use twinrig_document::{Item, Placed, Reported};
use twinrig_kernel::Unit;

use super::one_of::one_of;
use crate::domain::Domain;
use crate::expect::{Claim, CostMeasure, TimingClaim, TimingMeasure};
use crate::language::{Key, TableSpec, Type, table};
use crate::limits::Limits;
use crate::read::limits::limits_of;

/// Returns the type of limits of a [`TimingMeasure`].
macro_rules! cycle {
    ($measure:ident) => {
        limits_of!(
            TimingMeasure::$measure.unit(),
            TimingMeasure::$measure.domain(),
            |limits| (TimingMeasure::$measure, limits)
        )
    };
}

table! {
    /// Keys of `timing`.
    pub(super) timing_table =
        TableSpec::new("timing", "claim about the cycle of the controller or of a bus");
    OF: Placed<String> = "of", Type::PLACED,
        "`control`, or the name of a bus, whose transfers are its cycle", r#"of = "control""#,
        required(), qualifier();
    DEADLINE_MISSES: (TimingMeasure, Limits) = "deadline_misses", cycle!(DeadlineMisses),
        "number of missed cycles", "deadline_misses = { max = 0 }", one_of();
    CYCLE_RATE: (TimingMeasure, Limits) = "cycle_rate", cycle!(CycleRate),
        "begins after the first over the time from the first to the last",
        r#"cycle_rate = { min = "400 Hz" }"#, one_of();
    JITTER: (TimingMeasure, Limits) = "jitter", cycle!(Jitter),
        "greatest difference of an interval between begins from the controller's period",
        r#"jitter = { max = "50 us" }"#, one_of();
    LATENCY: (TimingMeasure, Limits) = "latency", cycle!(Latency),
        "greatest time from begin to end", r#"latency = { max = "2 ms" }"#, one_of();
    LONGEST_CYCLE: (TimingMeasure, Limits) = "longest_cycle", cycle!(LongestCycle),
        "greatest interval between begins", r#"longest_cycle = { max = "3 ms" }"#, one_of();
    HALF_RANGE: (TimingMeasure, Limits) = "half_range", cycle!(HalfRange),
        "half of greatest less least interval", r#"half_range = { max = "70 us" }"#, one_of();
}

/// Reads `timing = { … }`.
pub(super) fn claim(item: &Item<'_>) -> Result<Claim, Reported> {
    let table = &item.table()?;
    let table = timing_table::TABLE.of(table);
    let of = table.read(&timing_table::OF);
    let measure = one_of(table, item, "no measure of the timing is given")?;
    let (measure, limits) = table.read_named(measure)?;
    Ok(Claim::Timing(TimingClaim {
        of: Some(of?).filter(|of| of.value != "control"),
        measure,
        limits,
    }))
}

/// Returns the type of limits of a work counter.
macro_rules! counter {
    ($name:literal) => {
        limits_of!(Unit::One, Domain::COUNT, |limits| {
            Claim::Cost(CostMeasure::Count($name), limits)
        })
    };
}

table! {
    /// Keys of `cost`.
    pub(super) cost_table = TableSpec::new("cost", "claim about the computational work");
    STEPS: Claim = "steps", counter!("steps"), "steps of the plant", "steps = { max = 20000 }",
        one_of();
    EVALUATIONS: Claim = "evaluations", counter!("evaluations"),
        "evaluations of its equations of motion", "evaluations = { max = 20000 }", one_of();
    FACTORISATIONS: Claim = "factorisations", counter!("factorisations"),
        "factorisations of a matrix", "factorisations = { max = 20000 }", one_of();
    EVENTS: Claim = "events", counter!("events"), "located events", "events = { max = 20000 }",
        one_of();
    SOLVER_ITERATIONS: Claim = "solver_iterations", counter!("solver_iterations"),
        "iterations of its solvers", "solver_iterations = { max = 20000 }", one_of();
    FALLBACKS: Claim = "fallbacks", counter!("fallbacks"), "steps by a fallback method",
        "fallbacks = { max = 20000 }", one_of();
    REAL_TIME_FACTOR: Claim = "real_time_factor",
        limits_of!(Unit::One, Domain::POSITIVE, |limits| {
            Claim::Cost(CostMeasure::RealTimeFactor, limits)
        }),
        "simulated over elapsed time, which depends on the machine",
        "real_time_factor = { min = 10 }", one_of();
}

/// Reads `cost = { … }`.
pub(super) fn cost(item: &Item<'_>) -> Result<Claim, Reported> {
    let table = &item.table()?;
    let table = cost_table::TABLE.of(table);
    let measure = one_of(table, item, "no measure of the cost is given")?;
    table.read_named(measure)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_work_counter_is_a_key() {
        let keys = cost_table::TABLE.all_keys();
        let names: Vec<_> = keys.iter().map(|key| key.name).collect();
        assert_eq!(names[..6], CostMeasure::counts());
    }
}
