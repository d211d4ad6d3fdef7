//! Answers to reads of several servos, each of which waits for the one before it.

use twinrig_kernel::SimTime;

use super::answers::RETURN_DELAY_MAX;
use super::turn::{After, Turn};
use super::{Responder, SILENCE};
use crate::codes::ErrorNumber;
use crate::fast::{FastAnswer, append_fast_part, is_beginning_of_fast_answer};
use crate::protocol::Status;
use crate::request::Span;

impl Responder {
    /// Takes part in the answers to a read of several servos.
    pub(super) fn read_in_turn(&mut self, now: SimTime, reads: impl Iterator<Item = (u8, Span)>) {
        let id = self.id();
        let (mut before, mut until) = (None, now + SILENCE);
        for (of, span) in reads {
            if of == id {
                match before {
                    None => self.answer_read(now, span),
                    Some(before) => {
                        self.state.turn = Some(Turn {
                            span,
                            after: After::Answer(before),
                            until,
                        });
                    }
                }
                return;
            }
            before = Some(of);
            let length = self.protocol().answer_max(span.length.into());
            until += RETURN_DELAY_MAX + self.byte_time * length as u64;
        }
    }

    /// Takes part in the common answer to a fast read.
    pub(super) fn read_fast(&mut self, now: SimTime, reads: impl Iterator<Item = (u8, Span)>) {
        let id = self.id();
        let (mut answer, mut own) = (FastAnswer::default(), None);
        for (of, span) in reads {
            if of == id && own.is_none() {
                own = Some((span, answer));
            }
            answer.servos += 1;
            answer.data += usize::from(span.length);
        }
        match own {
            None => {}
            Some(_) if answer.length() > self.protocol().packet_max() || !self.answers_reads() => {}
            Some((span, FastAnswer { servos: 0, .. })) => {
                let start = now + self.return_delay();
                self.answer_fast(start, Some(answer), &[], span);
            }
            Some((span, before)) => {
                self.state.common.clear();
                self.state.turn = Some(Turn {
                    span,
                    after: After::Bytes(before.length(), answer.length()),
                    until: now
                        + SILENCE
                        + RETURN_DELAY_MAX
                        + self.byte_time * before.length() as u64,
                });
            }
        }
    }

    /// Continues the common answer to a fast read when the parts before are complete.
    pub(super) fn continue_fast(&mut self, now: SimTime) {
        let Some(turn) = &self.state.turn else { return };
        let After::Bytes(count, all) = turn.after else {
            return;
        };
        // Where other bytes come, there is no answer: they are the next instruction.
        if now > turn.until || !is_beginning_of_fast_answer(&self.state.common, all) {
            self.state.turn = None;
            return;
        }
        if self.state.common.len() < count {
            return;
        }
        let span = turn.span;
        self.state.turn = None;
        let common = std::mem::take(&mut self.state.common);
        self.answer_fast(now, None, &common[..count], span);
        self.state.common = common;
        // The received bytes of this packet lack the own part.
        self.state.parser.reset();
    }

    /// Transmits a part of a common answer from `start` on.
    fn answer_fast(
        &mut self,
        start: SimTime,
        first_of: Option<FastAnswer>,
        before: &[u8],
        span: Span,
    ) {
        self.data.clear();
        let read = self.registers.read(span, &mut self.data);
        // The part has its length in any case. ASSUMED.
        self.data.resize(span.length.into(), 0);
        let status = Status {
            id: self.id(),
            error: self.error_byte(read.err().unwrap_or(ErrorNumber::OK)),
            data: &self.data,
        };
        let length = self.state.bytes.len();
        append_fast_part(first_of, before, &status, &mut self.state.bytes);
        self.queue(start, length);
    }
}
