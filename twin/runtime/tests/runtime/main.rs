//! Tests of the runtime's interface.

mod allocation;
mod coupling;
mod faults;
mod grid;
mod opening;
mod order;
mod oscillator;
mod overrides;
mod scheduling;
mod sensors;
mod snapshots;
mod toys;
mod wiring;
