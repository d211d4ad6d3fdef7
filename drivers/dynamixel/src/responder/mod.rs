use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_wire::Piece;

use crate::codes::{ErrorNumber, Instruction};
use crate::parser::{Parser, Received};
use crate::protocol::{Packet, ProtocolVersion, Status};
use crate::registers::Registers;
use crate::request::{Kept, Request, Span, bulk_of_servo, of_servo};
use crate::table::{Errors, ReturnDelay, ServoModel};

mod turn;
mod turns;

use turn::{After, Turn};

/// Silence after which the beginning of a packet is forgotten, of protocol 1.0 (manual of AX-12A,
/// "byte to byte time").
const SILENCE_ONE: SimDuration = SimDuration::from_millis(100);
/// The same of protocol 2.0, and silence after which a servo no longer waits for the answer of the
/// one before it. ASSUMED: longer than a frame of USB and than the greatest return delay.
const SILENCE: SimDuration = SimDuration::from_millis(5);
/// Unit of the return delay time.
const RETURN_DELAY_UNIT: SimDuration = SimDuration::from_micros(2);
/// Pause between the answers of two successive identifiers to a ping to all, beside the answer
/// itself. The vendor's library waits for so long for each (`dynamixel_sdk` 4.1, `broadcastPing`).
/// ASSUMED.
const PING_PAUSE: SimDuration = SimDuration::from_millis(3);
/// Bytes of the answer to a ping.
const PING_BYTES: u64 = 14;

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
    parser: Parser,
    byte_time: SimDuration,
    /// Time of the last received byte.
    heard: Option<SimTime>,
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
    data: Vec<u8>,
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

#[derive(Serialize, Deserialize)]
struct Saved {
    registers: Snapshot,
    parser: Parser,
    heard: Option<SimTime>,
    registered: Option<(u16, Vec<u8>)>,
    turn: Option<Turn>,
    common: Vec<u8>,
    slot: Option<SimTime>,
    clears_turns: bool,
    restarts: bool,
    pending: VecDeque<(SimTime, usize)>,
    bytes: Vec<u8>,
    transmitted: SimTime,
    counters: ResponderCounters,
}

impl Responder {
    /// Creates the side of a servo with this identifier on a bus where a byte takes `byte_time`.
    pub fn new(model: &'static ServoModel, id: u8, byte_time: SimDuration) -> Self {
        let mut registers = Registers::new(model);
        registers.set(model.roles.id, id.into());
        Self {
            parser: Parser::new(model.protocol),
            registers,
            byte_time,
            heard: None,
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
        self.counters
    }

    /// Returns the number of bytes outside packets.
    pub fn skipped(&self) -> u64 {
        self.parser.skipped()
    }

    /// Returns whether an instruction has cleared the turns since the last call, for the firmware.
    pub fn take_cleared_turns(&mut self) -> bool {
        std::mem::take(&mut self.clears_turns)
    }

    /// Returns whether the servo has restarted since the last call, for the firmware.
    pub fn take_restart(&mut self) -> bool {
        std::mem::take(&mut self.restarts)
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
            self.counters.framing_errors += piece.bytes.len() as u64;
            return;
        }
        let silence = self
            .heard
            .and_then(|heard| piece.first.checked_since(heard));
        let silence = silence.unwrap_or(SimDuration::ZERO);
        if silence > SILENCE {
            self.turn = None;
        }
        let forgotten = match self.protocol() {
            ProtocolVersion::One => SILENCE_ONE,
            ProtocolVersion::Two => SILENCE,
        };
        if silence > forgotten {
            self.parser.reset();
        }
        self.heard = Some(piece.last());
        if let Some(Turn {
            after: After::Bytes(..),
            ..
        }) = &self.turn
        {
            self.common.extend_from_slice(piece.bytes);
        }
        self.parser.push(piece.bytes);
    }

    /// Returns the minimum number of further bytes before it can react.
    pub fn missing(&self) -> usize {
        let of_answer = match &self.turn {
            Some(Turn {
                after: After::Bytes(count, _),
                ..
            }) => count.saturating_sub(self.common.len()).max(1),
            _ => usize::MAX,
        };
        self.parser.missing().min(of_answer)
    }

    /// Handles the packets that are complete at `now`.
    pub fn handle(&mut self, now: SimTime) {
        if let Some(slot) = self.slot.filter(|slot| *slot <= now) {
            self.slot = None;
            self.answer_ping(slot, false);
        }
        self.continue_fast(now);
        // The parser is moved out while its packets are handled.
        let empty = Parser::new(self.protocol());
        let mut parser = std::mem::replace(&mut self.parser, empty);
        while let Some(received) = parser.next_packet() {
            match received {
                Received::Packet(packet) => self.handle_packet(now, &packet),
                Received::Damaged { id } => self.handle_damaged(now, id),
            }
        }
        self.parser = parser;
    }

