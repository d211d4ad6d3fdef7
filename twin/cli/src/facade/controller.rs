//! Controllers: a [`Process`] computes commands from measurements, once in every period, in virtual
//! time and on the robot alike. A [`ControllerKind`] makes it known to scenarios.
//!
//! ```
//! use twinrig::controller::{
//!     ControllerKind, Port, Process, ProcessVariable, SimDuration, Snapshot, SnapshotError, Unit,
//! };
//!
//! /// Holds all hips at an angle that scenarios set.
//! struct Hold {
//!     legs: Vec<String>,
//!     variables: [ProcessVariable; 1],
//! }
//!
//! fn variables() -> [ProcessVariable; 1] {
//!     [ProcessVariable::new("angle", Unit::Radian, -1.0..=1.0, 0.0)]
//! }
//!
//! impl Process for Hold {
//!     fn name(&self) -> &str { "hold" }
//!     fn ports(&self) -> Vec<Port> {
//!         let hip = |leg| Port::output(format!("leg/{leg}/hip/command"), Unit::Radian, 1);
//!         self.legs.iter().map(hip).collect()
//!     }
//!     fn variables(&self) -> &[ProcessVariable] { &self.variables }
//!     fn variables_mut(&mut self) -> &mut [ProcessVariable] { &mut self.variables }
//!     fn step(&mut self, _: SimDuration, _: &[f64], outputs: &mut [f64]) {
//!         outputs.fill(self.variables[0].value());
//!     }
//!     fn save(&self) -> Snapshot { Snapshot::of(&self.variables) }
//!     fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
//!         self.variables = snapshot.read()?;
//!         Ok(())
//!     }
//! }
//!
//! let hold = ControllerKind::new("hold", "holds all hips at an angle", |context| {
//!     let legs = context.legs.iter().map(|&leg| leg.to_owned()).collect();
//!     Ok(Hold { legs, variables: variables() })
//! });
//! let hold = hold.with_variables(|_| Ok(variables().to_vec()));
//! let registry = twinrig::registry().with_controller(hold);
//! assert!(registry.controllers().any(|name| name == "hold"));
//! ```

pub use twinrig_document::Range;
pub use twinrig_estimate as estimate;
pub use twinrig_gait as gait;
pub use twinrig_kernel::{
    Direction, Port, SignalKind, SimDuration, SimTime, Snapshot, SnapshotError, Unit, signal,
};
pub use twinrig_robot::leg::{LegCommand, LegError, Pantograph, Planar};
pub use twinrig_robot::{Leg, LegMount, Robot};
pub use twinrig_runtime::{Bound, Process, ProcessVariable, VariableError};
pub use twinrig_scenario::{Accepts, LegFact, OptionSpec, OptionValue, Options};

pub use twinrig_rig::error::BuildError;
pub use twinrig_rig::parts::controller_kind::{ControllerContext, ControllerKind, LegContext};
