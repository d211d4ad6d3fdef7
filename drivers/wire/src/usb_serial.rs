use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    Part, PlantAccess, PlantSignals, TaskError, TimeSource, Timing, TransmitBuffer, Wire,
    WiringError,
};

use crate::error::nonzero;
use crate::line::earlier;
use crate::microframes::Microframes;
use crate::uart::TRANSMIT_BUFFER;
use crate::{Arrivals, CompletionRule, InRule, Line, OutRule, Piece, UsbTiming, WireError};

/// USB serial converter (FT2232H) with its UART, between the host and a line.
///
/// Bytes written by the host reach the host controller after the write jitter, the chip by
/// [`OutRule`], and leave the chip through the UART, one after another. Bytes received by the UART
/// return in packets: full packets at once, others when the latency timer expires, which every
/// return restarts. [`InRule`] determines the contents of a packet, [`CompletionRule`] when the
/// host controller reports it, and turnaround and jitter when the host's program has it. Packets
/// without payload are not modelled.
///
/// The chip's transmit buffer holds 4 kB. [`Wire::transmit_buffer`] reports the room in it;
/// [`Wire::send`] accepts bytes beyond it, because in virtual time no driver waits for a write.
/// Returns on changes of modem lines and the limit of the receive buffer are not modelled.
pub struct UsbSerial<L> {
    name: String,
    out: OutRule,
    inn: InRule,
    /// Microframes between the one by whose start a byte must be complete and the one whose packet
    /// carries it.
    in_delay: u64,
    /// Microframes between that of a packet and the one at whose start the host controller reports
    /// it.
    completion_delay: u64,
    turnaround: SimDuration,
    /// Latency timer \[microframes\].
    timer: u64,
    payload: usize,
    packets_per_microframe: usize,
    frames: Microframes,
    byte_time: SimDuration,
    line: L,
    /// [`Line::next_wake`] of the line, updated after every call that changes the line.
    line_wake: Option<SimTime>,
    /// Bytes just received from the line.
    arrived: Arrivals,
    state: State,
    /// The next microframe whose packets carry payload, as far as known, and the time at which the
    /// host's program has it. Derived from the pending bytes, the last return and the jitter.
    next_completion: Option<(u64, SimTime)>,
    /// Next time at which the host may have bytes to read: that of `next_completion`, or earlier if
    /// further bytes arrive without a pause.
    next_read: Option<SimTime>,
    /// Whether that depends on the time of the last poll.
    speculates: bool,
    /// Time of the last call. The line may learn it later: what it reports for earlier is due now.
    now: SimTime,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    jitter: TimeSource,
    /// Jitter of the next completion.
    next_jitter: SimDuration,
    write_jitter: TimeSource,
    /// Time at which the host controller had the last write.
    written: SimTime,
    /// Time at which the UART has transmitted all bytes.
    uart_free: SimTime,
    /// Microframe of the last return, possibly of an empty packet; later ones follow at multiples
    /// of the timer.
    returned: u64,
    /// Time of the last poll of the line.
    polled: SimTime,
    /// Completion time of the last byte from the line.
    last_byte: Option<SimTime>,
    /// Bytes in the chip.
    pending: Arrivals,
    /// Bytes at the host.
    readable: Vec<u8>,
    packets: u64,
    bytes: u64,
    framing_errors: u64,
}

