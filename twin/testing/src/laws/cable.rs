use std::collections::VecDeque;

use twinrig_kernel::{SimDuration, SimTime};

use super::damage::{Damage, DamageKind};

/// One direction of the cable between a driver and its wire, which damages bytes.
#[derive(Clone, Debug)]
pub(super) struct Cable {
    damages: VecDeque<Damage>,
    /// Whether damages are applied.
    pub(super) is_damaged: bool,
    /// Least number of intact bytes between two damages.
    spacing: usize,
    period: SimDuration,
    /// Intact bytes since the last damage.
    intact: usize,
    /// Bytes that are still to be lost.
    losing: u8,
    /// Frame to come before the next transmission.
    frame: Option<u8>,
    /// Bytes on their way, with the times of their arrival.
    transit: VecDeque<(SimTime, u8)>,
    /// Number of bytes that have entered.
    pub(super) entered: u64,
    /// Bytes that have left, in order.
    pub(super) passed: Vec<u8>,
    /// Number of bytes with wrong bits.
    pub(super) wrong: u64,
}

impl Cable {
    pub(super) fn new(
        damages: impl IntoIterator<Item = Damage>,
        (spacing, period): (usize, SimDuration),
    ) -> Self {
        Self {
            damages: damages.into_iter().collect(),
            is_damaged: false,
            spacing,
            period,
            intact: 0,
            losing: 0,
            frame: None,
            transit: VecDeque::new(),
            entered: 0,
            passed: Vec::new(),
            wrong: 0,
        }
    }

    /// Time of the next arrival.
    pub(super) fn next(&self) -> Option<SimTime> {
        self.transit.front().map(|(at, _)| *at)
    }

    /// Passes bytes that enter now; `frame` returns the frame of a number that is to be inserted
    /// before a byte, if a transmission begins with that.
    pub(super) fn pass(
        &mut self,
        now: SimTime,
        bytes: &[u8],
        frame: impl Fn(u8, u64) -> Option<Vec<u8>>,
    ) {
        for &byte in bytes {
            let inserted = self.frame.filter(|_| self.is_damaged);
            if let Some(frame) = inserted.and_then(|number| frame(number, self.entered)) {
                self.frame = None;
                self.push(now, &frame);
            }
            self.pass_byte(now, byte);
            self.entered += 1;
        }
    }

    fn pass_byte(&mut self, now: SimTime, byte: u8) {
        if self.losing > 0 && self.is_damaged {
            self.losing -= 1;
            return;
        }
        let Some(damage) = self.next_damage() else {
            self.intact += 1;
            return self.push(now, &[byte]);
        };
        self.intact = 0;
        match damage.kind {
            DamageKind::WrongBit(bit) => {
                self.wrong += 1;
                self.push(now, &[byte ^ (1 << (bit % 8))]);
            }
            DamageKind::Loss(count) => {
                self.losing = count.saturating_sub(1);
            }
            DamageKind::DoubleByte => self.push(now, &[byte; 2]),
            DamageKind::Insertion(more) => self.push(now, &[more, byte]),
            DamageKind::Delay(permille) => {
                let delay = SimDuration::from_nanos(self.period.as_nanos() / 1000);
                self.push(now + delay * u64::from(permille), &[byte]);
            }
            DamageKind::Frame(number) => {
                self.frame = Some(number);
                self.push(now, &[byte]);
            }
        }
    }

    /// Returns the damage to the next byte.
    fn next_damage(&mut self) -> Option<Damage> {
        let next = self.damages.front().filter(|_| self.is_damaged)?;
        if self.intact < usize::from(next.after) + self.spacing {
            return None;
        }
        self.damages.pop_front()
    }

    /// Appends bytes; none overtakes another.
    fn push(&mut self, at: SimTime, bytes: &[u8]) {
        let at = self.transit.back().map_or(at, |(last, _)| at.max(*last));
        self.transit.extend(bytes.iter().map(|byte| (at, *byte)));
    }

    /// Moves the bytes that have arrived by now to the end of `bytes`.
    pub(super) fn take(&mut self, now: SimTime, bytes: &mut Vec<u8>) {
        let arrived = self.transit.partition_point(|(at, _)| *at <= now);
        let arrived = self.transit.drain(..arrived).map(|(_, byte)| byte);
        let before = bytes.len();
        bytes.extend(arrived);
        self.passed.extend(&bytes[before..]);
    }
}
