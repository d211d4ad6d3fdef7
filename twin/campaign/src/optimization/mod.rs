//! Optimisations: adaptive sweeps, whose points are chosen by a search.
//!
//! A [`SearchSpace`] has dimensions and an objective, the measured value of an expectation. A
//! [`CostRule`] makes one number of a row, which orders runs; of several [`SearchCase`]s the worst
//! run of a point counts. The caller asks the space's
//! [`Search`](crate::search::Search) for generations, has an engine run their points, and tells it
//! the costs; rows are kept in a [`RowStore`](crate::sweep::RowStore). A restarted optimisation
//! repeats the search with the costs of the store.

mod case;
mod cost;
mod csv;
mod result;
pub(crate) mod space;

pub use case::SearchCase;
pub use cost::{CostRule, Evaluation, JudgedExpectation, RunClass};
pub use result::{
    BestPoint, CaseEvaluation, EvaluatedPoint, EvaluationCounts, Generation, OptimizationResult,
    OptimizationVerdict, OptimizedDimension,
};
pub use space::{ConstraintChoice, Direction, SearchMethod, SearchSpace, SpaceDimension};
