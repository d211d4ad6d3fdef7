use std::mem;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

use crate::Piece;

/// Index of the near end among the stations; nodes follow.
pub(crate) const NEAR: usize = 0;

/// Shared pair of wires: the transmissions on it and their reception by each station.
///
/// Low is dominant: where bytes of several stations overlap, a receiver locks onto the byte that
/// begins first and samples the AND of all levels in the middle of each of its bits. A byte that
/// begins while another is being received is lost, and a station receives nothing while it
/// transmits.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Medium {
    byte_time: SimDuration,
    turnaround: SimDuration,
    /// In order of their first byte.
    transmissions: Vec<Transmission>,
    /// For each receiver, the completion time of the last byte received.
    busy_until: Vec<SimTime>,
    /// For each transmitter, the end of its last transmission.
    free_at: Vec<SimTime>,
    /// Number of bytes that overlapped one of another station.
    collisions: u64,
    /// Buffers for further transmissions.
    #[serde(skip)]
    spare: Vec<Vec<u8>>,
}

/// Receivers of bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Receivers {
    One(usize),
    /// All nodes but the one that transmits; only those that listen to the address, if the bytes
    /// are a packet.
    Nodes {
        but: usize,
        packet: Option<u16>,
    },
}

/// Bytes on which nodes may react.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Needs {
    /// The minimum number of further bytes: [`crate::Node::min_bytes_needed`].
    pub(crate) bytes: Option<usize>,
    /// Whether nodes receive packets as a whole.
    pub(crate) packets: bool,
}

