use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{BoardClock, BoardClockError, LocalDuration, SimDuration};
use twinrig_sbcp::{BYTE_TIME, ControllerConfig};
use twinrig_wire::{FaultSchedule, UsbTiming};

use crate::units::Side;

/// ASSUMED: time that an RS-485 driver of the near end takes from talking to hearing.
const TURNAROUND: SimDuration = SimDuration::from_micros(2);

/// A bus: what runs on the host, what stands between it and the boards, and the boards.
#[derive(Clone, Debug, PartialEq)]
pub struct BusConfig {
    /// Its name, which is the driver's, and with which all gauges begin: `sbcp`.
    pub name: String,
    /// The boards. LF, RF, LH and RH with the ids 1 to 4, all used.
    pub boards: Vec<BoardConfig>,
    /// What is between USB converter and boards: a bus controller.
    pub topology: BusTopology,
    /// How long USB takes: [`UsbTiming::default`].
    pub usb: UsbTiming,
    /// Ten bits at 3.333 Mbit/s: 3 µs.
    pub byte_time: SimDuration,
    /// From talking to hearing at the near end of the RS-485 bus: 2 µs, ASSUMED.
    pub turnaround: SimDuration,
    /// What the host does with the boards.
    pub session: SessionConfig,
    /// What goes wrong. On [`BusConfig::place`] for the whole bus, [`BusConfig::link_place`] for what is between the
    /// host and the bus, [`BusConfig::board_place`] for one board. Nothing.
    pub faults: FaultSchedule,
    /// Seed of what is random in the transport: 0.
    pub seed: u64,
    /// Whether the bytes on the RS-485 bus are traced beside those that the host sees: not.
    pub trace: bool,
}

/// What is between USB converter and boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusTopology {
    /// Nothing: the converter is on the bus (thesis, figure 5.7, below).
    Direct,
    /// A bus controller (thesis, section 5.3.2).
    Controller(ControllerConfig),
}

/// One board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardConfig {
    /// Name of its leg in signals, gauges and faults: `LF`.
    pub name: String,
    /// Its id on the bus.
    pub id: u8,
    /// On which side its leg is.
    pub side: Side,
    /// Whether it is on the bus at all: it is.
    pub present: bool,
    /// Whether the driver uses it. It is no error that a board is missing which is not used.
    pub used: bool,
    /// How its motors follow: smoothly.
    pub following: Following,
    /// Its clock: perfect.
    pub clock: BoardClock,
    /// Ranges of hip and knee \[counts of 4096 a turn\]: 1200 and 1350 (public user of the SBCP library, 2013). Host
    /// and board have to agree about it: the host reads it from the board.
    pub position_limits: [u16; 2],
    /// What its processor runs.
    pub firmware: FirmwareConfig,
}

/// What the processor of a board runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FirmwareConfig {
    /// How it answers.
    pub generation: Generation,
    /// What it does with set-points.
    pub interpolation: Interpolation,
}

/// How a board answers (thesis, section 5.3.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Generation {
    /// When its main loop comes round, once a millisecond.
    First,
    /// At once, from a reply made beforehand.
    #[default]
    LowLatency,
}

/// What smooth interpolation is worth where clocks differ and bytes are lost (thesis, section 5.3.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Interpolation {
    /// Overflow buffer, shorter periods while it is not empty, half the speed on underflow, reset of the clock.
    #[default]
    Smooth,
    /// Without all of them: a point that comes too early is lost, an empty deadline holds still.
    WithoutHeuristics,
}

/// How motors follow their set-points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Following {
    /// Smooth interpolation between set-points.
    #[default]
    Smooth,
    /// The position controller alone, on the last set-point: stutters (thesis, figure 5.9).
    Plain,
}

/// What the host does with the boards: the defaults are those of the original software (public liboncilla-hw sources,
/// 2014).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionConfig {
    /// Nominal time between two cycles: 2 ms. What the boards are told is this in whole milliseconds, and at least 2; a
    /// host whose clock is off by less than a thousandth says here how long a period really is.
    pub period: Duration,
    /// What is written into the motors' registers.
    pub gains: SessionGains,
    /// Errors at which the run ends; negative: never. 1.
    pub error_threshold: i64,
    /// After which calibration has failed: 5 s. The original software had none.
    pub calibration_timeout: Duration,
    /// Time between two looks whether calibration is over: 100 ms.
    pub calibration_poll: Duration,
    /// Time-out of a packet or frame of a cycle; None for what topology, USB and firmware want: through the bus controller 2 ms,
    /// directly a round trip and two microframes (895 µs), more with a latency timer, long microframes or the first firmware.
    pub cycle_timeout: Option<Duration>,
    /// Whether the next cycle begins as soon as one is over, with the set-points of the last transfer, until the
    /// controller has new ones: the rate that a bus can do shows. Not.
    pub free_running: bool,
}

/// What is written into the registers of each motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionGains {
    /// Proportional: 400.
    pub p: u16,
    /// Integral: 20.
    pub i: u16,
    /// Derivative: 200.
    pub d: u16,
    /// 0; without effect.
    pub stiffness: u16,
    /// 0; without effect.
    pub damping: u16,
    /// 1100; without effect.
    pub preload: u16,
    /// Greatest current in units of 20 mA (ASSUMED): 1100.
    pub max_torque: u16,
    /// Greatest speed of the interpolation in counts/s (ASSUMED): 32000.
    pub max_speed: u16,
    /// 32000; without effect.
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
                side,
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
        }
    }
}

impl BusConfig {
    /// Where faults of the RS-485 bus are: `wire/sbcp`.
    pub fn place(&self) -> String {
        format!("wire/{}", self.name)
    }

    /// Where faults of the link between USB converter and bus controller are: `wire/sbcp/link`.
    pub fn link_place(&self) -> String {
        format!("wire/{}/link", self.name)
    }

    /// Where faults of one board are: `wire/sbcp/LF`.
    pub fn board_place(&self, board: &str) -> String {
        format!("wire/{}/{board}", self.name)
    }
}

impl Default for BoardConfig {
    fn default() -> Self {
        Self {
            name: "LF".into(),
            id: 1,
            side: Side::Left,
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
    /// The same board with a clock that is fast by `rate_ppb`, and whose tick comes `phase` after the whole
    /// milliseconds at the start.
    ///
    /// # Errors
    /// [`BoardClockError`] if no clock runs like that.
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
    /// The nominal period of cycles; none in a free-running session, whose cycles take as long as they do.
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
