//! Tests in real time: serial ports, ports over a network, runs and served twins.

mod network;
mod ports;
mod runs;
mod serve;
#[cfg(target_os = "linux")]
mod support;
