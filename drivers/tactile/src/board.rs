use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalDuration, LocalTime, SimDuration, SimTime, Stream, Unit, stream};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, TimeSource, Wire, WiringError};
use twinrig_wire::{
    AnalogInputs, Diagnostics, Emulation, FaultSchedule, FrameError, FramedNode, TxQueue,
    device_wire, quantize,
};

use crate::assumed::{BOOT_TIME, FIFO, REACTION};
use crate::protocol::{
    BRIDGE_COUNTS, Command, DATA_LENGTH, Message, RATIO, Status, VOLTAGE_COUNTS, VOLTS,
};
use crate::{Tactile, TactileError};

/// Emulated board: samples by its own clock once it has been started, and forgets that at a reset.
///
/// It compares the clock reports of the driver with the true time, which in lockstep is that of the
/// host: diagnostics `clock_error` and, after the first two seconds of samples,
/// `clock_error_worst`, of which the size is that of the error.
pub type TactileBoard = FramedNode<TactileEmulation>;

/// Device-specific part of the emulated board.
#[derive(Debug)]
pub struct TactileEmulation {
    config: Tactile,
    inputs: AnalogInputs,
    jitter: TimeSource,
    /// Times of resets, ascending.
    resets: Vec<SimTime>,
    frame_time: SimDuration,
}

/// Changing state.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    noise: Stream,
    jitter: TimeSource,
    boot: u8,
    /// Time of the board's clock at which its stamp is 0.
    zero: LocalTime,
    /// Time from which it accepts commands.
    ready_at: SimTime,
    /// Number of resets so far.
    resets: usize,
    run: Option<Run>,
    sequence: u16,
    /// Zero of the bridge \[counts\]; kept at a reset.
    bridge_zero: i32,
    zeroing: bool,
    overrun: bool,
    /// Starts of the frames that the line has not begun to transmit.
    waiting: VecDeque<SimTime>,
    line_free_at: SimTime,
    /// Time from which clock errors count as settled: two seconds after the first sample of
    /// a boot.
    settled_at: Option<SimTime>,
    clock_error: f64,
    clock_error_worst: f64,
    sent: u64,
    overflows: u64,
}

/// Sampling since a start.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Run {
    period_us: u16,
    conversions: u8,
    /// Board time of the next conversion, from stamp 0 \[ns\].
    next: i64,
    /// Number of conversions of the present sample, and their sums.
    converted: u8,
    sums: [f64; 3],
}

/// Nanoseconds in a microsecond.
const MICRO: i64 = 1000;
/// Time from the first sample to the first counted clock error.
const SETTLING: SimDuration = SimDuration::from_secs(2);

impl TactileEmulation {
    /// Creates the emulation from a checked configuration.
    pub(crate) fn new(config: Tactile) -> Result<Self, TactileError> {
        let mut resets = config.resets.clone();
        resets.sort_unstable();
        let name = format!("{}/jitter", config.name);
        Ok(Self {
            inputs: AnalogInputs::new(config.inputs.clone()),
            jitter: config.jitter.clone().source(config.seed, &name)?,
            resets,
            frame_time: config.byte_time() * DATA_LENGTH as u64,
            config,
        })
    }

    /// Time at which the board's clock shows `local` from stamp 0 \[ns\].
    fn instant(&self, state: &State, local: i64) -> SimTime {
        let clock = &self.config.clock;
        clock.sim_at(state.zero + LocalDuration::from_nanos(local))
    }

    /// Board time from stamp 0 \[ns\].
    fn local(&self, state: &State, now: SimTime) -> i64 {
        (self.config.clock.local_at(now) - state.zero).as_nanos()
    }

    fn reset(&self, state: &mut State, now: SimTime) {
        state.resets += 1;
        state.boot = state.boot.wrapping_add(1);
        state.zero = self.config.clock.local_at(now);
        state.ready_at = now + BOOT_TIME;
        state.run = None;
        state.sequence = 0;
        state.overrun = false;
        state.zeroing = false;
        state.settled_at = None;
    }

