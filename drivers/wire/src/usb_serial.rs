use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    PlantAccess, PlantSignals, TaskError, TimeSource, Timing, TransmitBuffer, Wire, WiringError,
};

use crate::error::nonzero;
use crate::line::earlier;
use crate::microframes::Microframes;
use crate::uart::TRANSMIT_BUFFER;
use crate::{Arrivals, CompletionRule, InRule, Line, OutRule, Piece, UsbTiming, WireError};

/// A USB serial converter (FT2232H) with its UART, between the host and a line.
///
/// What the host writes is with the host controller when the write jitter is over, in the chip by [`OutRule`] and leaves it
/// through the UART, byte after byte. What the UART receives goes back in packets: full ones at once, others when the latency
/// timer has run out, which every return starts again; [`InRule`] says what they carry, [`CompletionRule`] when the host learns of
/// them, turnaround and jitter when its program does. Packets without payload are not shown.
///
/// The chip's transmit buffer holds 4 kB. [`Wire::transmit_buffer`] tells the room in it; [`Wire::send`] does not refuse what is
/// beyond, because in virtual time no driver waits for a write. Returns on changes of modem lines, and the limit of the receive
/// buffer, are not modelled.
pub struct UsbSerial<L> {
    name: String,
    out: OutRule,
    /// Microframes from the one by whose start a byte must be complete to the one whose packet carries it.
    readying: u64,
    /// Microframes from a packet's own to the one at whose start the host learns of it.
    reporting: u64,
    turnaround: SimDuration,
    /// Latency timer \[microframes\].
    timer: u64,
    payload: usize,
    packets_per_microframe: usize,
    frames: Microframes,
    byte_time: SimDuration,
    line: L,
    /// When the line wants to be advanced next: asked for whenever something was done to it.
    line_wake: Option<SimTime>,
    /// What has just come from the line.
    arrived: Arrivals,
    state: State,
    /// The next microframe whose packets carry anything, as far as is known, and when the host has that. Follows from
    /// what is pending, the last return and the jitter.
    known: Option<(u64, SimTime)>,
    /// When the host may have something to read next: that, or earlier if bytes go on coming in.
    next_read: Option<SimTime>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    jitter: TimeSource,
    /// That of the next completion.
    next_jitter: SimDuration,
    write_jitter: TimeSource,
    /// When the host controller had the last write.
    written: SimTime,
    /// When the UART has sent everything.
    uart_free: SimTime,
    /// Microframe of the last return, perhaps of an empty packet; later ones are whole timers later.
    returned: u64,
    /// Up to when the line was asked.
    asked: SimTime,
    /// When the last byte came from the line.
    last_byte: Option<SimTime>,
    /// In the chip.
    pending: Arrivals,
    /// At the host.
    readable: Vec<u8>,
    packets: u64,
    bytes: u64,
    framing_errors: u64,
}

