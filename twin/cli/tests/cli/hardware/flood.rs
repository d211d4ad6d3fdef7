//! Host that writes continuously.

use std::path::Path;
use std::time::Duration;

use twinrig::runtime::{Device, DeviceError};
use twinrig_sbcp::codes::{CLASS_MOTORDRIVER, Instruction};
use twinrig_sbcp::{Address, Parser, Request, Response};
use twinrig_wire::SerialPort;

use super::{Running, endless, now, wait_until};
use crate::common::Folder;

const BAUD: u32 = 3_333_333;
/// Duration of the flood; the test with a manual clock uses half a minute. A twin that accepts
/// bytes at the rate of the PTY would queue 50 MB and respond two minutes later.
const FLOOD: Duration = Duration::from_secs(3);
/// Maximum increase of the memory of the twin \[bytes\].
const MEMORY_INCREASE_MAX: u64 = 16 << 20;

/// Opens the port. Programs that other tests start hold a copy of a port just closed, and thereby
/// its lock, between fork and exec.
fn open(link: &str) -> SerialPort {
    let mut opened = None;
    wait_until("the port is free", || {
        match SerialPort::open(Path::new(link), BAUD) {
            Ok(port) => opened = Some(port),
            Err(DeviceError::Busy { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        opened.is_some()
    });
    opened.unwrap()
}

/// Writes invalid bytes as fast as they are accepted.
fn flood(link: &str) {
    let garbage: Vec<u8> = (0..1_000_u32)
        .map(|n| (n * 7 % 250).to_le_bytes()[0])
        .collect();
    let (mut port, begin) = (open(link), now());
    while begin.elapsed() < FLOOD {
        match port.write(&garbage) {
            Ok(()) | Err(DeviceError::Stuck { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// Returns whether a board responds within 500 ms, which may fail on a busy machine.
fn answers(port: &mut SerialPort) -> bool {
    let board = Address::new(CLASS_MOTORDRIVER, 1).unwrap();
    let mut request = Vec::new();
    Request::new(board, Instruction::PING, &[])
        .unwrap()
        .emit(&mut request);
    port.write(&request).unwrap();
    let (mut bytes, mut parser) = (Vec::new(), Parser::default());
    port.read(Duration::from_millis(500), &mut bytes).unwrap();
    let mut rest = &bytes[..];
    while let Some(packet) = parser.next(&mut rest) {
        if Response::parse(&packet).is_ok_and(|response| response.from() == board) {
            return true;
        }
    }
    false
}

#[test]
fn flooded_twin_limits_memory_and_responds_afterwards() {
    let folder = Folder::new("flooded");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    let served = Running::serve(&folder, &scenario, &link, &["--keep"]);
    wait_until("a board answers", || answers(&mut open(&link)));
    let before = served.memory();
    flood(&link);
    let after = served.memory();
    assert!(
        after < before + MEMORY_INCREASE_MAX,
        "{before} bytes, then {after}"
    );
    let begin = now();
    let mut port = open(&link);
    wait_until("a board answers again", || answers(&mut port));
    println!("answered {:?} after the flood", begin.elapsed());
}
