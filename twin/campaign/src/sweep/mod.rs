//! Sweeps: a scenario at many points, and shares of its runs.
//!
//! A [`SweepSpec`] has [`SweepDimension`]s and a [`Design`], which chooses the points. The caller
//! makes each a task of an [`Engine`](crate::engine::Engine); the [`SweepRow`]s are kept on disk by
//! a [`RowStore`], from which a later sweep continues, and a [`RowSummary`] of each in memory.
//! [`Share`]s of the rows are judged by Wilson's interval.

mod csv;
mod design;
mod dimension;
mod json;
mod log;
mod morris;
mod partition;
pub(crate) mod read;
mod reader;
mod result;
mod row;
mod share;
mod spec;
mod store;
mod summary;
mod value;
mod wilson;

pub(crate) use csv::csv_line;
pub use csv::{RowTable, effects_csv};
pub use design::{Design, DesignKind};
pub(crate) use dimension::rounded;
pub use dimension::{DimensionValues, SweepDimension, ValueInterval};
pub use json::SweepJson;
pub use log::{RowPlace, StoreError};
pub use morris::{ElementaryEffect, FAILED_EXPECTATIONS};
pub use partition::Partition;
pub use read::{POINTS_MOST, overlap};
pub use reader::RowReader;
pub use result::{
    CompleteRow, FailedRun, ResultDimension, ResultRow, SweepCounts, SweepResult, SweepVerdict,
    point_name,
};
pub use row::{ExpectationVerdict, RowExpectation, RowKey, RowVerdict, SweepRow, VERDICT_SHARE};
pub use share::{Share, ShareSpec, ShareVerdict};
pub use spec::SweepSpec;
pub use store::RowStore;
pub use summary::{ExpectationSummary, RowSummaries, RowSummary};
pub use value::SweepValue;
pub use wilson::ShareInterval;