impl<L: Line> UsbSerial<L> {
    /// A converter in front of `line`, on which a byte takes `byte_time`. The jitter is drawn from
    /// the stream `wire/NAME/usb`, that of writes from `wire/NAME/usb/write`. Diagnostics:
    /// `NAME/usb/packets` and `NAME/usb/bytes`, both towards the host, and
    /// `NAME/usb/framing_errors`, the number of bytes among them with a wrong stop bit.
    ///
    /// # Errors
    /// [`WireError`] if the timing is invalid.
    pub fn new(
        name: &str,
        timing: UsbTiming,
        byte_time: SimDuration,
        seed: u64,
        line: L,
    ) -> Result<Self, WireError> {
        nonzero(name, "byte time", byte_time)?;
        let frames = Microframes::new(name, &timing)?;
        let microframe = timing.microframe.as_nanos();
        let source = |timing: Timing, what, stream: &str| {
            let source = timing.source(seed, stream);
            source.map_err(|source| WireError::Jitter {
                name: name.to_owned(),
                what,
                source,
            })
        };
        let stream = format!("wire/{name}/usb");
        let mut jitter = source(timing.jitter, "jitter", &stream)?;
        let write_jitter = source(
            timing.write_jitter,
            "write jitter",
            &format!("{stream}/write"),
        )?;
        Ok(Self {
            name: name.to_owned(),
            out: timing.out,
            inn: timing.inn,
            in_delay: u64::from(timing.inn == InRule::ByPreviousFrame),
            completion_delay: u64::from(timing.completion == CompletionRule::StartOfNext),
            turnaround: timing.turnaround,
            timer: timing.latency_timer.as_nanos().div_ceil(microframe).max(1),
            payload: timing.payload.max(1),
            packets_per_microframe: timing.packets_per_microframe.max(1),
            state: State {
                next_jitter: jitter.draw(),
                jitter,
                write_jitter,
                written: SimTime::ZERO,
                uart_free: SimTime::ZERO,
                returned: frames.of(SimTime::ZERO),
                polled: SimTime::ZERO,
                last_byte: None,
                pending: Arrivals::default(),
                readable: Vec::new(),
                packets: 0,
                bytes: 0,
                framing_errors: 0,
            },
            frames,
            byte_time,
            line_wake: line.next_wake(),
            line,
            arrived: Arrivals::default(),
            next_completion: None,
            next_read: None,
            speculates: false,
            now: SimTime::ZERO,
        })
    }

    /// Microframe of the first packet at an expiry of the timer that carries a byte complete at
    /// `arrival`.
    fn timed_return(&self, arrival: SimTime) -> u64 {
        let earliest = self.frames.next(self.inn.ready(arrival)) + self.in_delay;
        let wait = earliest.saturating_sub(self.state.returned);
        self.state.returned + wait.div_ceil(self.timer).max(1) * self.timer
    }

    /// Microframe of the first packet that is full with a byte complete at `arrival`.
    fn full_return(&self, arrival: SimTime) -> u64 {
        (self.frames.next(arrival) + self.in_delay).max(self.state.returned + 1)
    }

    /// Microframe of the next packet with payload, as far as known.
    fn next_return(&self) -> Option<u64> {
        let timed = self.timed_return(self.state.pending.at(0)?);
        let full = self.state.pending.at(self.payload - 1);
        Some(full.map_or(timed, |arrival| timed.min(self.full_return(arrival))))
    }

    /// Microframe of the next packet, which may be earlier, if the bytes currently arriving
    /// continue without a pause.
    fn next_return_if_more(&self) -> Option<u64> {
        let State {
            polled,
            last_byte,
            pending,
            ..
        } = &self.state;
        let next_byte = (*last_byte)? + self.byte_time;
        if next_byte <= *polled {
            return None;
        }
        match self.payload.checked_sub(pending.len() + 1) {
            _ if pending.is_empty() => Some(self.timed_return(next_byte)),
            Some(missing) => Some(self.full_return(next_byte + self.byte_time * missing as u64)),
            None => None,
        }
    }

    /// Time at which the host's program has the packets of microframe `returned`, if the packets
    /// before have been read.
    fn read_at(&self, returned: u64) -> SimTime {
        let reported = self.frames.start(returned + self.completion_delay);
        reported + self.turnaround + self.state.next_jitter
    }

    /// Returns the packets of microframe `returned` to the host.
    fn return_packets(&mut self, returned: u64) {
        let start = self.frames.start(returned.saturating_sub(self.in_delay));
        let ready_until = self.inn.ready_until(start);
        let state = &mut self.state;
        let full = state.pending.complete(start) / self.payload * self.payload;
        let is_timed = (returned - state.returned).is_multiple_of(self.timer);
        let ready = ready_until.filter(|_| is_timed);
        let ready = ready.map_or(0, |until| state.pending.complete(until));
        let count = full.max(ready);
        let count = count.min(self.packets_per_microframe * self.payload);
        let packets = count.div_ceil(self.payload);
        let readable = &mut state.readable;
        state
            .pending
            .take(count, |piece| readable.extend_from_slice(piece.bytes));
        state.packets += packets as u64;
        state.bytes += count as u64;
        state.returned = returned;
        state.next_jitter = state.jitter.draw();
    }

    /// Transmits bytes through the UART from `start` on.
    fn transmit(&mut self, start: SimTime, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.line.send(Piece {
            first: start + self.byte_time,
            spacing: self.byte_time,
            bytes,
            framing_error: false,
        });
        self.line_wake = self.line.next_wake();
        self.state.uart_free = start + self.byte_time * bytes.len() as u64;
    }

