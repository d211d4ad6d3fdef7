use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{BoardClock, BoardClockError, LocalDuration, SimDuration};
use twinrig_sbcp::{BYTE_TIME, ControllerConfig};
use twinrig_wire::{FaultSchedule, UsbTiming};

use crate::units::{CONTINUOUS, POSITION_MASK, Side};

/// ASSUMED: switching time of the near end's RS-485 transceiver from transmit to receive.
const TURNAROUND: SimDuration = SimDuration::from_micros(2);

/// Configuration of a bus: host, transport and boards.
#[derive(Clone, Debug, PartialEq)]
pub struct BusConfig {
    /// Name of the bus and of its driver, prefix of all diagnostics: `sbcp`.
    pub name: String,
    /// Boards. LF, RF, LH and RH with the ids 1 to 4, all used.
    pub boards: Vec<BoardConfig>,
    /// Connection of USB converter and boards: through a bus controller.
    pub topology: BusTopology,
    /// Timing of USB: [`UsbTiming::default`].
    pub usb: UsbTiming,
    /// Time of a byte, ten bits at 3.333 Mbit/s: 3 µs.
    pub byte_time: SimDuration,
    /// Switching time from transmit to receive at the near end of the RS-485 bus: 2 µs, ASSUMED.
    pub turnaround: SimDuration,
    /// Session of the host with the boards.
    pub session: SessionConfig,
    /// Fault schedule. Places: [`BusConfig::place`] for the whole bus, [`BusConfig::link_place`]
    /// for the link between host and bus, [`BusConfig::board_place`] for one board. Default: empty.
    pub faults: FaultSchedule,
    /// Seed of all random quantities of the transport: 0.
    pub seed: u64,
    /// Whether the bytes on the RS-485 bus are traced in addition to those at the host: false.
    pub trace: bool,
    /// Whether the emulated bus computes undisturbed packets as a whole: true. The results are the
    /// same bit for bit; byte by byte is the reference.
    pub packet_level: bool,
}

/// Connection of USB converter and boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusTopology {
    /// Direct: the converter is on the bus (thesis, figure 5.7, bottom).
    Direct,
    /// Through a bus controller (thesis, section 5.3.2).
    Controller(ControllerConfig),
}

/// Configuration of one board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardConfig {
    /// Name of its leg or motor in signals, diagnostics and faults: `LF`.
    pub name: String,
    /// Id on the bus.
    pub id: u8,
    /// Mechanism that the board drives: a leg on the left side.
    pub attachment: Attachment,
    /// Whether the board is on the bus: true.
    pub present: bool,
    /// Whether the driver uses the board: true. An unused board may be absent.
    pub used: bool,
    /// Set-point following of the motors of a leg: smooth.
    pub following: Following,
    /// Clock of the board: ideal.
    pub clock: BoardClock,
    /// Ranges of hip and knee \[counts of 4096 per turn\]: 1200 and 1350 (public user of the SBCP
    /// library, 2013). Host and board have to agree on them: the host reads them from the board.
    /// Bit 15 of a limit permits continuous rotation (ASSUMED).
    pub position_limits: [u16; 2],
    /// Firmware of the board's processor.
    pub firmware: FirmwareConfig,
}

/// Mechanism that a board drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attachment {
    /// A leg: hip and knee, each within its range.
    Leg {
        /// Side of the leg.
        side: Side,
    },
    /// A shaft that rotates without limit, on the first motor, with commanded speed. The second
    /// motor coasts and is not connected.
    Shaft,
}

/// Firmware of a board's processor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FirmwareConfig {
    /// Generation of the answer path.
    pub generation: Generation,
    /// Interpolation of set-points.
    pub interpolation: Interpolation,
}

/// Generation of a board's answer path (thesis, section 5.3.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Generation {
    /// Answers from the main loop, once per millisecond.
    First,
    /// Answers immediately, from a reply prepared in advance.
    #[default]
    LowLatency,
}

/// Interpolation under clock mismatch and loss of data (thesis, section 5.3.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Interpolation {
    /// Heuristics: overflow buffer, shorter periods while it is not empty, half the speed on
    /// underflow, reset of the clock.
    #[default]
    Smooth,
    /// No heuristics: an early point is lost, an underflow holds the position.
    WithoutHeuristics,
}

/// Mode in which motors follow their set-points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Following {
    /// Smooth interpolation between set-points.
    #[default]
    Smooth,
    /// Position controller on the last set-point, no interpolation: stutters (thesis, figure 5.9).
    Plain,
}

/// Session of the host with the boards. The defaults are those of the original software (public
/// liboncilla-hw sources, 2014).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionConfig {
    /// Nominal time between two cycles: 2 ms. The boards receive it rounded to whole milliseconds,
    /// at least 2. For a host whose clock is off by less than a thousandth this is the true length
    /// of a period.
    pub period: Duration,
    /// Values written into the registers of the motors.
    pub gains: SessionGains,
    /// Number of errors at which the run ends; negative: never. Default: 1.
    pub error_threshold: i64,
    /// Time after which calibration has failed: 5 s. The original software had no such limit.
    pub calibration_timeout: Duration,
    /// Time between two polls of the calibration state: 100 ms.
    pub calibration_poll: Duration,
    /// Time-out of a packet or frame of a cycle. `None`: derived from topology, USB and firmware:
    /// through the bus controller 2 ms; directly a round trip and two microframes (895 µs), more
    /// with a latency timer, long microframes or the first firmware. Single requests, as during
    /// initialisation, have a time-out of 20 ms, or this one if it is longer.
    pub cycle_timeout: Option<Duration>,
    /// Whether each cycle begins as soon as the last one ends, with the set-points of the last
    /// transfer until the controller has new ones, which shows the maximum rate of the bus: false.
    pub free_running: bool,
}

