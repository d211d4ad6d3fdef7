//! Events and bus traffic of a run, from its recording.

use mcap::MessageStream;
use twinrig_record::{EventMessage, Recording};
use twinrig_sbcp::codes::Instruction;
use twinrig_sbcp::{Packet, Parser};

/// Event of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum TraceEvent {
    /// Missed control step.
    Missed,
    /// Busy bus at the start of an iteration.
    Skipped,
    /// Commands at the end of an iteration.
    Commanded(Vec<u8>),
    /// Bytes written to the bus.
    Wrote(Vec<u8>),
}

/// Returns the events of the recording at `path`, in their order.
pub fn trace_of(path: &str) -> Vec<TraceEvent> {
    /// Length of the message header and of the length field of the bytes.
    const HEADER: usize = 4 + 4;
    let bytes = std::fs::read(path).unwrap();
    let recording = Recording::from_bytes(bytes.clone()).unwrap();
    let mut events = recording.messages::<EventMessage>().unwrap().into_iter();
    let messages = MessageStream::new(&bytes).unwrap();
    messages
        .filter_map(|message| {
            let message = message.unwrap();
            match message.channel.topic.as_str() {
                "/process_outputs" => Some(TraceEvent::Commanded(message.data.into())),
                "/wire/sbcp/out" => Some(TraceEvent::Wrote(message.data[HEADER..].into())),
                "/diagnostics" => event_of(&events.next().unwrap().1),
                _ => None,
            }
        })
        .collect()
}

fn event_of(message: &EventMessage) -> Option<TraceEvent> {
    match message.event.as_str() {
        "overrun" => Some(TraceEvent::Missed),
        "task skipped" => {
            assert_eq!(message.part.as_deref(), Some("sbcp"));
            Some(TraceEvent::Skipped)
        }
        _ => None,
    }
}

/// Returns all requests written to the bus.
pub fn requests(trace: &[TraceEvent]) -> Vec<Vec<u8>> {
    let mut parser = Parser::default();
    let mut requests = Vec::new();
    for event in trace {
        let TraceEvent::Wrote(bytes) = event else {
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

/// Returns whether the bytes begin with a packet of a control cycle, not of a register access.
pub fn is_cyclic(bytes: &[u8]) -> bool {
    bytes.get(4) == Some(&Instruction::LOW_LATENCY.0)
}

/// Returns address and value of a request that writes a register.
pub fn written(request: &[u8]) -> Option<(u8, u16)> {
    let packet = Packet::new(request).unwrap();
    match *packet.payload() {
        [address, low, high] if packet.code() == Instruction::SET.0 => {
            Some((address, u16::from_le_bytes([low, high])))
        }
        _ => None,
    }
}

/// Returns the address of a request that reads a register.
pub fn read(request: &[u8]) -> Option<u8> {
    let packet = Packet::new(request).unwrap();
    match *packet.payload() {
        [address] if packet.code() == Instruction::GET.0 => Some(address),
        _ => None,
    }
}

/// Registers of the motor modes of the boards, and two modes. ASSUMED.
pub const MODES: [u8; 2] = [0x10, 0x20];
pub const COAST: u16 = 0;
pub const CALIBRATE: u16 = 1;
