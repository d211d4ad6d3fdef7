use serde::{Deserialize, Serialize};
use twinrig_kernel::HostTime;
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{Address, Instruction, Master, Outcome, Request, RequestError};

use crate::config::{Attachment, BoardConfig, Following, SessionConfig};
use crate::error::BusError;
use crate::host_board::HostBoard;
use crate::registers::{Mode, MotorRegister, RUNTIME_CALIBRATED};
use crate::requests::{Job, configuration, sensor};

/// Attempts per request before the board is considered lost. Lost answers are counted, but do not
/// count towards the error threshold. ASSUMED.
const TRIES: u8 = 10;
/// Attempts where giving up is harmless: probing for a board, and letting it coast. ASSUMED.
const FEW_TRIES: u8 = 3;

/// Initialisation and safe shutdown of the boards: one register at a time, each answer received
/// before the next request (the *lazy* workflow).
///
/// 1. *Probe*: detect the boards on the bus.
/// 2. *Configure*: write the settings, read ranges and modes.
/// 3. *Calibrate* all boards with uncalibrated motors simultaneously, and *poll* them periodically.
/// 4. *Read* all sensors once, as inputs of the first step of the controller.
/// 5. *Activate* the motors at their present positions.
///
/// At the end: *Coast*.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Session {
    stage: Stage,
    board: usize,
    step: usize,
    tries: u8,
    /// A request is in flight.
    in_flight: bool,
    /// Deadline of the calibration.
    calibrated_by: HostTime,
    boards: Vec<Board>,
}

