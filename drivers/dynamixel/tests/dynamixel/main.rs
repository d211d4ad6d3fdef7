//! Tests of Dynamixel servos: packets, buses, the laws of the driver, the timing of loops.

mod bus;
mod laws;
mod protocol;
mod timing;
