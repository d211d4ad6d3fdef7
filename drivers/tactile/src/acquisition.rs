use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, SimDuration, Unit};
use twinrig_wire::{
    Diagnostics, FrameCounts, FrameOutcome, FramedMessage, Pacing, Protocol, RequestKind,
    SampleChoice, TrafficError,
};

use crate::assumed::{ANSWER_TIMEOUT, REPORT_INTERVAL, SILENT_PERIODS};
use crate::newest_sample::{Continuity, NewestSample};
use crate::protocol::{BRIDGE_COUNTS, Command, Message, RATIO, Status, VOLTAGE_COUNTS, VOLTS};
use crate::{CHANNELS, ClockMap, Tactile, TactileSample};

/// Requests to the board and interpretation of its messages.
#[derive(Debug)]
pub struct TactileAcquisition {
    config: Tactile,
    silence: SimDuration,
    transport: SimDuration,
}

/// Changing state.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    /// Time of the bytes being processed.
    pub(crate) now: HostTime,
    /// Samples since the driver's last call.
    #[serde(skip)]
    pub(crate) samples: Vec<TactileSample>,
    /// Bytes to be sent besides those of a request.
    pub(crate) unsolicited: Vec<u8>,
    /// Time at which the board is started again unless a sample arrives; none before it is opened
    /// and after it is closed.
    pub(crate) silent_at: Option<HostTime>,
    /// Start has been acknowledged since the last request to open.
    started: bool,
    zeroed: bool,
    refused: Option<Command>,
    boot: Option<u8>,
    newest: Option<NewestSample>,
    clock: ClockMap,
    /// Time of the next clock report.
    report_at: Option<HostTime>,
    values: [f64; 3],
    counts: Counts,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Counts {
    samples: u64,
    lost: u64,
    stale: u64,
    restarts: u64,
    started_again: u64,
    saturated: [u64; 3],
    overruns: u64,
    foreign: u64,
}

/// Content of a data frame.
#[derive(Clone, Copy)]
struct Data {
    boot: u8,
    sequence: u16,
    stamp: u32,
    volts: [i16; 2],
    bridge: i32,
    status: Status,
}

impl TactileAcquisition {
    /// Creates the protocol of a checked configuration.
    pub(crate) fn new(config: Tactile) -> Self {
        Self {
            silence: config.period * SILENT_PERIODS,
            transport: config.transport(),
            config,
        }
    }

    fn start(&self, bytes: &mut Vec<u8>) {
        let start = Message::Start {
            // Fits, as validated by `check`.
            period_us: u16::try_from(self.config.period.as_nanos() / 1000).unwrap_or(u16::MAX),
            oversampling: self.config.oversampling,
        };
        start.encode(bytes);
    }

    /// Starts a silent board again: it may have restarted.
    pub(crate) fn handle_silence(&self, state: &mut State, now: HostTime) {
        if state.silent_at.is_some_and(|at| at <= now) {
            state.silent_at = Some(now + self.silence);
            state.counts.started_again += 1;
            self.start(&mut state.unsolicited);
        }
    }

    /// Processes a sample. Returns whether it is new.
    fn sample(&self, state: &mut State, data: Data) -> bool {
        let late = state.is_late_boot(data.boot, self.silence);
        let advanced = if late {
            None
        } else {
            self.advance(state, data)
        };
        let Some((NewestSample { stamp_us, .. }, lost)) = advanced else {
            state.counts.stale += 1;
            return false;
        };
        let at = state.clock.observe(stamp_us, state.now);
        let cell = self.config.reference;
        let ratio = f64::from(data.bridge) / f64::from(BRIDGE_COUNTS) * RATIO;
        let reference = ratio / cell.sensitivity * cell.capacity;
        let volts = data
            .volts
            .map(|count| f64::from(count) * (VOLTS / f64::from(VOLTAGE_COUNTS)));
        let [resistive, electric, bridge] = data.status.saturated;
        let sample = TactileSample {
            at,
            arrived: state.now,
            stamp_us,
            volts,
            reference,
            saturated: [
                resistive,
                electric,
                bridge || reference.abs() > cell.capacity,
            ],
        };
        state.samples.push(sample);
        state.values = [volts[0], volts[1], reference];
        let counts = &mut state.counts;
        counts.samples += 1;
        counts.lost += lost;
        counts.overruns += u64::from(data.status.overrun);
        for (count, saturated) in counts.saturated.iter_mut().zip(sample.saturated) {
            *count += u64::from(saturated);
        }
        state.report_clock(data.boot, data.stamp, at);
        if let Some(silent_at) = &mut state.silent_at {
            *silent_at = state.now + self.silence;
        }
        true
    }

