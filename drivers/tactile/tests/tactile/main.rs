//! Tests of the bus of tactile sensors.

mod clock;
mod filter;
mod laws;
mod protocol;
mod pty;
mod requests;
mod stages;
mod support;
mod wired;
