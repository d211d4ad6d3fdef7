//! Servos on a line, which all hear each other.

use twinrig_dynamixel::{ProtocolVersion, Request, Responder, x};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

/// 1 Mbit/s.
pub const BYTE_TIME: SimDuration = SimDuration::from_micros(10);

/// Creates a servo that answers at once, with some values of its registers.
pub fn servo_with(id: u8, values: impl IntoIterator<Item = (u16, i32)>) -> Responder {
    let mut servo = Responder::new(x::XL330_M288.model, id, BYTE_TIME);
    servo.registers_mut().set(9, 0);
    for (address, value) in values {
        servo.registers_mut().set(address, value);
    }
    servo
}

/// Returns bytes whose first bit is at `start`, without a pause.
pub fn piece(start: SimTime, bytes: &[u8]) -> Piece<'_> {
    Piece {
        first: start + BYTE_TIME,
        spacing: BYTE_TIME,
        bytes,
        framing_error: false,
    }
}

/// Servos on a line, which all hear each other.
pub struct Line {
    pub servos: Vec<Responder>,
    /// Start of the next transmission of the host: 10 ms after the last byte.
    pub now: SimTime,
}

impl Line {
    pub fn new(servos: impl IntoIterator<Item = Responder>) -> Self {
        Self {
            servos: servos.into_iter().collect(),
            now: SimTime::ZERO,
        }
    }

    /// Passes bytes to all servos, and what each transmits to the others, until the line is silent.
    /// Returns the transmissions with their starts.
    pub fn send(&mut self, bytes: &[u8]) -> Vec<(SimTime, Vec<u8>)> {
        let mut sent: Vec<(SimTime, Vec<u8>)> = Vec::new();
        let mut waiting = vec![(self.now, None, bytes.to_vec())];
        loop {
            let next = waiting.iter().map(|it| it.0).min();
            let wake = self.servos.iter().filter_map(Responder::next_wake).min();
            match (next, wake) {
                (None, None) => return sent,
                (next, Some(wake)) if next.is_none_or(|next| wake < next) => {
                    for (index, servo) in self.servos.iter_mut().enumerate() {
                        servo.handle(wake);
                        take(index, servo, &mut waiting);
                    }
                    continue;
                }
                _ => {}
            }
            let first = waiting.iter().position(|it| Some(it.0) == next).unwrap();
            let (start, of, bytes) = waiting.remove(first);
            let piece = piece(start, &bytes);
            self.now = piece.last() + SimDuration::from_millis(10);
            for (index, servo) in self.servos.iter_mut().enumerate() {
                if of != Some(index) {
                    servo.receive(piece);
                    servo.handle(piece.last());
                    take(index, servo, &mut waiting);
                }
            }
            if of.is_some() {
                sent.push((start, bytes));
            }
        }
    }

    /// Returns the transmissions after a request, without their times.
    pub fn packets(&mut self, request: Request<'_>, id: u8) -> Vec<Vec<u8>> {
        let mut bytes = Vec::new();
        request
            .encode(ProtocolVersion::Two, id, &mut bytes)
            .unwrap();
        self.send(&bytes)
            .into_iter()
            .map(|(_, bytes)| bytes)
            .collect()
    }
}

/// Transmission with its start and the servo, if it is of one.
type Transmission = (SimTime, Option<usize>, Vec<u8>);

/// Takes the transmissions of a servo.
fn take(index: usize, servo: &mut Responder, waiting: &mut Vec<Transmission>) {
    let mut answer = Vec::new();
    while let Some(start) = servo.poll_transmit(&mut answer) {
        waiting.push((start, Some(index), std::mem::take(&mut answer)));
    }
}