/// Contiguous transmission of one station.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Transmission {
    station: usize,
    /// Completion time of the first byte.
    first: SimTime,
    spacing: SimDuration,
    bytes: Vec<u8>,
    /// Whether the stop bits are wrong.
    framing_error: bool,
    /// Address, if the bytes are exactly one packet, at the byte time of the bus.
    packet: Option<u16>,
    /// Number of bytes received, at least by the near end.
    received: usize,
    /// Number of bytes delivered to the nodes.
    delivered: usize,
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

    /// Whether a byte is complete that has not been received yet.
    fn has_new_byte(&self, now: SimTime) -> bool {
        self.received < self.bytes.len() && self.at(self.received) <= now
    }

    /// Number of complete bytes.
    fn complete(&self, now: SimTime) -> usize {
        if !self.has_new_byte(now) {
            return self.received;
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

    /// Whether this transmission leaves the line high at `now`: idle, stop bit or a 1.
    fn is_high(&self, now: SimTime, byte_time: SimDuration) -> bool {
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
            transmissions: Vec::new(),
            busy_until: vec![SimTime::ZERO; nodes + 1],
            free_at: vec![SimTime::ZERO; nodes + 1],
            collisions: 0,
            spare: Vec::new(),
        }
    }

    /// Number of stations.
    pub(crate) fn stations(&self) -> usize {
        self.free_at.len()
    }

    pub(crate) fn byte_time(&self) -> SimDuration {
        self.byte_time
    }

    pub(crate) fn collisions(&self) -> u64 {
        self.collisions
    }

    /// Adds a transmission. A byte takes at least the byte time of the bus and begins after the
    /// previous byte of the same station. `packet` is the address, if it is exactly one packet.
    pub(crate) fn transmit(&mut self, station: usize, piece: Piece<'_>, packet: Option<u16>) {
        if piece.bytes.is_empty() {
            return;
        }
        let intact = piece.spacing <= self.byte_time && !piece.framing_error;
        let first = piece.first.max(self.free_at[station] + self.byte_time);
        let mut bytes = self.spare.pop().unwrap_or_default();
        bytes.extend_from_slice(piece.bytes);
        let transmission = Transmission {
            station,
            first,
            spacing: piece.spacing.max(self.byte_time),
            bytes,
            framing_error: piece.framing_error,
            packet: packet.filter(|_| intact),
            received: 0,
            delivered: 0,
        };
        self.free_at[station] = transmission.end();
        let index = self
            .transmissions
            .partition_point(|other| other.first <= first);
        self.transmissions.insert(index, transmission);
    }

    /// Whether no transmission up to now disturbs one that begins at `start`.
    pub(crate) fn is_clear(&self, start: SimTime) -> bool {
        self.transmissions.iter().all(|transmission| {
            transmission.received == transmission.bytes.len()
                && self.receives_from(transmission) <= start
        })
    }

    /// Whether all transmissions are received.
    pub(crate) fn is_idle(&self) -> bool {
        let mut transmissions = self.transmissions.iter();
        transmissions.all(|transmission| transmission.received == transmission.bytes.len())
    }

    /// Whether only the near end transmits, if any station, undisturbed by earlier transmissions.
    pub(crate) fn is_undisturbed(&self) -> bool {
        self.transmissions.iter().all(|transmission| {
            transmission.received == transmission.bytes.len()
                || transmission.station == NEAR
                    && !self.is_contended(
                        NEAR,
                        transmission.at(transmission.received),
                        transmission.end(),
                    )
        })
    }

    /// Returns the time of the next reception that a station requires: the first byte of a node's
    /// transmission for the near end, the last byte of any transmission for all, and the byte that
    /// the nodes need.
    pub(crate) fn next_wake(&self, needs: &Needs) -> Option<SimTime> {
        let mut wake: Option<SimTime> = None;
        for transmission in &self.transmissions {
            if transmission.received == transmission.bytes.len() {
                continue;
            }
            let mut index = transmission.bytes.len() - 1;
            if transmission.station != NEAR && transmission.received == 0 {
                index = 0;
            }
            if let Some(count) = needs.bytes
                && !self.is_taken_whole(transmission, needs)
            {
                let needed = transmission.delivered + count.max(1) - 1;
                index = index.min(needed.max(transmission.received));
            }
            let at = transmission.at(index);
            wake = Some(wake.map_or(at, |wake| wake.min(at)));
        }
        wake
    }

    /// Delivers the bytes complete by `now` to their receivers; returns whether there were any. The
    /// nodes receive a transmission when all of it is complete, unless they need bytes of it
    /// before; the bytes are the same.
    pub(crate) fn receive(
        &mut self,
        now: SimTime,
        needs: &Needs,
        mut deliver: impl FnMut(Receivers, Piece<'_>),
    ) -> bool {
        if !self
            .transmissions
            .iter()
            .any(|transmission| transmission.has_new_byte(now))
        {
            return false;
        }
        if self.overlaps(now) {
            self.deliver_to_nodes(None, &mut deliver);
            while let Some(index) = self.next_complete(now) {
                self.receive_byte(index, &mut deliver);
            }
        } else {
            self.receive_pieces(now, &mut deliver);
            self.deliver_to_nodes(Some(needs), &mut deliver);
        }
        self.remove_finished(now);
        true
    }

    /// Whether a byte that is complete by `now` overlaps another station's transmission or its
    /// turnaround.
    fn overlaps(&self, now: SimTime) -> bool {
        self.transmissions.len() > 1
            && self.transmissions.iter().any(|transmission| {
                let (received, complete) = (transmission.received, transmission.complete(now));
                received < complete
                    && self.is_contended(
                        transmission.station,
                        transmission.at(received),
                        transmission.at(complete - 1),
                    )
            })
    }

    /// Whether a station other than `station` occupies the wires during bytes of which the first is
    /// complete at `first` and the last at `last`.
    fn is_contended(&self, station: usize, first: SimTime, last: SimTime) -> bool {
        self.transmissions.iter().any(|other| {
            other.station != station
                && other.first < last + self.byte_time
                && first < self.receives_from(other) + self.byte_time
        })
    }

    /// Whether a transmission is an undisturbed packet, on whose parts no node reacts.
    // Out of line: its callers are called at every wake-up, mostly without it.
    #[inline(never)]
    fn is_taken_whole(&self, transmission: &Transmission, needs: &Needs) -> bool {
        needs.packets
            && transmission.packet.is_some()
            && transmission.delivered == 0
            && !self.is_contended(transmission.station, transmission.first, transmission.end())
    }

    /// Time from which the transmitting station receives again.
    fn receives_from(&self, transmission: &Transmission) -> SimTime {
        if transmission.station == NEAR {
            transmission.end() + self.turnaround
        } else {
            transmission.end()
        }
    }

    /// Delivers non-overlapping transmissions (the common case) to the near end as they are
    /// complete.
    fn receive_pieces(&mut self, now: SimTime, deliver: &mut impl FnMut(Receivers, Piece<'_>)) {
        for transmission in &mut self.transmissions {
            let complete = transmission.complete(now);
            if complete == transmission.received {
                continue;
            }
            if transmission.station != NEAR {
                let piece = transmission.piece(transmission.received..complete);
                self.busy_until[NEAR] = piece.last();
                deliver(Receivers::One(NEAR), piece);
            }
            transmission.received = complete;
        }
    }

    /// Delivers the received bytes to the nodes: whole transmissions, and parts of those of which
    /// bytes are needed, or of all.
    fn deliver_to_nodes(
        &mut self,
        needs: Option<&Needs>,
        deliver: &mut impl FnMut(Receivers, Piece<'_>),
    ) {
        for index in 0..self.transmissions.len() {
            let transmission = &self.transmissions[index];
            if transmission.delivered == transmission.received {
                continue;
            }
            let is_needed =
                |needs: &Needs| needs.bytes.is_some() && !self.is_taken_whole(transmission, needs);
            if transmission.received < transmission.bytes.len() && !needs.is_none_or(is_needed) {
                continue;
            }
            let transmission = &mut self.transmissions[index];
            let piece = transmission.piece(transmission.delivered..transmission.received);
            let (last, but) = (piece.last(), transmission.station);
            for receiver in (NEAR + 1..self.busy_until.len()).filter(|receiver| *receiver != but) {
                self.busy_until[receiver] = last;
            }
            let is_whole = piece.bytes.len() == transmission.bytes.len();
            let packet = transmission.packet.filter(|_| is_whole);
            deliver(Receivers::Nodes { but, packet }, piece);
            transmission.delivered = transmission.received;
        }
    }

    /// Returns the transmission whose next byte is complete first, if that is by `now`.
    fn next_complete(&self, now: SimTime) -> Option<usize> {
        let open = (0..self.transmissions.len()).filter(|index| {
            let transmission = &self.transmissions[*index];
            transmission.received < transmission.bytes.len()
                && transmission.at(transmission.received) <= now
        });
        open.min_by_key(|index| {
            let transmission = &self.transmissions[*index];
            (transmission.at(transmission.received), transmission.station)
        })
    }

    fn receive_byte(&mut self, index: usize, deliver: &mut impl FnMut(Receivers, Piece<'_>)) {
        let transmission = &mut self.transmissions[index];
        let (station, at, framing_error) = (
            transmission.station,
            transmission.at(transmission.received),
            transmission.framing_error,
        );
        transmission.received += 1;
        transmission.delivered = transmission.received;
        let collided = self.transmissions.iter().any(|other| {
            other.station != station
                && other.first < at + self.byte_time
                && at < other.end() + self.byte_time
        });
        self.collisions += u64::from(collided);
        let byte = self.sampled_byte(at);
        for receiver in (0..self.busy_until.len()).filter(|receiver| *receiver != station) {
            let transmitting = self.transmissions.iter().any(|other| {
                other.station == receiver
                    && other.first < at + self.byte_time
                    && at < self.receives_from(other) + self.byte_time
            });
            if !transmitting && at >= self.busy_until[receiver] + self.byte_time {
                self.busy_until[receiver] = at;
                let piece = Piece {
                    first: at,
                    spacing: self.byte_time,
                    bytes: &[byte],
                    framing_error,
                };
                deliver(Receivers::One(receiver), piece);
            }
        }
    }

    /// Returns the byte sampled by a receiver if its frame is complete at `at`.
    fn sampled_byte(&self, at: SimTime) -> u8 {
        (0..8).fold(0, |byte, bit| {
            // Bit 0 follows the start bit: its middle is 3/20 of the byte time after the start,
            // 17/20 before the end.
            let before_end = self.byte_time * (17 - 2 * bit) / 20;
            let middle = SimTime::ZERO + (at.since_start() - before_end);
            let is_high =
                |transmission: &Transmission| transmission.is_high(middle, self.byte_time);
            byte | u8::from(self.transmissions.iter().all(is_high)) << bit
        })
    }

    /// Removes transmissions that cannot overlap later ones.
    fn remove_finished(&mut self, now: SimTime) {
        let (byte_time, turnaround) = (self.byte_time, self.turnaround);
        let spare = &mut self.spare;
        self.transmissions.retain_mut(|transmission| {
            let keep = transmission.received < transmission.bytes.len()
                || now < transmission.end() + turnaround + byte_time;
            if !keep {
                transmission.bytes.clear();
                spare.push(mem::take(&mut transmission.bytes));
            }
            keep
        });
    }
}
