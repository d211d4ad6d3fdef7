//! The native half of the Python package `twinrig`: runs, checks and reads for the package, whose
//! Python half (`python/twinrig`) has the interface that users see. Numbers reach `NumPy` without a
//! copy, the interpreter is released while Rust works, and Python's own signal handlers stay in
//! charge: a run ends when one of them raises.
//!
//! Every function here takes and returns plain Python values; names and units of what it returns
//! are in `_native.pyi`.
//!
//! ```python
//! import twinrig
//!
//! run = twinrig.run("scenarios/trot.toml", seed=2)
//! print(run.verdict, run.signals["leg/LF/hip/position"].unit)
//! ```
//!
//! Out of scope: physics, scenarios and verdicts, which are those of the crate `twinrig`.

mod channels;
mod check;
mod controller;
mod errors;
mod exceptions;
mod fall;
mod fmu;
mod fork;
mod interpreter;
mod lanes;
mod laws;
mod part;
mod part_objects;
mod parts;
mod plant;
mod poll;
mod program;
mod ray_engine;
mod ray_process;
mod recording;
mod registry;
mod rig;
mod rig_state;
mod rollout;
mod run;
mod samples;
mod scenario;
mod step_all;
mod supervised;
mod variable;
mod worker_job;
mod workers;

use pyo3::prelude::pymodule;

/// Functions behind the package `twinrig`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::check::{check, plan};
    #[pymodule_export]
    use crate::fork::forked;
    #[pymodule_export]
    use crate::lanes::{PyLane, step_lanes};
    #[pymodule_export]
    use crate::laws::{case_ranges, check_law, check_setup};
    #[pymodule_export]
    use crate::program::{command, main};
    #[pymodule_export]
    use crate::recording::read;
    #[pymodule_export]
    use crate::rig::PyRig;
    #[pymodule_export]
    use crate::rollout::rollout;
    #[pymodule_export]
    use crate::run::run;
    #[pymodule_export]
    use crate::step_all::step_all;
    #[pymodule_export]
    use crate::worker_job::PyWorkerJob;
    #[pymodule_export]
    use crate::workers::PyWorkers;

    /// Version of the package.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
