//! Properties of robot, plant and controller that a scenario does not state.

use twinrig_kernel::Port;

use crate::ground_below::GroundBelow;

/// A leg of the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LegFact {
    /// Name: `LF`.
    pub name: String,
    /// Whether it is in front of the centre of mass.
    pub fore: bool,
    /// Whether it is on the left side.
    pub left: bool,
}

/// Properties of robot, plant and controller from which a scenario becomes a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// The legs that [`crate::Scenario::legs`] keeps.
    pub legs: Vec<LegFact>,
    /// The robot's weight \[N\].
    pub weight: f64,
    /// All outputs that the plant can provide for these legs.
    pub plant_outputs: Vec<Port>,
    /// Inputs and outputs of the controller; empty without one.
    pub process_ports: Vec<Port>,
    /// Counters of drivers and boards; empty without a bus.
    pub diagnostics: Vec<Port>,
    /// The plant outputs that boards measure.
    pub measured: Vec<String>,
    /// Patterns of the plant outputs that a recording of poses requires.
    pub frame_signals: Vec<String>,
    /// Ground for the detection of falls.
    pub ground: GroundBelow,
}
