//! Tests of Feetech servos: packets, servos, the laws of the driver.

mod laws;
mod packets;
mod servos;
