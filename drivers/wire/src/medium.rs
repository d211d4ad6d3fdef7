use std::mem;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

use crate::Piece;

/// Number of the near end among those who talk; nodes follow.
pub(crate) const NEAR: usize = 0;

/// The pair of wires: what is being said on it, and who hears what of it.
///
/// Both levels fought for, low wins: where bytes of several talkers overlap, a hearer's receiver locks onto the one that
/// begins first and samples, in the middle of each of its bits, the AND of all levels. A byte that begins while another is
/// being received is lost, and so is everything to somebody who talks himself.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Medium {
    byte_time: SimDuration,
    turnaround: SimDuration,
    /// In order of their beginning.
    talks: Vec<Transmission>,
    /// For each hearer, when the byte it received last was over.
    busy_until: Vec<SimTime>,
    /// For each talker, when what it said last is over.
    free_at: Vec<SimTime>,
    /// Bytes that met another.
    collisions: u64,
    /// Buffers for the next talks.
    #[serde(skip)]
    spare: Vec<Vec<u8>>,
}

/// What one talker says in one go.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Transmission {
    by: usize,
    /// When the first byte is complete.
    first: SimTime,
    spacing: SimDuration,
    bytes: Vec<u8>,
    /// Whether their stop bits are wrong.
    framing_error: bool,
    /// How many of them have been heard, by the near end at least.
    done: usize,
    /// How many of them the nodes have been told.
    told: usize,
}

impl Transmission {
    fn at(&self, index: usize) -> SimTime {
        self.first + self.spacing * index as u64
    }

    fn end(&self) -> SimTime {
        self.at(self.bytes.len() - 1)
    }

    fn piece(&self, range: Range<usize>) -> Piece<'_> {
        Piece {
            first: self.at(range.start),
            spacing: self.spacing,
            bytes: &self.bytes[range],
            framing_error: self.framing_error,
        }
    }

    /// Whether a byte is complete that was not heard yet.
    fn goes_on_by(&self, now: SimTime) -> bool {
        self.done < self.bytes.len() && self.at(self.done) <= now
    }

    /// How many bytes are complete.
    fn complete(&self, now: SimTime) -> usize {
        if !self.goes_on_by(now) {
            return self.done;
        }
        match now.checked_since(self.first) {
            None => 0,
            Some(since) if now < self.end() => {
                usize::try_from(since.as_nanos() / self.spacing.as_nanos())
                    .map_or(self.bytes.len(), |spaces| spaces + 1)
            }
            Some(_) => self.bytes.len(),
        }
    }

    /// Whether the line is high at `now`, as far as this talker is concerned: idle, stop bit or a 1.
    fn high(&self, now: SimTime, byte_time: SimDuration) -> bool {
        let Some(since) = (now + byte_time).checked_since(self.first) else {
            return true;
        };
        let index = if self.bytes.len() == 1 {
            0
        } else {
            since.as_nanos() / self.spacing.as_nanos()
        };
        let within = since - self.spacing * index;
        let byte = usize::try_from(index).ok().and_then(|n| self.bytes.get(n));
        match (byte, within.as_nanos() * 10 / byte_time.as_nanos()) {
            (Some(_), 0) => false,
            (Some(byte), bit @ 1..=8) => byte >> (bit - 1) & 1 == 1,
            _ => true,
        }
    }
}

impl Medium {
    pub(crate) fn new(byte_time: SimDuration, turnaround: SimDuration, nodes: usize) -> Self {
        Self {
            byte_time,
            turnaround,
            talks: Vec::new(),
            busy_until: vec![SimTime::ZERO; nodes + 1],
            free_at: vec![SimTime::ZERO; nodes + 1],
            collisions: 0,
            spare: Vec::new(),
        }
    }

    /// How many talkers there are.
    pub(crate) fn talkers(&self) -> usize {
        self.free_at.len()
    }

    pub(crate) fn byte_time(&self) -> SimDuration {
        self.byte_time
    }

    pub(crate) fn collisions(&self) -> u64 {
        self.collisions
    }

    /// Someone says something. A byte takes the bus's time, whatever pace was asked for, and begins when the
    /// talker has said the one before.
    pub(crate) fn say(&mut self, by: usize, piece: Piece<'_>) {
        if piece.bytes.is_empty() {
            return;
        }
        let first = piece.first.max(self.free_at[by] + self.byte_time);
        let mut bytes = self.spare.pop().unwrap_or_default();
        bytes.extend_from_slice(piece.bytes);
        let talk = Transmission {
            by,
            first,
            spacing: piece.spacing.max(self.byte_time),
            bytes,
            framing_error: piece.framing_error,
            done: 0,
            told: 0,
        };
        self.free_at[by] = talk.end();
        let place = self.talks.partition_point(|other| other.first <= first);
        self.talks.insert(place, talk);
    }

    /// When somebody may be glad to hear: the near end the first byte of what a node says, everybody the last
    /// one of anything, and a node that byte which it pays attention to.
    pub(crate) fn next_wake(&self, attention: Option<usize>) -> Option<SimTime> {
        let mut wake: Option<SimTime> = None;
        for talk in &self.talks {
            if talk.done == talk.bytes.len() {
                continue;
            }
            let mut place = talk.bytes.len() - 1;
            if talk.by != NEAR && talk.done == 0 {
                place = 0;
            }
            if let Some(count) = attention {
                place = place.min(talk.done + count.max(1) - 1);
            }
            let at = talk.at(place);
            wake = Some(wake.map_or(at, |wake| wake.min(at)));
        }
        wake
    }

