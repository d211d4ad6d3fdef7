//! Test harnesses, for the tests of this workspace and of crates with parts of their own.
//!
//! - [`driver_harness`]: a driver and an emulated device step by step, without wire and rig.
//! - [`wired_harness`]: a driver and its wire step by step, with joints that turn as they are
//!   driven.
//! - [`rig_harness`]: a rig around a driver and its wire, with a scripted process and a plant of
//!   known signals.
//! - [`mod@laws`]: laws that hold for every driver with its devices, and find the faults of one.
//! - [`framing`]: properties of the messages of a framed protocol.
//! - [`real_time`]: a protocol, both of its ends and a process, for runs in real time.
//! - [`plant_harness`]: a plant with its commands, signals and time.
//! - [`robots`], [`trot`]: robots, their setups and commands.
//! - [`abduction`]: legs that abduct.
//! - [`point_masses`]: robots as point masses, for their equations of motion.
//! - [`reference_trajectory`]: trajectories that legs must follow.
//! - [`python`]: comparison with Python packages.
//! - [`folder`]: a temporary folder.
//! - [`keys`]: tables of keys in documentation.
//!
//! A harness panics where an assumption of the test does not hold.
#![allow(clippy::missing_panics_doc, reason = "a harness reports by panicking")]
#![allow(
    clippy::missing_errors_doc,
    reason = "the errors are faults of the plant"
)]

pub mod abduction;
pub mod driver_harness;
pub mod folder;
pub mod framing;
pub mod keys;
pub mod laws;
pub mod plant_harness;
pub mod point_masses;
pub mod python;
pub mod real_time;
pub mod reference_trajectory;
pub mod rig_harness;
pub mod robots;
pub mod trot;
pub mod wired_harness;
