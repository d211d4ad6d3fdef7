use serde::{Deserialize, Serialize};
use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Driver, DriverError};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{Address, Instruction, Master, Request};

use crate::bus::master_config;
use crate::config::{BusConfig, SessionConfig};
use crate::error::BusError;
use crate::event_timing::EventTiming;
use crate::leg::{Leg, MEASURED};
use crate::reply::{COMMAND_LEN, Reply, command_bytes};
use crate::session::Session;

/// Host driver of the motordriver boards: initialises them, exchanges set-points for measurements
/// once per cycle with all used boards (the *scheduled* workflow), and leaves them coasting.
///
/// For every leg its inputs are `leg/LF/hip/command` and `leg/LF/knee/command` \[rad\], its outputs
/// `leg/LF/hip/position`, `leg/LF/knee/position` \[rad\], `leg/LF/angles` \[rad\] (magnetic
/// encoders) and `leg/LF/foot/force` \[N\]. The outputs of a board that did not answer keep their
/// last values.
///
/// Diagnostics, `sbcp/…`, counted from the creation of the driver:
///
/// - `packets` (requests written), `answers`, `errors`, `cycles`, `transfers` (single registers),
///   `strays`, `garbage`, `damaged`, `drain_timeouts`: see [`twinrig_sbcp::MasterCounters`];
///   `success`, the fraction of requests with a valid answer;
/// - `held`, missing replies; `implausible`, replies with a correct checksum that no board sends;
///   `saturated`, set-points out of range; `encoder_faults`, words of magnetic encoders with a
///   fault status;
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
    legs: Vec<Leg>,
    /// One request per used leg.
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
        let legs: Vec<Leg> = config.boards.iter().map(Leg::new).collect();
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
                legs,
                to_process: vec![0.0; MEASURED * frame.len()],
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
                let advanced = session.advance(now, config, master, &mut self.legs);
                if let Err(reason) = advanced {
                    self.failed = Some(reason);
                    self.stage = Stage::Closed;
                } else if self.session.is_idle() {
                    self.publish();
                    self.stage = match self.stage {
                        Stage::Opening => Stage::Open,
                        _ => Stage::Closed,
                    };
                }
            }
            Stage::Cycling => {
                if !self.master.is_busy() {
                    self.end_cycle(now);
                    if config.free_running && self.failed.is_none() {
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
        let mut last = None;
        let legs = self.legs.iter_mut().filter(|leg| leg.is_used());
        for (leg, outcome) in legs.zip(self.master.outcomes()) {
            match outcome {
                Ok(payload) => match Reply::parse(payload) {
                    Some(reply) if leg.store(&reply) => {}
                    _ => self.implausible += 1,
                },
                Err(failure) => {
                    self.held += 1;
                    last = Some((leg, failure));
                }
            }
        }
        if let Some((leg, failure)) = last
            && self.master.error_threshold_reached()
        {
            let errors = self.master.counters().errors;
            let threshold = self.master.config().error_threshold;
            self.failed = Some(format!(
                "{leg}: {failure} (error {errors}; the bus is given up at {threshold})"
            ));
        }
        self.publish();
    }

    fn publish(&mut self) {
        let used = self.legs.iter().filter(|leg| leg.is_used());
        for (leg, values) in used.zip(self.to_process.chunks_exact_mut(MEASURED)) {
            leg.write(values);
        }
    }
}

impl Driver for MotorDriver {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        let used = self.state.legs.iter().filter(|leg| leg.is_used());
        used.flat_map(Leg::ports).collect()
    }

    fn open(&mut self, now: HostTime) {
        self.state.stage = Stage::Opening;
        self.state.session.open();
        self.advance(now);
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        let state = &mut self.state;
        let used = state.legs.iter_mut().filter(|leg| leg.is_used());
        let commands = from_process.chunks_exact(2);
        for ((leg, angles), request) in used.zip(commands).zip(&mut state.frame) {
            let goals = leg.goals([angles[0], angles[1]]);
            *request = Request::new(request.to, request.instruction, &command_bytes(goals))
                .expect("four bytes are fewer than a packet holds");
        }
        // A scenario without used legs has nothing to exchange.
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
        master.into_iter().chain(session).min()
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
            Stage::Opening | Stage::Closing => true,
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
        DIAGNOSTICS
            .into_iter()
            .map(diagnostic)
            .chain(timing)
            .collect()
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        let state = &self.state;
        let bus = state.master.counters();
        let sum = |of: fn(&Leg) -> u64| state.legs.iter().map(of).sum::<u64>() as f64;
        let tried = (bus.answers + bus.errors).max(1);
        let (counters, timing) = values.split_at_mut(DIAGNOSTICS.len());
        timing.copy_from_slice(&state.cycles.values());
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
            sum(|leg| leg.saturated),
            sum(|leg| leg.encoder_faults),
            1.0 - bus.errors as f64 / tried as f64,
            state.longest_ns as f64 * 1e-9,
        ]);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.name, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (name, state): (String, State) = snapshot.read()?;
        if name != self.name || state.legs.len() != self.state.legs.len() {
            return Err(SnapshotError::Mismatch {
                expected: self.name.clone(),
                found: name,
            });
        }
        self.state = state;
        Ok(())
    }
}
