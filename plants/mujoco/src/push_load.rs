//! Load of pushes on trunk and feet.

use nalgebra::Vector3;
use twinrig_legged::{LEGS, StepLoad};

/// Load of pushes in a step.
#[derive(Debug, Clone, Default)]
pub(crate) struct PushLoad {
    pub(crate) load: StepLoad,
    /// Forces of the present step, world axes.
    pub(crate) forces: Option<Pushed>,
}

/// Forces of pushes, world axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pushed {
    /// Force on the trunk \[N\], and torque about its centre of mass \[N·m\].
    pub(crate) force: Vector3<f64>,
    pub(crate) torque: Vector3<f64>,
    /// Forces on the feet \[N\].
    pub(crate) feet: [Vector3<f64>; LEGS],
}