    /// Lets everybody hear what is complete by `now`. Nodes are told the words of a talker when he has said all of them,
    /// unless they are `eager`: what they hear is the same. Says whether there was anything to be heard.
    pub(crate) fn receive(
        &mut self,
        now: SimTime,
        eager: bool,
        mut heard: impl FnMut(usize, Piece<'_>),
    ) -> bool {
        if !self.talks.iter().any(|talk| talk.goes_on_by(now)) {
            return false;
        }
        if self.meets(now) {
            self.tell(true, &mut heard);
            while let Some(index) = self.next_complete(now) {
                self.hear_byte(index, &mut heard);
            }
        } else {
            self.hear_pieces(now, &mut heard);
            self.tell(eager, &mut heard);
        }
        self.forget(now);
        true
    }

    /// Whether any byte that becomes complete by `now` meets another talker's, or ears that are shut.
    fn meets(&self, now: SimTime) -> bool {
        self.talks.len() > 1
            && self.talks.iter().any(|talk| {
                let (done, complete) = (talk.done, talk.complete(now));
                done < complete && self.talked_over(talk.by, talk.at(done), talk.at(complete - 1))
            })
    }

    /// Whether anybody but `by` holds the wires while bytes are passing of which the first is complete at `first`,
    /// the last at `last`.
    fn talked_over(&self, by: usize, first: SimTime, last: SimTime) -> bool {
        self.talks.iter().any(|other| {
            other.by != by
                && other.first < last + self.byte_time
                && first < self.released(other) + self.byte_time
        })
    }

    /// When the talker hears again.
    fn released(&self, talk: &Transmission) -> SimTime {
        if talk.by == NEAR {
            talk.end() + self.turnaround
        } else {
            talk.end()
        }
    }

    /// The common case: nobody talks into anybody's words. The near end hears them as they come.
    fn hear_pieces(&mut self, now: SimTime, heard: &mut impl FnMut(usize, Piece<'_>)) {
        for talk in &mut self.talks {
            let complete = talk.complete(now);
            if complete == talk.done {
                continue;
            }
            if talk.by != NEAR {
                let piece = talk.piece(talk.done..complete);
                self.busy_until[NEAR] = piece.last();
                heard(NEAR, piece);
            }
            talk.done = complete;
        }
    }

    /// Tells the nodes what has been heard: only what is over, unless they are `eager`.
    fn tell(&mut self, eager: bool, heard: &mut impl FnMut(usize, Piece<'_>)) {
        for talk in &mut self.talks {
            if talk.told == talk.done || !(eager || talk.done == talk.bytes.len()) {
                continue;
            }
            let piece = talk.piece(talk.told..talk.done);
            let last = piece.last();
            for hearer in (NEAR + 1..self.busy_until.len()).filter(|hearer| *hearer != talk.by) {
                self.busy_until[hearer] = last;
                heard(hearer, piece);
            }
            talk.told = talk.done;
        }
    }

    /// The talk whose next byte is complete first, if that is by `now`.
    fn next_complete(&self, now: SimTime) -> Option<usize> {
        let open = (0..self.talks.len()).filter(|index| {
            let talk = &self.talks[*index];
            talk.done < talk.bytes.len() && talk.at(talk.done) <= now
        });
        open.min_by_key(|index| {
            let talk = &self.talks[*index];
            (talk.at(talk.done), talk.by)
        })
    }

    fn hear_byte(&mut self, index: usize, heard: &mut impl FnMut(usize, Piece<'_>)) {
        let talk = &mut self.talks[index];
        let (by, at, framing_error) = (talk.by, talk.at(talk.done), talk.framing_error);
        talk.done += 1;
        talk.told = talk.done;
        let met = self.talks.iter().any(|other| {
            other.by != by && other.first < at + self.byte_time && at < other.end() + self.byte_time
        });
        self.collisions += u64::from(met);
        let byte = self.sampled(at);
        for hearer in (0..self.busy_until.len()).filter(|hearer| *hearer != by) {
            let shut = self.talks.iter().any(|own| {
                own.by == hearer
                    && own.first < at + self.byte_time
                    && at < self.released(own) + self.byte_time
            });
            if !shut && at >= self.busy_until[hearer] + self.byte_time {
                self.busy_until[hearer] = at;
                let piece = Piece {
                    first: at,
                    spacing: self.byte_time,
                    bytes: &[byte],
                    framing_error,
                };
                heard(hearer, piece);
            }
        }
    }

    /// What a receiver makes of the byte that is complete at `at`.
    fn sampled(&self, at: SimTime) -> u8 {
        (0..8).fold(0, |byte, bit| {
            // Bit 0 follows the start bit: its middle is three twentieths of the byte's time in, seventeen from its end.
            let before_end = self.byte_time * (17 - 2 * bit) / 20;
            let middle = SimTime::ZERO + (at.since_start() - before_end);
            let high = |talk: &Transmission| talk.high(middle, self.byte_time);
            byte | u8::from(self.talks.iter().all(high)) << bit
        })
    }

    /// Lets go of what can meet nothing any more.
    fn forget(&mut self, now: SimTime) {
        let (byte_time, turnaround) = (self.byte_time, self.turnaround);
        let spare = &mut self.spare;
        self.talks.retain_mut(|talk| {
            let keep = talk.done < talk.bytes.len() || now < talk.end() + turnaround + byte_time;
            if !keep {
                talk.bytes.clear();
                spare.push(mem::take(&mut talk.bytes));
            }
            keep
        });
    }
}
