//! A host that writes without a pause.

use std::path::Path;
use std::time::Duration;

use twinrig::runtime::{Device, DeviceError};
use twinrig_sbcp::codes::{CLASS_MOTORDRIVER, Instruction};
use twinrig_sbcp::{Address, Parser, Request, Response};
use twinrig_wire::SerialPort;

use super::{Running, endless, eventually, now};
use crate::common::Folder;

const BAUD: u32 = 3_333_333;
/// Shorter than the flood of half a minute under a clock that is wound by hand; a twin that takes what a PTY passes has 50 MB
/// in its queue by then, and answers two minutes later.
const FLOOD: Duration = Duration::from_secs(3);
/// More memory than this no twin takes for it \[bytes\].
const MORE: u64 = 16 << 20;

fn open(link: &str) -> SerialPort {
    SerialPort::open(Path::new(link), BAUD).unwrap()
}

/// Writes what is no packet, as fast as it is taken.
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

/// Whether a board answers at once, which it may not on a machine that is busy.
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
fn a_twin_that_is_flooded_takes_no_more_than_the_wire_and_answers_afterwards() {
    let folder = Folder::new("flooded");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    let served = Running::serve(&folder, &scenario, &link, &["--keep"]);
    eventually("a board answers", || answers(&mut open(&link)));
    let before = served.memory();
    flood(&link);
    let after = served.memory();
    assert!(after < before + MORE, "{before} bytes, then {after}");
    let begin = now();
    let mut port = open(&link);
    eventually("a board answers again", || answers(&mut port));
    println!("answered {:?} after the flood", begin.elapsed());
}
