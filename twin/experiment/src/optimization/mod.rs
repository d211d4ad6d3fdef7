//! Optimizations: settings of a scenario with the best value of an expectation.
//!
//! An optimisation is a sweep whose points a `Search` chooses, generation by generation: `RunPlan`
//! and `SweepJob` are those of sweeps, and a point is a `SweepRow` in the same store. `CostRule`
//! makes one number of a row. The cost of a run with a fall depends on the time before it alone, so
//! that runs may end there (`Expectation::rates_falls` and `changed_by_falls_before` say how each
//! claim depends on falls). The swarm of `argmin` asks for costs in the midst of an iteration; a
//! copy of it is stopped there (`SwarmSearch`).

pub(crate) mod execute;
mod files;
pub(crate) mod outcome;
mod plan;
mod running;
#[cfg(test)]
mod tests;
mod text;
mod view;

pub use view::optimization_page;
pub(crate) use view::{best_cases, best_point, evaluation_class};
