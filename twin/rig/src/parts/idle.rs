//! Process of a scenario without a controller.

use twinrig_kernel::{Port, SimDuration};
use twinrig_runtime::Process;

/// Process without inputs, outputs and state.
pub(crate) struct Idle;

impl Process for Idle {
    fn name(&self) -> &'static str {
        "none"
    }

    fn ports(&self) -> Vec<Port> {
        Vec::new()
    }

    fn step(&mut self, _: SimDuration, _: &[f64], _: &mut [f64]) {}
}
