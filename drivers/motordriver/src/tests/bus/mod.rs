//! Driver, wire and boards together.

mod allocation;
mod faults;
mod harness;
mod health;

mod packets;
mod rates;
mod restore;
mod session;
mod shaft;
mod table_5_4;
mod timing;
mod wakes;
