//! Test benches of motors and servos.

mod motors;
mod servos;
