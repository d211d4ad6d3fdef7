//! Lockstep co-simulation of a controller, its input and output, and a plant: one scheduling rule
//! and its executors in virtual time and in real time. In virtual time the same parts, seed and
//! schedule give the same run, bit for bit; compute and transfer times are part of the model, so
//! that an overrun is reproducible.
//!
//! A [`Process`] (a controller) exchanges named signals with [`IoTask`]s (transfers with a device);
//! the [`Manager`] schedules both; the [`Rig`] executes the schedule with a [`Plant`] behind the
//! tasks, and reports to an [`Observer`].
//!
//! ```
//! use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
//! use twinrig_runtime::{
//!     DirectIo, Group, Plant, PlantFault, Process, Rig, Schedule, Timing,
//! };
//!
//! /// Linear spring towards the origin, 4 N/m.
//! struct Spring;
//! impl Process for Spring {
//!     fn name(&self) -> &str { "spring" }
//!     fn ports(&self) -> Vec<Port> {
//!         vec![
//!             Port::input("cart/position", Unit::Meter, 1),
//!             Port::output("cart/force", Unit::Newton, 1),
//!         ]
//!     }
//!     fn step(&mut self, _: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
//!         outputs[0] = -4.0 * inputs[0];
//!     }
//! }
//!
//! /// Cart of 1 kg.
//! struct Cart { now: SimTime, position: f64, velocity: f64 }
//! impl Plant for Cart {
//!     fn name(&self) -> &str { "cart" }
//!     fn ports(&self) -> Vec<Port> {
//!         vec![
//!             Port::input("cart/force", Unit::Newton, 1),
//!             Port::output("cart/position", Unit::Meter, 1),
//!         ]
//!     }
//!     fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
//!         let seconds = (to - self.now).as_secs_f64();
//!         self.velocity += seconds * inputs[0];
//!         self.position += seconds * self.velocity;
//!         self.now = to;
//!         Ok(())
//!     }
//!     fn observe(&mut self, outputs: &mut [f64]) { outputs[0] = self.position; }
//!     fn save(&self) -> Snapshot { Snapshot::of(&(self.now, self.position, self.velocity)) }
//!     fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
//!         (self.now, self.position, self.velocity) = snapshot.read()?;
//!         Ok(())
//!     }
//! }
//!
//! let transfer = Timing::Constant(SimDuration::from_micros(300));
//! let io = DirectIo::for_process("direct", &Spring.ports(), transfer, 1)?;
//! let cart = Cart { now: SimTime::ZERO, position: 1.0, velocity: 0.0 };
//! let schedule = Schedule::with_period(SimDuration::from_millis(2));
//! let mut rig = Rig::new(&schedule, Box::new(Spring), vec![Box::new(io)], Box::new(cart))?;
//!
//! rig.run_until(SimTime::ZERO + SimDuration::from_secs(1), &mut ())?;
//! assert_eq!(rig.layout(Group::Plant).find("cart/position"), Some(0..1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Limits: no scenarios, files, protocols or physics; outside [`real_time`] no clock and no
//! threads; recording is left to observers.

mod bus_health;
mod composite_plant;
mod device;
mod direct_io;
mod driver;
mod error;
mod event_loop;
mod fault;
mod fault_selection;
mod fixed_step_coupling;
mod input_average;
pub mod interrupt;
mod ledger;
mod limit;
mod manager;
mod observer;
mod output_interpolator;
mod panic;
mod part;
mod plant;
mod plant_host;
mod plant_state;
mod process;
mod process_slot;
pub mod real_time;
mod rig;
mod schedule;
mod sensor;
mod task;
mod timing;
mod traced_wire;
mod traffic_log;
mod variable;
mod wire;
mod wired_task;
mod wiring;

pub use std::ops::Bound;

pub use bus_health::{BusError, BusHealth, BusSummary, LateDevice, SLOW_CLOCK, Silence};
pub use composite_plant::{CompositePlant, NameClash};
pub use device::{Device, DeviceError, READ_MAX};
pub use direct_io::DirectIo;
pub use driver::{Driver, DriverError};
pub use error::RigError;
pub use fault::FaultKind;
pub use fault_selection::{
    DriverPhase, FaultDirection, FaultEffect, FaultSelection, FrameChoice, FrameCount, PhaseClock,
};
pub use fixed_step_coupling::{Coupling, FixedStepCoupling, GridInputs, ZeroGridStep};
pub use ledger::{Ledger, NegativeDissipation, Stored};
pub use limit::{Limit, LimitViolation};
pub use manager::{ControlStep, Manager};
pub use observer::{Group, Observer, RunEvent};
pub use panic::{PanicReport, PartKind, catch_panic, in_part};
pub use part::{BusWork, Part};
pub use plant::{EnergyBalance, Plant, PlantEvent, PlantEventKind, PlantFault, WorkCounts};
pub use plant_state::PlantState;
pub use process::{Process, check_values, restore_values};
pub use rig::Rig;
pub use schedule::{Change, Schedule, slewed};
pub use sensor::{SensorModel, SensorModelError};
pub use task::{IoTask, Phase, PlantAccess, Progress, TaskError};
pub use timing::{TimeSource, Timing, TimingError};
pub use traffic_log::TrafficLog;
pub use variable::{ProcessVariable, VariableError};
pub use wire::{TransmitBuffer, Wire};
pub use wired_task::WiredTask;
pub use wiring::{NearMisses, PlantSignals, WiringError};