/// Values written into the registers of each motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionGains {
    /// Proportional: 400.
    pub p: u16,
    /// Integral: 20.
    pub i: u16,
    /// Derivative: 200.
    pub d: u16,
    /// Stiffness: 0; without effect.
    pub stiffness: u16,
    /// Damping: 0; without effect.
    pub damping: u16,
    /// Preload: 1100; without effect.
    pub preload: u16,
    /// Maximum current in units of 20 mA (ASSUMED): 1100.
    pub max_torque: u16,
    /// Maximum speed of the interpolation and of velocity mode in counts/s (ASSUMED): 32000, which
    /// are 7.8 turns per second.
    pub max_speed: u16,
    /// Maximum acceleration of velocity mode in counts/s² (ASSUMED): 32000; without effect on the
    /// motors of a leg.
    pub max_acceleration: u16,
}

impl Default for BusConfig {
    fn default() -> Self {
        Self {
            name: "sbcp".into(),
            boards: [
                ("LF", 1, Side::Left),
                ("RF", 2, Side::Right),
                ("LH", 3, Side::Left),
                ("RH", 4, Side::Right),
            ]
            .map(|(name, id, side)| BoardConfig {
                name: name.into(),
                id,
                attachment: Attachment::Leg { side },
                ..BoardConfig::default()
            })
            .into(),
            topology: BusTopology::Controller(ControllerConfig::default()),
            usb: UsbTiming::default(),
            byte_time: BYTE_TIME,
            turnaround: TURNAROUND,
            session: SessionConfig::default(),
            faults: FaultSchedule::default(),
            seed: 0,
            trace: false,
            packet_level: true,
        }
    }
}

impl BusConfig {
    /// Returns the fault place of the RS-485 bus: `wire/sbcp`.
    pub fn place(&self) -> String {
        format!("wire/{}", self.name)
    }

    /// Returns the fault place of the link between USB converter and bus controller:
    /// `wire/sbcp/link`.
    pub fn link_place(&self) -> String {
        format!("wire/{}/link", self.name)
    }

    /// Returns the fault place of one board: `wire/sbcp/LF`.
    pub fn board_place(&self, board: &str) -> String {
        format!("wire/{}/{board}", self.name)
    }
}

impl Default for BoardConfig {
    fn default() -> Self {
        Self {
            name: "LF".into(),
            id: 1,
            attachment: Attachment::Leg { side: Side::Left },
            present: true,
            used: true,
            following: Following::Smooth,
            clock: BoardClock::IDEAL,
            position_limits: [1_200, 1_350],
            firmware: FirmwareConfig::default(),
        }
    }
}

impl BoardConfig {
    /// Returns the board of a free shaft: with that name of its motor and that id, and set for
    /// continuous rotation.
    pub fn shaft(name: &str, id: u8) -> Self {
        Self {
            name: name.to_owned(),
            id,
            attachment: Attachment::Shaft,
            position_limits: [CONTINUOUS | POSITION_MASK, 0],
            ..Self::default()
        }
    }

    /// Sets a clock that is fast by `rate_ppb` and whose ticks initially come `phase` after the
    /// whole milliseconds.
    ///
    /// # Errors
    /// [`BoardClockError`] if the rate or offset is invalid.
    pub fn with_clock(self, rate_ppb: i64, phase: SimDuration) -> Result<Self, BoardClockError> {
        let tick = SimDuration::from_millis(1).as_nanos();
        let phase = phase.as_nanos() % tick;
        #[expect(clippy::cast_possible_wrap, reason = "up to a million")]
        let offset = LocalDuration::from_nanos(((tick - phase) % tick) as i64);
        Ok(Self {
            clock: BoardClock::new(offset, rate_ppb)?,
            ..self
        })
    }
}

impl Default for SessionConfig {
    fn default() -> Self {
        Self {
            period: Duration::from_millis(2),
            gains: SessionGains::default(),
            error_threshold: 1,
            calibration_timeout: Duration::from_secs(5),
            calibration_poll: Duration::from_millis(100),
            cycle_timeout: None,
            free_running: false,
        }
    }
}

impl SessionConfig {
    /// Returns the nominal period of cycles; `None` in a free-running session.
    pub(crate) fn nominal_period(&self) -> Option<Duration> {
        (!self.free_running).then_some(self.period)
    }
}

impl Default for SessionGains {
    fn default() -> Self {
        Self {
            p: 400,
            i: 20,
            d: 200,
            stiffness: 0,
            damping: 0,
            preload: 1_100,
            max_torque: 1_100,
            max_speed: 32_000,
            max_acceleration: 32_000,
        }
    }
}