    /// Advances the line to `now` and takes its bytes; returns whether there are any.
    fn poll_line(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<bool, TaskError> {
        self.line.advance(now, plant)?;
        self.line.receive(&mut self.arrived);
        self.line_wake = self.line.next_wake();
        self.state.polled = now;
        let Some(last) = self.arrived.last() else {
            return Ok(false);
        };
        self.state.last_byte = Some(last);
        self.state.framing_errors += self.arrived.framing_errors() as u64;
        self.state.pending.append(&mut self.arrived);
        Ok(true)
    }

    /// Updates the predictions after bytes have arrived or packets have been returned.
    fn update_predictions(&mut self) {
        let returned = self.next_return();
        self.next_completion = returned.map(|returned| (returned, self.read_at(returned)));
        self.update_next_read();
    }

    /// Updates the prediction of the next read after the line was polled.
    fn update_next_read(&mut self) {
        let speculative = (!self.line.is_announced())
            .then(|| self.next_return_if_more())
            .flatten();
        let speculative = speculative.map(|returned| self.read_at(returned));
        self.speculates = speculative.is_some();
        self.next_read = earlier(self.next_completion.map(|(_, at)| at), speculative);
    }
}

impl<L: Line> Part for UsbSerial<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.line)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.line)
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)?;
        self.line_wake = self.line.next_wake();
        Ok(())
    }

    fn diagnostics(&self) -> Vec<Port> {
        let names = ["packets", "bytes", "framing_errors"];
        let ports =
            names.map(|what| Port::output(format!("{}/usb/{what}", self.name), Unit::One, 1));
        ports.into_iter().chain(self.line.diagnostics()).collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((counters, line)) = values.split_first_chunk_mut::<3>() {
            let state = &self.state;
            let counts = [state.packets, state.bytes, state.framing_errors];
            *counters = counts.map(|count| count as f64);
            self.line.read_diagnostics(now, line);
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, self.line.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, line): (State, Snapshot) = snapshot.read()?;
        self.line.restore(&line)?;
        self.state = state;
        self.line_wake = self.line.next_wake();
        self.update_predictions();
        Ok(())
    }
}

impl<L: Line> Wire for UsbSerial<L> {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let state = &mut self.state;
        state.written = state.written.max(now + state.write_jitter.draw());
        let microframe = self.frames.of(state.written);
        let in_chip = match self.out {
            OutRule::AtOnce => state.written,
            OutRule::StartOfNext => self.frames.start(microframe + 1),
            OutRule::EndOfNext => self.frames.start(microframe + 2),
        };
        self.transmit(in_chip.max(self.state.uart_free), bytes);
    }

    fn send_contiguous(&mut self, now: SimTime, bytes: &[u8]) {
        if now <= self.state.uart_free {
            self.transmit(self.state.uart_free, bytes);
        } else {
            self.send(now, bytes);
        }
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        Some(TransmitBuffer {
            idle_from: self.state.uart_free,
            byte_time: self.byte_time,
            capacity: TRANSMIT_BUFFER,
        })
    }

    fn next_wake(&self) -> Option<SimTime> {
        earlier(self.line_wake, self.next_read).map(|wake| wake.max(self.now))
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        // Bytes are pulled with their times, however late, but the line requires all its own
        // instants.
        let (mut late, mut received) = (false, false);
        while let Some(wake) = self.line_wake.filter(|wake| *wake < now) {
            received |= self.poll_line(wake, plant)?;
            late = true;
        }
        if !late && self.next_wake().is_none_or(|wake| wake > now) {
            return Ok(());
        }
        let line_is_due = self.line_wake.is_some_and(|wake| wake <= now);
        if line_is_due || !self.line.is_announced() {
            received |= self.poll_line(now, plant)?;
        }
        if received {
            self.update_predictions();
        } else if self.speculates {
            self.update_next_read();
        }
        while let Some((returned, _)) = self.next_completion.filter(|(_, at)| *at <= now) {
            self.return_packets(returned);
            self.update_predictions();
        }
        Ok(())
    }

    fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        let before = self.next_read.map_or(before, |read| read.min(before));
        let now = self.line.run_ahead(now, before, plant)?;
        self.line_wake = self.line.next_wake();
        self.now = now;
        Ok(now)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.state.readable);
    }
}
