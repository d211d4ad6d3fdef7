//! How long things take, from a scenario's words to the executor's.

use twinrig_runtime::Timing;
use twinrig_scenario::TimeModel;

/// How the executor draws what the scenario says.
pub(crate) fn timing(model: &TimeModel) -> Timing {
    match model {
        TimeModel::Constant(duration) => Timing::Constant(*duration),
        TimeModel::Uniform { min, max } => Timing::Uniform {
            min: *min,
            max: *max,
        },
        TimeModel::Normal {
            mean,
            deviation,
            min,
            max,
        } => Timing::Normal {
            mean: *mean,
            deviation: *deviation,
            min: *min,
            max: *max,
        },
        TimeModel::Trace(trace) => Timing::Trace(trace.clone()),
    }
}