impl<L: Line> UsbSerial<L> {
    /// In front of `line`, at whose baud rate a byte takes `byte_time`. The jitter is drawn from the stream
    /// `wire/NAME/usb`, that of writes from `wire/NAME/usb/write`; gauges are `NAME/usb/packets` and `NAME/usb/bytes`, both to
    /// the host, and `NAME/usb/framing_errors`, the bytes among them that came with a wrong stop bit.
    ///
    /// # Errors
    /// [`WireError`] if the timing cannot be.
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
            readying: u64::from(timing.inn == InRule::ByPreviousFrame),
            reporting: u64::from(timing.completion == CompletionRule::StartOfNext),
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
                asked: SimTime::ZERO,
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
            known: None,
            next_read: None,
        })
    }

    /// Microframe of the first packet at a turn of the timer that carries a byte complete at `arrival`.
    fn timed_return(&self, arrival: SimTime) -> u64 {
        let earliest = self.frames.next(arrival) + self.readying;
        let waits = earliest.saturating_sub(self.state.returned);
        self.state.returned + waits.div_ceil(self.timer).max(1) * self.timer
    }

    /// Microframe of the first packet that is full by a byte complete at `arrival`.
    fn full_return(&self, arrival: SimTime) -> u64 {
        (self.frames.next(arrival) + self.readying).max(self.state.returned + 1)
    }

    /// Microframe of the next packet with payload, as far as is known.
    fn next_return(&self) -> Option<u64> {
        let timed = self.timed_return(self.state.pending.at(0)?);
        let full = self.state.pending.at(self.payload - 1);
        Some(full.map_or(timed, |arrival| timed.min(self.full_return(arrival))))
    }

    /// Microframe of the next packet if the bytes that are coming in now go on coming; it may be an earlier one.
    fn next_return_if_more(&self) -> Option<u64> {
        let State {
            asked,
            last_byte,
            pending,
            ..
        } = &self.state;
        let next_byte = (*last_byte)? + self.byte_time;
        if next_byte <= *asked {
            return None;
        }
        match self.payload.checked_sub(pending.len() + 1) {
            _ if pending.is_empty() => Some(self.timed_return(next_byte)),
            Some(missing) => Some(self.full_return(next_byte + self.byte_time * missing as u64)),
            None => None,
        }
    }

    /// When the host's program has what that microframe's packets carry, if those before have been read.
    fn read_at(&self, returned: u64) -> SimTime {
        let reported = self.frames.start(returned + self.reporting);
        reported + self.turnaround + self.state.next_jitter
    }

    /// The packets of that microframe pass.
    fn pass(&mut self, returned: u64) {
        let carried_by = self.frames.start(returned.saturating_sub(self.readying));
        let state = &mut self.state;
        let complete = state.pending.complete(carried_by);
        let timed = (returned - state.returned).is_multiple_of(self.timer);
        let packets = if timed {
            complete.div_ceil(self.payload)
        } else {
            complete / self.payload
        };
        let packets = packets.min(self.packets_per_microframe);
        let count = complete.min(packets * self.payload);
        let readable = &mut state.readable;
        state
            .pending
            .take(count, |piece| readable.extend_from_slice(piece.bytes));
        state.packets += packets as u64;
        state.bytes += count as u64;
        state.returned = returned;
        state.next_jitter = state.jitter.draw();
    }

    /// The UART sends bytes from `start` on.
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

    /// Asks the line what has come by `now`: says whether anything has.
    fn ask(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<bool, TaskError> {
        self.line.advance(now, plant)?;
        self.line.receive(&mut self.arrived);
        self.line_wake = self.line.next_wake();
        self.state.asked = now;
        let Some(last) = self.arrived.last() else {
            return Ok(false);
        };
        self.state.last_byte = Some(last);
        self.state.framing_errors += self.arrived.framing_errors() as u64;
        self.state.pending.append(&mut self.arrived);
        Ok(true)
    }

    /// Something has come or passed.
    fn look_ahead(&mut self) {
        let returned = self.next_return();
        self.known = returned.map(|returned| (returned, self.read_at(returned)));
        self.expect();
    }

    /// The line was asked.
    fn expect(&mut self) {
        let perhaps = self.next_return_if_more();
        let perhaps = perhaps.map(|returned| self.read_at(returned));
        self.next_read = earlier(self.known.map(|(_, at)| at), perhaps);
    }
}

impl<L: Line> Wire for UsbSerial<L> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)?;
        self.line_wake = self.line.next_wake();
        Ok(())
    }

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

    fn send_on(&mut self, now: SimTime, bytes: &[u8]) {
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
        earlier(self.line_wake, self.next_read)
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        // Bytes are pulled with their times, however late; but what lives on the line wants its own instants.
        let (mut late, mut came) = (false, false);
        while let Some(wake) = self.line_wake.filter(|wake| *wake < now) {
            came |= self.ask(wake, plant)?;
            late = true;
        }
        if !late && self.next_wake().is_none_or(|wake| wake > now) {
            return Ok(());
        }
        came |= self.ask(now, plant)?;
        if came {
            self.look_ahead();
        } else {
            self.expect();
        }
        while let Some((returned, _)) = self.known.filter(|(_, at)| *at <= now) {
            self.pass(returned);
            self.look_ahead();
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.state.readable);
    }

    fn diagnostics(&self) -> Vec<Port> {
        let own = ["packets", "bytes", "framing_errors"];
        let own = own.map(|what| Port::output(format!("{}/usb/{what}", self.name), Unit::One, 1));
        own.into_iter().chain(self.line.diagnostics()).collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((own, line)) = values.split_first_chunk_mut::<3>() {
            let state = &self.state;
            let counts = [state.packets, state.bytes, state.framing_errors];
            *own = counts.map(|count| count as f64);
            self.line.read_diagnostics(now, line);
        }
    }

    fn traces(&self) -> Vec<String> {
        self.line.traces()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.line.drain_traffic(passed);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, self.line.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, line): (State, Snapshot) = snapshot.read()?;
        self.line.restore(&line)?;
        self.state = state;
        self.line_wake = self.line.next_wake();
        self.look_ahead();
        Ok(())
    }
}
