//! Contents of a plan.

use serde::Serialize;
use twinrig_rig::report::WarningEntry;
use twinrig_scenario::LeftOut;

use super::actuator::Actuator;
use super::loads::Loads;
use super::push::PlannedPush;
use super::sensor::Sensor;

/// Plan of a scenario, as `--json` has it.
#[derive(Serialize)]
pub(super) struct Plan {
    pub(super) scenario: String,
    pub(super) seed: u64,
    pub(super) duration_s: f64,
    pub(super) plant: String,
    /// Formulation of the constraints, where there is a choice.
    pub(super) constraints: Option<&'static str>,
    pub(super) controller: Option<String>,
    /// Name of the robot file, or of the standalone model.
    pub(super) robot: String,
    pub(super) legs: Vec<String>,
    pub(super) schedule: Timetable,
    /// Drives of the robot; none for a standalone model.
    pub(super) actuator: Option<Actuator>,
    #[serde(flatten)]
    pub(super) loads: Loads,
    pub(super) coupling: String,
    pub(super) wires: Vec<Wire>,
    /// Sensors between the wires and the controller.
    pub(super) sensors: Vec<Sensor>,
    /// Inputs of the plant that are not driven: they keep their initial values.
    pub(super) free: Vec<Free>,
    pub(super) signals: Vec<Signal>,
    #[serde(rename = "gauges")]
    pub(super) diagnostics: Vec<Diagnostic>,
    pub(super) changes: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) pushes: Vec<PlannedPush>,
    pub(super) expectations: Vec<String>,
    pub(super) left_out: Vec<LeftOut>,
    pub(super) warnings: Vec<WarningEntry>,
}

/// Periods and steps \[s\].
#[derive(Serialize)]
pub(super) struct Timetable {
    pub(super) io_step_s: f64,
    pub(super) control_period_s: f64,
    pub(super) observe_period_s: f64,
    pub(super) frames_hz: Option<f64>,
    pub(super) plant_step_s: Option<f64>,
    /// Step of the communication grid of plant and boards; none: exact coupling.
    pub(super) coupling_grid_s: Option<f64>,
}

/// Connection of two parts.
#[derive(Serialize)]
pub(super) struct Wire {
    pub(super) signal: String,
    pub(super) unit: &'static str,
    pub(super) from: String,
    pub(super) to: String,
}

/// Input of the plant.
#[derive(Serialize)]
pub(super) struct Free {
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) size: usize,
}

/// Output of the plant.
#[derive(Serialize)]
pub(super) struct Signal {
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) size: usize,
    pub(super) computed: bool,
    pub(super) recorded: bool,
}

/// Counter of a driver or a board.
#[derive(Serialize)]
pub(super) struct Diagnostic {
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) recorded: bool,
}
