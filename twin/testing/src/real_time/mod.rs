//! Protocol with three requests, both of its ends, and a process, for runs in real time.

mod driver;
mod echo_wire;
mod log;
mod process;

pub use driver::HalvingDriver;
pub use echo_wire::{EchoWire, Lag, SilentWire};
pub use log::{Entry, Log};
pub use process::Summing;

use twinrig_kernel::{Port, Unit};

/// Presence request; answered by the same byte.
pub const OPEN: u8 = b'o';
/// Followed by a number of 8 bytes; answered by half of it.
pub const HALVE: u8 = b'a';
/// Closes the session; not answered.
pub const CLOSE: u8 = b'c';
/// Length of a number \[bytes\].
pub const NUMBER: usize = 8;

/// Removes all complete requests from `received` and returns the answers of the far end.
pub fn answer(received: &mut Vec<u8>) -> Vec<u8> {
    let mut answers = Vec::new();
    loop {
        match received.first() {
            Some(&OPEN) => {
                received.remove(0);
                answers.push(OPEN);
            }
            Some(&HALVE) if received.len() > NUMBER => {
                let number = f64::from_le_bytes(received[1..=NUMBER].try_into().unwrap());
                received.drain(..=NUMBER);
                answers.extend((number / 2.0).to_le_bytes());
            }
            Some(&CLOSE) => {
                received.remove(0);
            }
            _ => return answers,
        }
    }
}

/// Returns the ports of the driver `name`.
pub fn ports(name: &str) -> [Port; 2] {
    [
        Port::input(format!("{name}/number"), Unit::One, 1),
        Port::output(format!("{name}/half"), Unit::One, 1),
    ]
}