/// State of a board as known to the session.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Board {
    address: Address,
    used: bool,
    /// Connected motors: the first one or both.
    motors: usize,
    /// Mode of the motors while the session is open.
    mode: Mode,
    present: bool,
    /// Whether the motors are calibrated or not connected.
    calibrated: [bool; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Stage {
    /// Idle: not yet open, open, or closed.
    Idle,
    Probe,
    Configure,
    Calibrate,
    /// Waiting for the next poll.
    Wait(HostTime),
    Poll,
    Read,
    Activate,
    Coast,
}

impl Session {
    pub(crate) fn new(boards: &[BoardConfig]) -> Result<Self, BusError> {
        let board = |config: &BoardConfig| {
            Ok(Board {
                address: Address::new(CLASS_MOTORDRIVER, config.id)?,
                used: config.used,
                motors: if config.attachment == Attachment::Shaft {
                    1
                } else {
                    2
                },
                mode: match (config.attachment, config.following) {
                    (Attachment::Shaft, _) => Mode::Velocity,
                    (Attachment::Leg { .. }, Following::Smooth) => Mode::SmoothPosition,
                    (Attachment::Leg { .. }, Following::Plain) => Mode::Position,
                },
                present: false,
                calibrated: [false, config.attachment == Attachment::Shaft],
            })
        };
        Ok(Self {
            stage: Stage::Idle,
            board: 0,
            step: 0,
            tries: 0,
            in_flight: false,
            calibrated_by: HostTime::default(),
            boards: boards.iter().map(board).collect::<Result<_, BusError>>()?,
        })
    }

    pub(crate) fn open(&mut self) {
        self.enter(Stage::Probe);
    }

    pub(crate) fn close(&mut self) {
        self.enter(Stage::Coast);
    }

    /// Returns whether no stage is in progress.
    pub(crate) fn is_idle(&self) -> bool {
        self.stage == Stage::Idle
    }

    /// Returns the instant at which the session continues without an answer.
    pub(crate) fn timeout(&self) -> Option<HostTime> {
        match self.stage {
            Stage::Wait(until) => Some(until),
            _ => None,
        }
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.board = 0;
        self.step = 0;
        self.tries = 0;
        self.in_flight = false;
    }

    /// Advances until an answer or an instant has to be awaited. `hosts` are the host's views of
    /// the boards.
    ///
    /// # Errors
    /// The reason why the boards cannot be used.
    pub(crate) fn advance(
        &mut self,
        now: HostTime,
        config: &SessionConfig,
        master: &mut Master,
        hosts: &mut [HostBoard],
    ) -> Result<(), String> {
        while !master.is_busy() && self.stage != Stage::Idle {
            if let Stage::Wait(until) = self.stage {
                if now < until {
                    break;
                }
                self.enter(Stage::Poll);
            }
            if self.in_flight {
                self.in_flight = false;
                let outcome = master.outcomes().first().copied();
                let outcome = outcome.unwrap_or(Err(RequestError::NoAnswer));
                self.handle_outcome(outcome, config, master, hosts)?;
            }
            if let Some(job) = self.next_job(config) {
                self.send(now, job, master);
            } else {
                self.next_stage(now, config, hosts)?;
            }
        }
        Ok(())
    }

    fn send(&mut self, now: HostTime, job: Job, master: &mut Master) {
        self.in_flight = true;
        let to = self.boards[self.board].address;
        let (instruction, payload, len) = match job {
            Job::Ping => (Instruction::PING, [0; 3], 0),
            Job::Get(address) => (Instruction::GET, [address, 0, 0], 1),
            Job::Set(address, value) => {
                let [low, high] = value.to_le_bytes();
                (Instruction::SET, [address, low, high], 3)
            }
        };
        let request = Request::new(to, instruction, &payload[..len])
            .expect("three bytes are fewer than a packet holds");
        let begun = if self.stage == Stage::Probe {
            master.probe(now, &request)
        } else {
            master.transfer(now, &request)
        };
        begun.expect("the master is idle");
    }

    /// Returns the next request of the stage, starting at the current board and step.
    fn next_job(&mut self, config: &SessionConfig) -> Option<Job> {
        while self.board < self.boards.len() {
            if let Some(job) = self.job(config) {
                return Some(job);
            }
            self.board += 1;
            self.step = 0;
            self.tries = 0;
        }
        None
    }

    fn job(&self, config: &SessionConfig) -> Option<Job> {
        let board = &self.boards[self.board];
        if self.stage == Stage::Probe {
            return (self.step == 0).then_some(Job::Ping);
        }
        if !(board.used && board.present) {
            return None;
        }
        let step = self.step;
        let mode = |mode: Mode| {
            (step < board.motors).then(|| Job::Set(MotorRegister::Mode.address(step), mode as u16))
        };
        let uncalibrated = board.calibrated != [true; 2];
        match self.stage {
            Stage::Configure => configuration(config, board.motors, step),
            Stage::Calibrate if uncalibrated => mode(Mode::Calibrate),
            Stage::Poll if uncalibrated && step < board.motors => {
                Some(Job::Get(MotorRegister::Mode.address(step)))
            }
            // A shaft has no sensors but its encoder.
            Stage::Read if board.motors == 1 && step > 0 => None,
            Stage::Read => sensor(step).map(Job::Get),
            Stage::Activate => mode(board.mode),
            Stage::Coast => mode(Mode::Coast),
            _ => None,
        }
    }

    fn handle_outcome(
        &mut self,
        outcome: Outcome,
        config: &SessionConfig,
        master: &Master,
        hosts: &mut [HostBoard],
    ) -> Result<(), String> {
        let Some(job) = self.job(config) else {
            return Ok(());
        };
        let host = &mut hosts[self.board];
        let reason = match outcome.map(|payload| self.apply(job, &payload, host)) {
            Ok(true) => {
                self.step += 1;
                self.tries = 0;
                return Ok(());
            }
            Ok(false) => "the length of its answer is wrong".to_owned(),
            Err(failure) => failure.to_string(),
        };
        self.tries += 1;
        let optional = matches!(self.stage, Stage::Probe | Stage::Coast);
        if optional {
            if self.tries >= FEW_TRIES {
                self.step += 1;
                self.tries = 0;
            }
        } else if self.tries >= TRIES {
            let errors = master.counters().errors;
            return Err(format!(
                "{host} failed during initialisation, after {errors} errors in total: {reason}"
            ));
        }
        Ok(())
    }

    /// Processes an answer; returns false if its length does not match the request.
    fn apply(&mut self, job: Job, answer: &[u8], host: &mut HostBoard) -> bool {
        let board = &mut self.boards[self.board];
        match job {
            Job::Ping => board.present = true,
            Job::Set(..) => {}
            Job::Get(address) => {
                let &[low, high] = answer else { return false };
                let value = u16::from_le_bytes([low, high]);
                for motor in 0..2 {
                    if address == MotorRegister::Mode.address(motor) {
                        board.calibrated[motor] = value & RUNTIME_CALIBRATED != 0;
                    } else if address == MotorRegister::PositionLimit.address(motor) {
                        host.set_limit(motor, value);
                    }
                }
                if self.stage == Stage::Read {
                    host.store_word(self.step, value);
                }
            }
        }
        true
    }

    fn next_stage(
        &mut self,
        now: HostTime,
        config: &SessionConfig,
        hosts: &[HostBoard],
    ) -> Result<(), String> {
        let calibrated = self
            .boards
            .iter()
            .filter(|board| board.used && board.present)
            .all(|board| board.calibrated == [true; 2]);
        if self.stage == Stage::Configure {
            let mut used = self
                .boards
                .iter()
                .zip(hosts)
                .filter(|(board, _)| board.used);
            if let Some(reason) = used.find_map(|(_, host)| host.refusal()) {
                return Err(reason);
            }
        }
        let next = match self.stage {
            Stage::Probe => {
                let missing = |(board, _): &(&Board, &HostBoard)| board.used && !board.present;
                if let Some((_, host)) = self.boards.iter().zip(hosts).find(missing) {
                    return Err(format!(
                        "{host} is used but does not answer: is it on the bus, and powered?"
                    ));
                }
                Stage::Configure
            }
            Stage::Configure if !calibrated => Stage::Calibrate,
            Stage::Calibrate => {
                self.calibrated_by = after(now, config.calibration_timeout);
                Stage::Wait(after(now, config.calibration_poll))
            }
            Stage::Poll if !calibrated => {
                if now >= self.calibrated_by {
                    return Err(self.uncalibrated(config, hosts));
                }
                Stage::Wait(after(now, config.calibration_poll))
            }
            Stage::Configure | Stage::Poll => Stage::Read,
            Stage::Read => Stage::Activate,
            Stage::Activate | Stage::Coast | Stage::Idle | Stage::Wait(_) => Stage::Idle,
        };
        self.enter(next);
        Ok(())
    }

    fn uncalibrated(&self, config: &SessionConfig, hosts: &[HostBoard]) -> String {
        let boards = self.boards.iter().zip(hosts);
        let names: Vec<String> = boards
            .filter(|(board, _)| board.used && board.present && board.calibrated != [true; 2])
            .map(|(_, host)| host.to_string())
            .collect();
        let timeout = config.calibration_timeout;
        format!(
            "{} did not end its calibration within {timeout:?}",
            names.join(" and ")
        )
    }
}

/// Returns `now + by`, saturated.
pub(crate) fn after(now: HostTime, by: std::time::Duration) -> HostTime {
    let by = u64::try_from(by.as_nanos()).unwrap_or(u64::MAX);
    HostTime::from_nanos(now.as_nanos().saturating_add(by))
}
