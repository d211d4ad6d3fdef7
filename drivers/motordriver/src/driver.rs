use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{BusHealth, Driver, DriverError};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{Address, FRAME_MAX, Instruction, Master, Request};

use crate::config::{BusConfig, SessionConfig};
use crate::error::BusError;
use crate::event_timing::EventTiming;
use crate::host_board::HostBoard;
use crate::reply::{COMMAND_LEN, Reply, command_bytes};
use crate::session::Session;
use crate::time_outs::master_config;

mod health;

/// Host driver of the motordriver boards: initialises them, exchanges set-points for measurements
/// once per cycle with all used boards (the *scheduled* workflow), and leaves them coasting.
///
/// For every leg its inputs are `leg/LF/hip/command` and `leg/LF/knee/command` \[rad\], its outputs
/// `leg/LF/hip/position`, `leg/LF/knee/position` \[rad\], `leg/LF/angles` \[rad\] (magnetic
/// encoders) and `leg/LF/foot/force` \[N\]. The outputs of a board that did not answer keep their
/// last values.
///
/// For every free shaft its input is `motor/cam/rate/command` \[rad/s\], its outputs are:
///
/// - `motor/cam/position` \[rad\], unwrapped from the word of 12 bits: from within half a turn of
///   zero at the first session, and right as long as the shaft turns by less than half a turn
///   between two replies;
/// - `motor/cam/rate` \[rad/s\], the mean over the last eight intervals between replies, by the
///   starts of their cycles: it lags by four intervals, its resolution is one count over the eight
///   (0.019 rad/s at 100 Hz), and it errs by 1 ms in eight intervals when a tick of the board's
///   clock passes the request. 0 before the second reply.
///
/// Diagnostics, `sbcp/…`, counted from the creation of the driver:
///
/// - `packets` (requests written), `answers`, `errors`, `cycles`, `transfers` (single registers),
///   `strays`, `garbage`, `damaged`, `drain_timeouts`: see [`twinrig_sbcp::MasterCounters`];
///   `success`, the fraction of requests with a valid answer;
/// - `held`, missing replies; `implausible`, replies with a correct checksum that no board sends;
///   `saturated`, set-points out of range; `encoder_faults`, words of magnetic encoders with a
///   fault status;
/// - on a bus with free shafts, `ambiguous`, intervals between replies in which a shaft, at its
///   last rate or its commanded one, may have turned by half a turn or more: its position may be
///   wrong by whole turns;
/// - of the intervals between the starts of consecutive cycles \[s\]: `cycle/mean` = (last − first)
///   / (n − 1) of n starts, the inverse of the cycle rate; `cycle/shortest`, `cycle/longest`,
///   `cycle/half_range` (half of longest minus shortest); the percentiles `cycle/p50`, `cycle/p99`,
///   `cycle/p999` (nearest rank, to 1/128);
/// - `cycle/phase/deviation` \[s\], the standard deviation of the starts from the even grid of the
///   nominal period, [`SessionConfig::period`], modulo that period; in a free-running session,
///   which has no nominal period, from the even grid that fits all starts best (least squares).
///   `cycle/deviation` is an alias;
/// - `cycle/duration` \[s\], the longest duration of a cycle.
pub struct MotorDriver {
    name: String,
    config: SessionConfig,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    stage: Stage,
    master: Master,
    session: Session,
    boards: Vec<HostBoard>,
    /// One request per used board.
    frame: Vec<Request>,
    to_process: Vec<f64>,
    /// Set-points were received that no completed cycle has transmitted.
    awaited: bool,
    /// The current cycle transmits them.
    carried: bool,
    cycles: EventTiming,
    begun: HostTime,
    longest_ns: u64,
    /// Replies that no board sends.
    implausible: u64,
    /// Missing replies, whose data were held.
    held: u64,
    failed: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Stage {
    Closed,
    Opening,
    Open,
    Cycling,
    /// The bus is given up, at the latest then.
    Failing(HostTime),
    Closing,
}

/// Names and units of the diagnostics, without those of the cycle timing.
const DIAGNOSTICS: [(&str, Unit); 15] = [
    ("packets", Unit::One),
    ("answers", Unit::One),
    ("errors", Unit::One),
    ("cycles", Unit::One),
    ("transfers", Unit::One),
    ("strays", Unit::One),
    ("garbage", Unit::One),
    ("damaged", Unit::One),
    ("drain_timeouts", Unit::One),
    ("implausible", Unit::One),
    ("held", Unit::One),
    ("saturated", Unit::One),
    ("encoder_faults", Unit::One),
    ("success", Unit::One),
    ("cycle/duration", Unit::Second),
];

impl MotorDriver {
    /// Creates the driver of a bus.
    ///
    /// # Errors
    /// [`BusError`] if the configuration is invalid.
    pub fn new(config: &BusConfig) -> Result<Self, BusError> {
        config.check()?;
        let gains = &config.session.gains;
        let host_board = |board| HostBoard::new(board, gains);
        let boards = config.boards.iter().map(host_board);
        let boards = boards.collect::<Result<Vec<HostBoard>, _>>()?;
        let measured = boards.iter().filter(|board| board.is_used());
        let used = config.boards.iter().filter(|board| board.used);
        let request = |id| {
            let to = Address::new(CLASS_MOTORDRIVER, id)?;
            Request::new(to, Instruction::LOW_LATENCY, &[0; COMMAND_LEN])
        };
        let frame: Vec<Request> = used
            .map(|board| request(board.id))
            .collect::<Result<_, _>>()?;
        let mut driver = Self {
            name: config.name.clone(),
            config: config.session,
            state: State {
                stage: Stage::Closed,
                master: Master::new(master_config(config)),
                session: Session::new(&config.boards)?,
                to_process: vec![0.0; measured.map(HostBoard::measured).sum()],
                boards,
                frame,
                awaited: false,
                carried: false,
                cycles: EventTiming::new(config.session.nominal_period()),
                begun: HostTime::default(),
                longest_ns: 0,
                implausible: 0,
                held: 0,
                failed: None,
            },
        };
        driver.state.publish();
        Ok(driver)
    }

