use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_wire::{Addresses, Piece};

use crate::codes::{ErrorNumber, Instruction};
use crate::parser::{Parser, Received};
use crate::protocol::{Packet, ProtocolVersion};
use crate::registers::Registers;
use crate::request::Request;
use crate::table::ServoModel;

mod answers;
mod instructions;
mod turn;
mod turns;

use turn::{After, Turn};

/// Silence after which the beginning of a packet is forgotten, of protocol 1.0 (manual of AX-12A,
/// "byte to byte time").
const SILENCE_ONE: SimDuration = SimDuration::from_millis(100);
/// The same of protocol 2.0, and the time by which the answers of those before may be late until a
/// servo no longer waits for them. ASSUMED: longer than a frame of USB.
const SILENCE: SimDuration = SimDuration::from_millis(5);
/// The side of a servo on the bus: answers instructions by the registers. Bytes and times in, bytes
/// and times out.
///
/// - A packet with a wrong checksum that is addressed to this servo is answered by
///   [`ErrorNumber::CRC`].
/// - Of several servos that one instruction reads, each answers its return delay after the answer
///   of the one before; a servo that does not hear that answer remains silent. ASSUMED.
/// - In a fast read, the parts of one answer follow one another without a pause. ASSUMED.
/// - An instruction is executed as soon as it is received, whatever the return delay.
#[derive(Debug)]
pub struct Responder {
    registers: Registers,
    byte_time: SimDuration,
    state: State,
    /// Data of the next answer.
    data: Vec<u8>,
}

/// State besides the registers.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    parser: Parser,
    /// Time of the last received byte.
    received: Option<SimTime>,
    /// A write that waits for an action.
    registered: Option<(u16, Vec<u8>)>,
    turn: Option<Turn>,
    /// Bytes of a common answer to which this servo adds a part.
    common: Vec<u8>,
    /// Time of the answer to a ping to all, until another instruction comes.
    slot: Option<SimTime>,
    /// Whether turns are to be forgotten, and whether the servo has restarted.
    clears_turns: bool,
    restarts: bool,
    /// Starts and lengths of the transmissions, and all their bytes.
    pending: VecDeque<(SimTime, usize)>,
    bytes: Vec<u8>,
    /// End of the last transmission.
    transmitted: SimTime,
    counters: ResponderCounters,
}

/// Counters of a servo's side of the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResponderCounters {
    /// Instructions received, those to all servos and refused ones included.
    pub instructions: u64,
    /// Answers.
    pub answers: u64,
    /// Instructions refused.
    pub refused: u64,
    /// Packets to this servo, or to all, with a wrong checksum.
    pub damaged: u64,
    /// Bytes with a wrong stop bit.
    pub framing_errors: u64,
}

impl State {
    fn new(protocol: ProtocolVersion) -> Self {
        Self {
            parser: Parser::new(protocol),
            received: None,
            registered: None,
            turn: None,
            common: Vec::new(),
            slot: None,
            clears_turns: false,
            restarts: false,
            pending: VecDeque::new(),
            bytes: Vec::new(),
            transmitted: SimTime::ZERO,
            counters: ResponderCounters::default(),
        }
    }
}

impl Responder {
    /// Creates the side of a servo with this identifier on a bus where a byte takes `byte_time`.
    pub fn new(model: &'static ServoModel, id: u8, byte_time: SimDuration) -> Self {
        let mut registers = Registers::new(model);
        registers.set(model.roles.id, id.into());
        Self {
            registers,
            byte_time,
            state: State::new(model.protocol),
            data: Vec::new(),
        }
    }

    /// Returns the registers.
    pub fn registers(&self) -> &Registers {
        &self.registers
    }

    /// Returns the registers, for the firmware.
    pub fn registers_mut(&mut self) -> &mut Registers {
        &mut self.registers
    }

    /// Returns the counters.
    pub fn counters(&self) -> ResponderCounters {
        self.state.counters
    }

    /// Returns the number of bytes outside packets.
    pub fn skipped(&self) -> u64 {
        self.state.parser.skipped()
    }

    /// Returns whether an instruction has cleared the turns since the last call, for the firmware.
    pub fn take_cleared_turns(&mut self) -> bool {
        std::mem::take(&mut self.state.clears_turns)
    }

    /// Returns whether the servo has restarted since the last call, for the firmware.
    pub fn take_restart(&mut self) -> bool {
        std::mem::take(&mut self.state.restarts)
    }

    /// Cycles the power: registers restart, and received bytes, pending answers and turns are
    /// forgotten; the counters remain.
    pub fn power_cycle(&mut self) {
        self.registers.restart();
        let initial = State::new(self.protocol());
        let before = std::mem::replace(&mut self.state, initial);
        self.state.counters = before.counters;
        self.state.parser = before.parser;
        self.state.parser.reset();
    }

    fn protocol(&self) -> ProtocolVersion {
        self.registers.model().protocol
    }

    fn id(&self) -> u8 {
        let id = self.registers.get(self.registers.model().roles.id);
        // The bounds of the register are those of a byte.
        u8::try_from(id).unwrap_or_default()
    }