    /// Makes a sample the newest one, and returns it with the number of samples missing before it;
    /// none if it is repeated or late.
    fn advance(&self, state: &mut State, data: Data) -> Option<(NewestSample, u64)> {
        let (now, numbers) = (state.now, (data.sequence, data.stamp));
        let (period, silence) = (self.config.period, self.silence);
        let (newest, lost) = match state.newest {
            None => (NewestSample::first(now, data.sequence, data.stamp), 0),
            Some(newest) => match newest.compare(now, numbers, period, silence) {
                Continuity::Stale => return None,
                Continuity::Later(newest, lost) => (newest, lost),
                Continuity::Restarted(newest) => {
                    state.restart();
                    (newest, 0)
                }
            },
        };
        state.newest = Some(newest);
        Some((newest, lost))
    }

    fn handle_data(&self, state: &mut State, kind: Option<RequestKind>, data: Data) -> bool {
        // Samples before the acknowledgements are of an earlier session, or not zeroed.
        if !state.started || self.config.zero && !state.zeroed {
            return false;
        }
        let new = self.sample(state, data);
        if new && kind == Some(RequestKind::Open) {
            state.silent_at = Some(state.now + self.silence);
        }
        new && kind != Some(RequestKind::Close)
    }
}

impl State {
    /// Whether a sample of a boot is a late one of the boot before; another boot becomes the
    /// present one. After a silence, late ones are not expected any more.
    fn is_late_boot(&mut self, boot: u8, silence: SimDuration) -> bool {
        let present = *self.boot.get_or_insert(boot);
        let recent = |newest: NewestSample| self.now < newest.arrived + silence;
        if boot == present {
            return false;
        }
        if boot == present.wrapping_sub(1) && self.newest.is_some_and(recent) {
            return true;
        }
        self.boot = Some(boot);
        self.restart();
        false
    }

    /// Handles a restart of the board.
    fn restart(&mut self) {
        self.counts.restarts += 1;
        self.newest = None;
        self.clock.reset();
    }

    /// Reports the mapped time of a stamp to the board, once a second.
    fn report_clock(&mut self, boot: u8, stamp: u32, at: HostTime) {
        let due = *self.report_at.get_or_insert(self.now + REPORT_INTERVAL);
        if self.now >= due {
            self.report_at = Some(self.now + REPORT_INTERVAL);
            let host_ns = at.as_nanos();
            let report = Message::Clock {
                boot,
                stamp,
                host_ns,
            };
            report.encode(&mut self.unsolicited);
        }
    }
}

impl Protocol for TactileAcquisition {
    type State = State;
    type Message = Message;

    const DEVICE: &'static str = "board";

    fn initial(&self) -> State {
        State {
            now: HostTime::default(),
            samples: Vec::new(),
            unsolicited: Vec::new(),
            silent_at: None,
            started: false,
            zeroed: false,
            refused: None,
            boot: None,
            newest: None,
            clock: ClockMap::new(self.transport),
            report_at: None,
            values: [0.0; 3],
            counts: Counts::default(),
        }
    }

    fn name(&self) -> &str {
        &self.config.name
    }

    fn ports(&self) -> Vec<Port> {
        let units = [Unit::Volt, Unit::Volt, Unit::Newton];
        let channels = CHANNELS.iter().zip(units);
        let port = |(channel, unit): (&&str, Unit)| {
            Port::output(format!("{}/{channel}", self.config.signal), unit, 1)
        };
        channels.map(port).collect()
    }