    fn advance(&mut self, now: HostTime) {
        self.state.advance(now, &self.config);
    }
}

impl State {
    fn advance(&mut self, now: HostTime, config: &SessionConfig) {
        match self.stage {
            Stage::Closed | Stage::Open => {}
            Stage::Opening | Stage::Closing => {
                let (session, master) = (&mut self.session, &mut self.master);
                let advanced = session.advance(now, config, master, &mut self.boards);
                if let Err(reason) = advanced {
                    self.failed = Some(reason);
                    self.stage = Stage::Closed;
                } else if self.session.is_idle() {
                    self.publish();
                    self.master.end_startup();
                    self.stage = match self.stage {
                        Stage::Opening => Stage::Open,
                        _ => Stage::Closed,
                    };
                }
            }
            Stage::Failing(until) => self.await_late_answers(now, until),
            Stage::Cycling => {
                if !self.master.is_busy() {
                    self.end_cycle(now);
                    if config.free_running && self.stage == Stage::Open {
                        self.begin_cycle(now);
                    }
                }
            }
        }
    }

    fn begin_cycle(&mut self, now: HostTime) {
        self.stage = Stage::Cycling;
        self.carried = self.awaited;
        self.begun = now;
        self.cycles.record(now.as_nanos());
        self.master
            .cycle(now, &self.frame)
            .expect("the master is idle, and the frame was checked");
    }

    fn end_cycle(&mut self, now: HostTime) {
        self.stage = Stage::Open;
        if self.carried {
            self.awaited = false;
        }
        let lasted = now.as_nanos().saturating_sub(self.begun.as_nanos());
        self.longest_ns = self.longest_ns.max(lasted);
        let mut implausible = [None; FRAME_MAX];
        let used = self.boards.iter_mut().filter(|board| board.is_used());
        for (n, (board, outcome)) in used.zip(self.master.outcomes()).enumerate() {
            match outcome {
                Ok(_) if self.master.is_doubtful(n) => self.held += 1,
                Ok(payload) => match Reply::parse(payload) {
                    Some(reply) if board.store(&reply, self.begun) => {}
                    _ => {
                        self.implausible += 1;
                        implausible[n] = Some(self.frame[n].to);
                    }
                },
                Err(_) => self.held += 1,
            }
        }
        for from in implausible.into_iter().flatten() {
            self.master.record_implausible(from, now);
        }
        self.check_threshold(now);
        self.publish();
    }

    fn has_shafts(&self) -> bool {
        self.boards.iter().any(HostBoard::is_shaft)
    }

    fn publish(&mut self) {
        let mut rest = self.to_process.as_mut_slice();
        for board in self.boards.iter().filter(|board| board.is_used()) {
            let (values, others) = rest.split_at_mut(board.measured());
            board.write(values);
            rest = others;
        }
    }
}

impl Driver for MotorDriver {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        let used = self.state.boards.iter().filter(|board| board.is_used());
        used.flat_map(HostBoard::ports).collect()
    }

