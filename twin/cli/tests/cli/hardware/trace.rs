//! What a run put onto its bus, as any reader of recordings finds it.

use mcap::MessageStream;
use twinrig_record::{EventMessage, Recording};
use twinrig_sbcp::codes::Instruction;
use twinrig_sbcp::{Packet, Parser};

/// Something that happened in a run, in the order of its recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Happened {
    /// A control step that was missed.
    Missed,
    /// The bus was busy at the iteration that has begun.
    Skipped,
    /// An iteration ended with these commands.
    Commanded(Vec<u8>),
    /// These bytes were written to the bus.
    Wrote(Vec<u8>),
}

/// The recording in the file at `path`.
pub fn story(path: &str) -> Vec<Happened> {
    /// Header of a message, and length of the bytes in it.
    const AHEAD: usize = 4 + 4;
    let bytes = std::fs::read(path).unwrap();
    let recording = Recording::from_bytes(bytes.clone()).unwrap();
    let mut events = recording.messages::<EventMessage>().unwrap().into_iter();
    let messages = MessageStream::new(&bytes).unwrap();
    messages
        .filter_map(|message| {
            let message = message.unwrap();
            match message.channel.topic.as_str() {
                "/process_outputs" => Some(Happened::Commanded(message.data.into())),
                "/wire/sbcp/out" => Some(Happened::Wrote(message.data[AHEAD..].into())),
                "/diagnostics" => happened(&events.next().unwrap().1),
                _ => None,
            }
        })
        .collect()
}

fn happened(event: &EventMessage) -> Option<Happened> {
    match event.event.as_str() {
        "overrun" => Some(Happened::Missed),
        "task skipped" => {
            assert_eq!(event.part.as_deref(), Some("sbcp"));
            Some(Happened::Skipped)
        }
        _ => None,
    }
}

/// All requests that were written, one after the other.
pub fn requests(story: &[Happened]) -> Vec<Vec<u8>> {
    let mut parser = Parser::default();
    let mut requests = Vec::new();
    for happened in story {
        let Happened::Wrote(bytes) = happened else {
            continue;
        };
        let mut rest = &bytes[..];
        while let Some(packet) = parser.next(&mut rest) {
            requests.push(packet.bytes().to_vec());
        }
    }
    assert_eq!(parser.skipped(), 0, "a driver writes packets");
    requests
}

/// Whether these bytes begin with a packet of the cycles, and not of one register.
pub fn is_cyclic(bytes: &[u8]) -> bool {
    bytes.get(4) == Some(&Instruction::LOW_LATENCY.0)
}

/// Address and value of a request that writes a register.
pub fn written(request: &[u8]) -> Option<(u8, u16)> {
    let packet = Packet::new(request).unwrap();
    match *packet.payload() {
        [address, low, high] if packet.code() == Instruction::SET.0 => {
            Some((address, u16::from_le_bytes([low, high])))
        }
        _ => None,
    }
}

/// Address of a request that reads a register.
pub fn read(request: &[u8]) -> Option<u8> {
    let packet = Packet::new(request).unwrap();
    match *packet.payload() {
        [address] if packet.code() == Instruction::GET.0 => Some(address),
        _ => None,
    }
}

/// ASSUMED of the boards: the registers with the modes of their motors, and two modes.
pub const MODES: [u8; 2] = [0x10, 0x20];
pub const COAST: u16 = 0;
pub const CALIBRATE: u16 = 1;
