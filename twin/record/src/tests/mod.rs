//! Tests of recordings: written, damaged, read by others.

mod aligned;
mod allocation;
mod common;
mod damage;
mod divergence;
mod import;
mod killed;
mod pairing;
mod python;
mod round_trip;