    fn open(&mut self, now: HostTime) {
        self.state.stage = Stage::Opening;
        self.state.session.open();
        self.advance(now);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        let state = &mut self.state;
        let used = state.boards.iter_mut().filter(|board| board.is_used());
        let mut rest = from_process;
        for (board, request) in used.zip(&mut state.frame) {
            let (commands, others) = rest.split_at(board.commanded());
            rest = others;
            let goals = board.goals(commands);
            *request = Request::new(request.to, request.instruction, &command_bytes(goals))
                .expect("four bytes are fewer than a packet holds");
        }
        // A scenario without used boards has nothing to exchange.
        state.awaited = !state.frame.is_empty();
        if state.awaited && state.stage == Stage::Open && state.failed.is_none() {
            state.begin_cycle(now);
        }
    }

    fn close(&mut self, now: HostTime) {
        let opened = self.state.stage != Stage::Closed || self.state.failed.is_some();
        if opened {
            self.state.master.abort(now);
            self.state.awaited = false;
            self.state.failed = None;
            self.state.stage = Stage::Closing;
            self.state.session.close();
            self.advance(now);
        }
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        self.state.master.handle_bytes(now, bytes);
        self.advance(now);
    }

    fn handle_timeout(&mut self, now: HostTime) {
        let due = self.state.master.poll_timeout();
        if due.is_some_and(|at| at <= now) {
            self.state.master.handle_timeout(now);
        }
        self.advance(now);
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        let (master, session) = (
            self.state.master.poll_timeout(),
            self.state.session.timeout(),
        );
        let failing = match self.state.stage {
            Stage::Failing(until) => Some(until),
            _ => None,
        };
        master.into_iter().chain(session).chain(failing).min()
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        self.state.master.poll_transmit(bytes)
    }

    fn is_busy(&self) -> Result<bool, DriverError> {
        let state = &self.state;
        if let Some(reason) = &state.failed {
            return Err(DriverError {
                why: reason.clone(),
            });
        }
        Ok(match state.stage {
            Stage::Opening | Stage::Closing | Stage::Failing(_) => true,
            Stage::Cycling => state.awaited,
            Stage::Open | Stage::Closed => false,
        })
    }

    fn to_process(&self) -> &[f64] {
        &self.state.to_process
    }

    fn diagnostics(&self) -> Vec<Port> {
        let diagnostic = |(name, unit)| Port::output(format!("{}/{name}", self.name), unit, 1);
        let timing = EventTiming::ports(&format!("{}/cycle", self.name));
        let of_shafts = self.state.has_shafts().then_some(("ambiguous", Unit::One));
        DIAGNOSTICS
            .into_iter()
            .map(diagnostic)
            .chain(timing)
            .chain(of_shafts.map(diagnostic))
            .collect()
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        let state = &self.state;
        let bus = state.master.counters();
        let sum = |of: fn(&HostBoard) -> u64| state.boards.iter().map(of).sum::<u64>() as f64;
        let tried = (bus.answers + bus.errors).max(1);
        let (counters, rest) = values.split_at_mut(DIAGNOSTICS.len());
        let timing = state.cycles.values();
        let (first, of_shafts) = rest.split_at_mut(timing.len());
        first.copy_from_slice(&timing);
        if state.has_shafts() {
            of_shafts[0] = sum(HostBoard::ambiguous);
        }
        counters.copy_from_slice(&[
            (bus.requests - bus.transfers) as f64,
            bus.answers as f64,
            bus.errors as f64,
            bus.cycles as f64,
            bus.transfers as f64,
            bus.strays as f64,
            bus.garbage as f64,
            bus.damaged as f64,
            bus.drain_timeouts as f64,
            state.implausible as f64,
            state.held as f64,
            sum(HostBoard::saturated),
            sum(HostBoard::encoder_faults),
            1.0 - bus.errors as f64 / tried as f64,
            state.longest_ns as f64 * 1e-9,
        ]);
    }

    fn bus_health(&self, now: HostTime) -> Option<BusHealth> {
        Some(self.state.bus_health(now, &self.config))
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.name, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (name, state): (String, State) = snapshot.read()?;
        if name != self.name || state.boards.len() != self.state.boards.len() {
            return Err(SnapshotError::Mismatch {
                expected: self.name.clone(),
                found: name,
            });
        }
        self.state = state;
        Ok(())
    }
}
