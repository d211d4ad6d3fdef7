//! Sweeps: from a specification to rows, files and reports.
//!
//! `SweepPlan` reads all files once, for each combination of values that may name files, and gives
//! every point its settings and a key: the hash of program, files and settings. Points share the
//! contents of these files; the scenario is parsed and the scene built for each point. An engine
//! runs the points that the `RowStore` lacks; the calling thread appends each row by one write to a
//! file that it has locked. In memory there is a `RowSummary` of each point, from which shares,
//! effects and the page are made, and the place of its row; `rows.csv` and `sweep.json` are written
//! row by row from the disk. The result is made of the rows in the order of the points, so that
//! engines, interruptions and partitions cannot change it.

pub(crate) mod execute;
pub(crate) mod files;
pub(crate) mod plan;
pub(crate) mod rows;
mod text;
mod view;

pub use text::share_sentence;
pub use view::sweep_page;