    fn handle_damaged(&mut self, now: SimTime, id: u8) {
        let own = id == self.id();
        self.counters.damaged += u64::from(own || id == ProtocolVersion::BROADCAST);
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
            (self.turn, self.slot) = (None, None);
            let to_all = packet.id == ProtocolVersion::BROADCAST;
            self.counters.instructions += 1;
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
            self.turn = None;
        } else if let Some(turn) = &self.turn
            && turn.after == After::Answer(packet.id)
        {
            let span = turn.span();
            self.turn = None;
            self.answer_read(now, span);
        }
    }

    fn execute(&mut self, now: SimTime, request: Request<'_>, to_all: bool) {
        let id = self.id();
        match request {
            Request::Ping => self.answer_ping(now, to_all),
            Request::Read(span) if !to_all => self.answer_read(now, span),
            Request::Read(_) => {}
            Request::Write { address, data } => {
                let written = self.registers.write(address, data);
                self.confirm(now, written, to_all);
            }
            Request::RegWrite { address, data } => {
                // Refused at once, as far as it can be known.
                let written = self.registers.clone().write(address, data);
                if written.is_ok() {
                    self.registered = Some((address, data.to_vec()));
                    self.set_registered(1);
                }
                self.confirm(now, written, to_all);
            }
            Request::Action => {
                let written = match self.registered.take() {
                    Some((address, data)) => self.registers.write(address, &data),
                    None => Err(ErrorNumber::INSTRUCTION),
                };
                self.set_registered(0);
                self.confirm(now, written, to_all);
            }
            Request::FactoryReset(kept) => {
                // All servos would have the same identifier afterwards.
                let refused = to_all && kept == Kept::Nothing;
                self.confirm(now, Ok(()), to_all);
                if !refused {
                    self.registers.factory_reset(kept);
                    self.registered = None;
                    self.restarts = true;
                }
            }
            Request::Reboot => {
                self.confirm(now, Ok(()), to_all);
                self.registers.restart();
                self.registered = None;
                self.restarts = true;
            }
            Request::ClearTurns => {
                let moving = self.registers.get(self.registers.model().roles.moving) != 0;
                self.clears_turns |= !moving;
                let done = if moving {
                    Err(ErrorNumber::RESULT_FAIL)
                } else {
                    Ok(())
                };
                self.confirm(now, done, to_all);
            }
            Request::SyncRead { span, ids } => {
                let reads = ids.iter().map(|id| (*id, span));
                self.read_in_turn(now, reads);
            }
            Request::BulkRead(reads) => self.read_in_turn(now, reads.iter()),
            Request::FastSyncRead { span, ids } => {
                let reads = ids.iter().map(|id| (*id, span));
                self.read_fast(now, reads);
            }
            Request::FastBulkRead(reads) => self.read_fast(now, reads.iter()),
            Request::SyncWrite { span, data } => {
                if let Some(bytes) = of_servo(span, data, id) {
                    let written = self.registers.write(span.address, bytes);
                    self.confirm(now, written, true);
                }
            }
            Request::BulkWrite(data) => {
                if let Some((address, bytes)) = bulk_of_servo(data, id) {
                    let written = self.registers.write(address, bytes);
                    self.confirm(now, written, true);
                }
            }
        }
    }

    fn set_registered(&mut self, value: i32) {
        if let Some(address) = self.registers.model().roles.registered {
            self.registers.set(address, value);
        }
    }

    /// Answers a ping: at once, or in the slot of this identifier.
    fn answer_ping(&mut self, now: SimTime, to_all: bool) {
        if to_all {
            let slot = (self.byte_time * PING_BYTES + PING_PAUSE) * u64::from(self.id());
            self.slot = Some(now + slot);
            return;
        }
        let roles = self.registers.model().roles;
        self.data.clear();
        if self.protocol() == ProtocolVersion::Two {
            for (address, length) in [(roles.model, 2), (roles.firmware, 1)] {
                // Both are in the table.
                let span = Span { address, length };
                let _ = self.registers.read(span, &mut self.data);
            }
        }
        self.transmit(now, ErrorNumber::OK);
    }

    /// Returns the time of the next call of [`Responder::handle`] that is required without bytes.
    pub fn next_wake(&self) -> Option<SimTime> {
        self.slot
    }

    fn answer_read(&mut self, now: SimTime, span: Span) {
        self.data.clear();
        match self.registers.read(span, &mut self.data) {
            Ok(()) => self.answer_data(now, ErrorNumber::OK),
            Err(error) => {
                self.counters.refused += 1;
                self.data.clear();
                if self.reports_refusals() {
                    self.answer_data(now, error);
                }
            }
        }
    }

    /// Answers an instruction to read.
    fn answer_data(&mut self, now: SimTime, error: ErrorNumber) {
        if self.answers_reads() {
            self.transmit(now, error);
        }
    }

    /// Answers an instruction without data.
    fn confirm(&mut self, now: SimTime, done: Result<(), ErrorNumber>, to_all: bool) {
        match done {
            Ok(()) => self.answer(now, ErrorNumber::OK, to_all),
            Err(error) => self.refuse(now, error, to_all),
        }
    }

    fn refuse(&mut self, now: SimTime, error: ErrorNumber, to_all: bool) {
        self.counters.refused += 1;
        if self.reports_refusals() {
            self.answer(now, error, to_all);
        }
    }

    /// Whether answers have errors of instructions. A servo without does not answer what it does
    /// not execute. ASSUMED.
    fn reports_refusals(&self) -> bool {
        self.registers.model().errors != Errors::Hardware
    }

    fn answer(&mut self, now: SimTime, error: ErrorNumber, to_all: bool) {
        if !to_all && self.answers_all() {
            self.data.clear();
            self.transmit(now, error);
        }
    }

    fn status_level(&self) -> i32 {
        let roles = &self.registers.model().roles;
        self.registers.get(roles.status_level) + roles.status_offset
    }

    fn answers_reads(&self) -> bool {
        self.status_level() >= 1
    }

    fn answers_all(&self) -> bool {
        self.status_level() >= 2
    }

    fn return_delay(&self) -> SimDuration {
        match self.registers.model().roles.return_delay {
            ReturnDelay::Fixed(delay) => delay,
            ReturnDelay::Register(address) => {
                let units = self.registers.get(address);
                RETURN_DELAY_UNIT * u64::try_from(units).unwrap_or_default()
            }
        }
    }

    fn error_byte(&self, error: ErrorNumber) -> u8 {
        let model = self.registers.model();
        let hardware = model.roles.hardware_error;
        let [hardware, ..] = hardware
            .map_or(0, |address| self.registers.get(address))
            .to_le_bytes();
        model.errors.byte(error, hardware)
    }

    /// Transmits `data` with an error, after the return delay.
    fn transmit(&mut self, now: SimTime, error: ErrorNumber) {
        let before = self.bytes.len();
        let status = Status {
            id: self.id(),
            error: self.error_byte(error),
            data: &self.data,
        };
        let protocol = self.protocol();
        // An answer is shorter than the longest packet: the table is.
        if protocol.encode_status(&status, &mut self.bytes).is_ok() {
            self.queue(now + self.return_delay(), before);
        }
    }

    /// Queues the bytes from `first` on for transmission from `start` on, or after the one before.
    fn queue(&mut self, start: SimTime, first: usize) {
        let start = start.max(self.transmitted);
        let length = self.bytes.len() - first;
        self.transmitted = start + self.byte_time * length as u64;
        self.pending.push_back((start, length));
        self.counters.answers += 1;
    }

    /// Appends the next transmission to `bytes` and returns its start.
    pub fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, length) = self.pending.pop_front()?;
        // A snapshot of another servo must not make this panic.
        let length = length.min(self.bytes.len());
        bytes.extend(self.bytes.drain(..length));
        Some(start)
    }

    /// Saves the state.
    pub fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            registers: self.registers.save(),
            parser: self.parser.clone(),
            heard: self.heard,
            registered: self.registered.clone(),
            turn: self.turn.clone(),
            common: self.common.clone(),
            slot: self.slot,
            clears_turns: self.clears_turns,
            restarts: self.restarts,
            pending: self.pending.clone(),
            bytes: self.bytes.clone(),
            transmitted: self.transmitted,
            counters: self.counters,
        })
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is of another model.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        self.registers.restore(&saved.registers)?;
        self.parser = saved.parser;
        (self.heard, self.registered) = (saved.heard, saved.registered);
        (self.turn, self.common) = (saved.turn, saved.common);
        (self.pending, self.bytes) = (saved.pending, saved.bytes);
        self.transmitted = saved.transmitted;
        self.slot = saved.slot;
        (self.clears_turns, self.restarts) = (saved.clears_turns, saved.restarts);
        self.counters = saved.counters;
        Ok(())
    }
}