    fn start(&self, state: &mut State, now: SimTime, period_us: u16, conversions: u8) {
        let same = |run: &Run| (run.period_us, run.conversions) == (period_us, conversions);
        if state.run.as_ref().is_some_and(same) {
            return;
        }
        // The first window begins at the next multiple of the period.
        let period = i64::from(period_us) * MICRO;
        let next = (self.local(state, now).div_euclid(period) + 1) * period;
        state.run = Some(Run {
            period_us,
            conversions,
            next,
            converted: 0,
            sums: [0.0; 3],
        });
    }

    /// Converts all channels; returns the sums at the last conversion of a sample, with its stamp.
    fn convert(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<Option<([f64; 3], u32)>, TaskError> {
        let Some(run) = &mut state.run else {
            return Ok(None);
        };
        for (channel, sum) in run.sums.iter_mut().enumerate() {
            let mut unplugged = self.config.unplugged.iter();
            if !unplugged.any(|it| it.includes(channel, now)) {
                *sum += self.inputs.read(channel, plant)?;
            }
        }
        let (at, period) = (run.next, i64::from(run.period_us) * MICRO);
        let conversions = i64::from(run.conversions);
        run.next += period / conversions;
        run.converted += 1;
        if run.converted < run.conversions {
            return Ok(None);
        }
        let mut sums = run.sums;
        (run.converted, run.sums) = (0, [0.0; 3]);
        // The noise of all conversions at once: a sum of `n` has √n times the deviation of one.
        let times = f64::from(run.conversions).sqrt();
        for (sum, deviation) in sums.iter_mut().zip(self.config.noise) {
            if deviation > 0.0 {
                *sum += deviation * times * state.noise.normal();
            }
        }
        let middle = at - period * (conversions - 1) / (2 * conversions);
        #[expect(clippy::cast_possible_truncation, reason = "the remainder is a u32")]
        let stamp = middle.div_euclid(MICRO).rem_euclid(1 << 32) as u32;
        Ok(Some((sums, stamp)))
    }

    /// Returns the frame of a sample from the means of its conversions \[V, V, N\].
    fn data(&self, state: &mut State, means: [f64; 3], stamp: u32, anti_aliased: bool) -> Message {
        let volts = [means[0], means[1]].map(|volts| {
            let exact = volts * (f64::from(VOLTAGE_COUNTS) / VOLTS);
            quantize(exact, i16::MIN..=i16::MAX)
        });
        let cell = self.config.reference;
        let ratio = means[2] / cell.capacity * cell.sensitivity;
        let exact = ratio / RATIO * f64::from(BRIDGE_COUNTS);
        let counts = -BRIDGE_COUNTS..=BRIDGE_COUNTS - 1;
        let (bridge, bridge_saturated) = quantize(exact, counts.clone());
        if state.zeroing {
            (state.zeroing, state.bridge_zero) = (false, bridge);
        }
        let bridge = (bridge - state.bridge_zero).clamp(*counts.start(), *counts.end());
        Message::Data {
            boot: state.boot,
            sequence: state.sequence,
            stamp,
            volts: volts.map(|(count, _)| count),
            bridge,
            status: Status {
                saturated: [volts[0].1, volts[1].1, bridge_saturated],
                overrun: std::mem::take(&mut state.overrun),
                anti_aliased,
            },
        }
    }

    /// Sends a sample, or drops it if the line is too slow.
    fn send(
        &self,
        state: &mut State,
        now: SimTime,
        (means, stamp, anti_aliased): ([f64; 3], u32, bool),
        tx: &mut TxQueue,
    ) {
        while state.waiting.front().is_some_and(|&start| start <= now) {
            state.waiting.pop_front();
        }
        if state.waiting.len() < FIFO {
            let start = (now + state.jitter.draw()).max(state.line_free_at);
            state.waiting.push_back(start);
            state.line_free_at = start + self.frame_time;
            state.sent += 1;
            let message = self.data(state, means, stamp, anti_aliased);
            tx.send(start, &message);
        } else {
            state.overrun = true;
            state.overflows += 1;
        }
        state.sequence = state.sequence.wrapping_add(1);
    }

    /// Compares a clock report with the true time.
    fn handle_report(&self, state: &mut State, now: SimTime, stamp: u32, host_ns: u64) {
        let local = self.local(state, now).div_euclid(MICRO);
        // The newest time with that stamp, which is in the past.
        let since = (local - i64::from(stamp)).rem_euclid(1 << 32);
        let at = self.instant(state, (local - since) * MICRO);
        let size = at.as_nanos().abs_diff(host_ns) as f64 * 1e-9;
        let late = host_ns >= at.as_nanos();
        state.clock_error = if late { size } else { -size };
        if state.settled_at.is_some_and(|settled| settled <= now) {
            state.clock_error_worst = state.clock_error_worst.max(size);
        }
    }
}

impl Emulation for TactileEmulation {
    type State = State;
    type Message = Message;