    /// Receives bytes of others. Those with a wrong stop bit are dropped.
    pub fn receive(&mut self, piece: Piece<'_>) {
        if piece.framing_error {
            self.state.counters.framing_errors += piece.bytes.len() as u64;
            return;
        }
        let silence = self
            .state
            .received
            .and_then(|received| piece.first.checked_since(received));
        let silence = silence.unwrap_or(SimDuration::ZERO);
        if silence > self.silence() {
            self.state.parser.reset();
        }
        self.state.received = Some(piece.last());
        if let Some(Turn {
            after: After::Bytes(..),
            ..
        }) = &self.state.turn
        {
            self.state.common.extend_from_slice(piece.bytes);
        }
        self.state.parser.push(piece.bytes);
    }

    /// Returns the silence after which the beginning of a packet is forgotten.
    fn silence(&self) -> SimDuration {
        match self.protocol() {
            ProtocolVersion::One => SILENCE_ONE,
            ProtocolVersion::Two => SILENCE,
        }
    }

    /// Returns the addresses of the packets that matter, those of instructions and of answers; none
    /// where bytes matter, or while it may answer at any time: see
    /// `twinrig_wire::Node::listens_to`.
    pub fn listens_to(&self, spacing: SimDuration) -> Option<Addresses> {
        if !self.state.parser.is_empty() || self.state.slot.is_some() || spacing > self.silence() {
            return None;
        }
        let (own, all) = (self.id().into(), ProtocolVersion::BROADCAST.into());
        let before = match &self.state.turn {
            None => return Some(Addresses::one(own).and(all)),
            Some(turn) => match turn.after {
                After::Answer(before) => self.protocol().answer_address(before),
                After::Bytes(..) => return None,
            },
        };
        Some(match self.protocol() {
            ProtocolVersion::One => Addresses::one(own).and(all).and(before),
            // An instruction to another servo ends the turn.
            ProtocolVersion::Two => Addresses::range(0..=u16::from(u8::MAX)).and(before),
        })
    }

    /// Returns the minimum number of further bytes before it can react.
    pub fn missing(&self) -> usize {
        let of_answer = match &self.state.turn {
            Some(Turn {
                after: After::Bytes(count, _),
                ..
            }) => count.saturating_sub(self.state.common.len()).max(1),
            _ => usize::MAX,
        };
        self.state.parser.missing().min(of_answer)
    }

    /// Handles the packets that are complete at `now`.
    pub fn handle(&mut self, now: SimTime) {
        if let Some(slot) = self.state.slot.filter(|slot| *slot <= now) {
            self.state.slot = None;
            self.answer_ping(slot, false);
        }
        self.continue_fast(now);
        // The parser is moved out while its packets are handled.
        let empty = Parser::new(self.protocol());
        let mut parser = std::mem::replace(&mut self.state.parser, empty);
        while let Some(received) = parser.next_packet() {
            match received {
                Received::Packet(packet) => self.handle_packet(now, &packet),
                Received::Damaged { id } => self.handle_damaged(now, id),
            }
        }
        self.state.parser = parser;
    }

    fn handle_damaged(&mut self, now: SimTime, id: u8) {
        let own = id == self.id();
        self.state.counters.damaged += u64::from(own || id == ProtocolVersion::BROADCAST);
        if own && self.reports_refusals() {
            self.answer(now, ErrorNumber::CRC, false);
        }
    }

    fn handle_packet(&mut self, now: SimTime, packet: &Packet<'_>) {
        let protocol = self.protocol();
        if packet.id == self.id() || packet.id == ProtocolVersion::BROADCAST {
            if protocol == ProtocolVersion::Two && packet.code == Instruction::STATUS.0 {
                return;
            }
            (self.state.turn, self.state.slot) = (None, None);
            let to_all = packet.id == ProtocolVersion::BROADCAST;
            self.state.counters.instructions += 1;
            let lacks = self.registers.model().lacks;
            let request = if lacks.contains(&Instruction(packet.code)) {
                Err(ErrorNumber::INSTRUCTION)
            } else {
                Request::decode(protocol, packet)
            };
            match request {
                Ok(request) => self.execute(now, request, to_all),
                Err(error) => self.refuse(now, error, to_all),
            }
            return;
        }
        // Protocol 1.0 does not tell instructions from answers.
        let is_answer = protocol == ProtocolVersion::One || packet.code == Instruction::STATUS.0;
        if !is_answer {
            self.state.turn = None;
        } else if let Some(turn) = &self.state.turn
            && turn.after == After::Answer(packet.id)
        {
            let (span, until) = (turn.span, turn.until);
            self.state.turn = None;
            if now <= until {
                self.answer_read(now, span);
            }
        }
    }

    /// Returns the time of the next call of [`Responder::handle`] that is required without bytes.
    pub fn next_wake(&self) -> Option<SimTime> {
        self.state.slot
    }

    /// Appends the next transmission to `bytes` and returns its start.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, length) = self.state.pending.pop_front()?;
        // A snapshot of another servo must not make this panic.
        let length = length.min(self.state.bytes.len());
        bytes.extend(self.state.bytes.drain(..length));
        Some(start)
    }

    /// Saves the state.
    pub fn save(&self) -> Snapshot {
        Snapshot::of(&(self.registers.save(), &self.state))
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is of another model.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (registers, state): (Snapshot, State) = snapshot.read()?;
        self.registers.restore(&registers)?;
        self.state = state;
        Ok(())
    }
}
