//! Tests of live runs in simulated time: sessions and requests of visitors.

mod control;
mod session;