    fn initial(&self) -> State {
        State {
            noise: stream(self.config.seed, &format!("{}/noise", self.config.name)),
            jitter: self.jitter.clone(),
            boot: 0,
            zero: LocalTime::default(),
            ready_at: SimTime::ZERO,
            resets: 0,
            run: None,
            sequence: 0,
            bridge_zero: 0,
            zeroing: false,
            overrun: false,
            waiting: VecDeque::with_capacity(FIFO),
            line_free_at: SimTime::ZERO,
            settled_at: None,
            clock_error: 0.0,
            clock_error_worst: 0.0,
            sent: 0,
            overflows: 0,
        }
    }

    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.inputs.connect(owner, plant)
    }

    fn next_instant(&self, state: &State) -> Option<SimTime> {
        let conversion = state.run.map(|run| self.instant(state, run.next));
        twinrig_wire::earlier(conversion, self.resets.get(state.resets).copied())
    }

    fn act(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        if self.resets.get(state.resets).is_some_and(|&at| at <= now) {
            self.reset(state, now);
            return Ok(());
        }
        let conversions = state.run.map_or(1, |run| run.conversions);
        if let Some((sums, stamp)) = self.convert(state, now, plant)? {
            state.settled_at = state.settled_at.or(Some(now + SETTLING));
            let means = sums.map(|sum| sum / f64::from(conversions));
            self.send(state, now, (means, stamp, conversions > 1), tx);
        }
        Ok(())
    }

    fn handle_message(
        &self,
        state: &mut State,
        now: SimTime,
        message: Message,
        _plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        if now < state.ready_at {
            return Ok(());
        }
        let command = match message {
            Message::Start {
                period_us,
                oversampling,
            } => {
                self.start(state, now, period_us, oversampling);
                Command::Start
            }
            Message::Stop => {
                state.run = None;
                Command::Stop
            }
            Message::Zero => {
                state.zeroing = true;
                Command::Zero
            }
            Message::Clock {
                boot,
                stamp,
                host_ns,
            } => {
                if boot == state.boot {
                    self.handle_report(state, now, stamp, host_ns);
                }
                return Ok(());
            }
            // Messages of the other direction are ignored.
            Message::Acknowledgement { .. } | Message::Data { .. } => return Ok(()),
        };
        let done = true;
        tx.send(now + REACTION, &Message::Acknowledgement { command, done });
        Ok(())
    }

    fn handle_invalid(&self, now: SimTime, _error: FrameError, tx: &mut TxQueue) {
        let (command, done) = (Command::Unknown, false);
        tx.send(now + REACTION, &Message::Acknowledgement { command, done });
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("sent", state.sent);
        diagnostics.count("overflows", state.overflows);
        diagnostics.value("clock_error", Unit::Second, state.clock_error);
        diagnostics.value("clock_error_worst", Unit::Second, state.clock_error_worst);
    }
}

impl Tactile {
    /// Creates the emulated board.
    ///
    /// # Errors
    /// [`TactileError`] if the configuration is invalid.
    pub fn board(&self) -> Result<TactileBoard, TactileError> {
        self.check()?;
        Ok(TactileBoard::new(TactileEmulation::new(self.clone())?))
    }

    /// Creates the wire with the emulated board at its far end, and with the faults that are on
    /// `wire/NAME`.
    ///
    /// # Errors
    /// [`TactileError`] if the configuration or a fault is invalid.
    pub fn wire(&self, faults: &FaultSchedule) -> Result<impl Wire + use<>, TactileError> {
        Ok(device_wire(self.byte_time(), faults, self.board()?)?)
    }
}
