//! Tests of driver and boards on their bus.

mod bus;
mod laws;
