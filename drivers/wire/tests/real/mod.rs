//! A protocol of three requests, both of its ends, and a process: what real-time runs are tested on.
#![allow(dead_code, unused_imports, reason = "each test uses some of it")]

mod driver;
mod echo_wire;
mod log;
mod process;

pub use driver::Asker;
pub use echo_wire::{EchoWire, Lag, Quiet};
pub use log::{Entry, Log};
pub use process::Summing;

use twinrig_kernel::{Port, Unit};

/// Asks whether somebody is there; answered by the same byte.
pub const OPEN: u8 = b'o';
/// Followed by a number, of 8 bytes; answered by half of it.
pub const ASK: u8 = b'a';
/// Says goodbye; not answered.
pub const CLOSE: u8 = b'c';
/// Length of a number.
pub const NUMBER: usize = 8;

/// What the far end answers to all requests that are whole, which it takes out of `heard`.
pub fn answer(heard: &mut Vec<u8>) -> Vec<u8> {
    let mut answers = Vec::new();
    loop {
        match heard.first() {
            Some(&OPEN) => {
                heard.remove(0);
                answers.push(OPEN);
            }
            Some(&ASK) if heard.len() > NUMBER => {
                let number = f64::from_le_bytes(heard[1..=NUMBER].try_into().unwrap());
                heard.drain(..=NUMBER);
                answers.extend((number / 2.0).to_le_bytes());
            }
            Some(&CLOSE) => {
                heard.remove(0);
            }
            _ => return answers,
        }
    }
}

/// Ports of the driver `name`.
pub fn ports(name: &str) -> [Port; 2] {
    [
        Port::input(format!("{name}/number"), Unit::One, 1),
        Port::output(format!("{name}/half"), Unit::One, 1),
    ]
}
