//! Tests of the bus of tactile sensors.

mod clock;
mod filter;
mod protocol;
mod pty;
mod requests;
mod stages;
mod support;
mod wired;
