//! The program from outside.

mod builds;
mod commands;
mod common;
mod falls;
#[cfg(unix)]
mod hardware;
#[cfg(unix)]
mod interrupt;
mod mjcf;
mod observations;
mod panics;
mod recordings;
mod schema;
mod studies;
mod together;
mod unwritten;
mod warnings;