    fn request(
        &self,
        state: &mut State,
        kind: RequestKind,
        _from_process: &[f64],
        request: &mut Vec<u8>,
    ) -> Option<SimDuration> {
        match kind {
            RequestKind::Open => {
                (state.started, state.zeroed) = (false, false);
                self.start(request);
                if self.config.zero {
                    Message::Zero.encode(request);
                }
                Some(ANSWER_TIMEOUT)
            }
            // The next sample is sent without a request.
            RequestKind::Transfer => {
                let fresh = self.config.take == SampleChoice::Fresh;
                fresh.then(|| self.config.period * 2 + self.transport)
            }
            RequestKind::Close => {
                state.started = false;
                state.silent_at = None;
                Message::Stop.encode(request);
                Some(ANSWER_TIMEOUT)
            }
        }
    }

    fn handle_message(
        &self,
        state: &mut State,
        kind: Option<RequestKind>,
        message: Message,
    ) -> FrameOutcome {
        match message {
            Message::Data {
                boot,
                sequence,
                stamp,
                volts,
                bridge,
                status,
            } => {
                let data = Data {
                    boot,
                    sequence,
                    stamp,
                    volts,
                    bridge,
                    status,
                };
                FrameOutcome::complete_if(self.handle_data(state, kind, data))
            }
            Message::Acknowledgement {
                command,
                done: true,
            } => match (kind, command) {
                (Some(RequestKind::Open), Command::Start | Command::Zero) => {
                    state.started |= command == Command::Start;
                    state.zeroed |= command == Command::Zero;
                    FrameOutcome::More(ANSWER_TIMEOUT + self.config.period * 2)
                }
                (Some(RequestKind::Close), Command::Stop) => FrameOutcome::Complete,
                _ => FrameOutcome::Incomplete,
            },
            Message::Acknowledgement {
                command,
                done: false,
            } => {
                state.refused = Some(command);
                FrameOutcome::Incomplete
            }
            Message::Start { .. } | Message::Stop | Message::Zero | Message::Clock { .. } => {
                state.counts.foreign += 1;
                FrameOutcome::Incomplete
            }
        }
    }

    fn time_out(&self, state: &mut State, kind: RequestKind) {
        state.counts.stale += u64::from(kind == RequestKind::Transfer);
    }

    fn open_failure(&self, state: &State) -> String {
        let name = &self.config.name;
        match state.refused {
            Some(command) => format!("the board of {name} rejects the command {command:?}"),
            None => format!(
                "the board of {name} did not acknowledge and send within {ANSWER_TIMEOUT}, in {} attempts: check the connection and the port",
                Self::ATTEMPTS
            ),
        }
    }

    fn to_process<'s>(&self, state: &'s State) -> &'s [f64] {
        &state.values
    }

    fn pacing(&self) -> Option<Pacing> {
        Some(Pacing::Frames(self.config.period))
    }

    fn counts(&self, state: &State) -> FrameCounts {
        let counts = &state.counts;
        let errors = [
            (TrafficError::Lost, counts.lost),
            (TrafficError::NotNew, counts.stale),
            (TrafficError::Restart, counts.restarts),
            (TrafficError::Fault, counts.overruns),
            (TrafficError::Unexpected, counts.foreign),
        ];
        FrameCounts::new(counts.samples, &errors)
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        let counts = &state.counts;
        diagnostics.count("samples", counts.samples);
        diagnostics.count("lost", counts.lost);
        diagnostics.count("stale", counts.stale);
        diagnostics.count("restarts", counts.restarts);
        diagnostics.count("started_again", counts.started_again);
        for (channel, count) in SATURATED.into_iter().zip(counts.saturated) {
            diagnostics.count(channel, count);
        }
        diagnostics.count("overruns", counts.overruns);
        diagnostics.count("foreign", counts.foreign);
        diagnostics.value("clock/offset", Unit::Second, state.clock.offset());
        diagnostics.value("clock/rate", Unit::One, state.clock.rate());
        diagnostics.value("clock/residual", Unit::Second, state.clock.residual());
    }
}

/// Diagnostics of saturated samples, by channel.
const SATURATED: [&str; 3] = [
    "saturated/piezoresistive",
    "saturated/piezoelectric",
    "saturated/reference",
];
