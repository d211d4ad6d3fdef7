use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    BoardClock, LocalTime, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit,
};
use twinrig_runtime::{BusHealth, Part, PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{AnswerPolicy, SbcpError, Slave, SlaveConfig, SlaveEvent};
use twinrig_wire::{Addresses, Node, Piece};

use crate::clock_check::ClockCheck;
use crate::config::{Attachment, BoardConfig, FirmwareConfig, Generation};
use crate::event_timing::EventTiming;
use crate::firmware::{Firmware, TICK};
use crate::registers::{Measured, MotorRegister, table};
use crate::reply::{COMMAND_LEN, Reply, command};
use crate::units::{Joint, Scale, force_word, magnetic_word};
use crate::wiring::Signals;

/// Volts per unit of duty: 24 V / 2¹⁵.
const VOLTS_PER_DUTY: f64 = 24.0 / 32_768.0;

/// Emulated motordriver board: processor with its own clock, bus interface, and its motors and
/// sensors in the plant.
///
/// It samples and actuates at its ticks, once per millisecond of its own time. It reads
/// `leg/LF/hip/position` and `leg/LF/knee/position` \[rad\], and where the plant has them
/// `leg/LF/angles` \[rad\] and `leg/LF/foot/force` \[N\]; it writes `leg/LF/hip/voltage` \[V\] and
/// `leg/LF/hip/bridge` (1 while the motor is driven, 0 while it coasts), and likewise for the knee.
/// The board of a free shaft reads `motor/cam/position` \[rad\], without bounds, and writes
/// `motor/cam/voltage` and `motor/cam/bridge`; its second motor is not connected.
///
/// Diagnostics, `sbcp/LF/…`, counted from the first power-on:
///
/// - `missed_points`, `filled_steps`, `lost_points`, `watchdog_drops`: faults of the set-point
///   stream (thesis, section 5.3.3 and table 5.4); `saturated`: forces out of the sensor's range;
/// - `requests`: requests of the cycle. Their arrival times, in physical time at the last bit (with
///   the first firmware: at their processing by the main loop), enter the same statistics as the
///   cycles of [`MotorDriver`](crate::MotorDriver): of the intervals `request/mean`,
///   `request/shortest`, `request/longest`, `request/half_range`, `request/p50`, `request/p99` and
///   `request/p999` \[s\]; `request/phase/deviation` \[s\], and its alias `request/deviation`;
/// - `response/shortest`, `response/longest` and `response/half_range` \[s\]: time from the last
///   bit of a request of the cycle to the first bit of its answer;
/// - of a free shaft, `lag`: set-point minus position \[counts\]; `stalled`: ticks at which the
///   set-point waited for a shaft that does not follow;
/// - `answers`, `refused`, `damaged`, `garbage`, `framing_errors`, `superseded`, `events_lost`: see
///   [`twinrig_sbcp::SlaveCounters`].
pub struct MotorBoard {
    /// Name of the leg or motor: `LF`.
    name: String,
    id: u8,
    /// Prefix of the diagnostics: `sbcp/LF`.
    prefix: String,
    attachment: Attachment,
    firmware: FirmwareConfig,
    with_bytewise_reception: bool,
    signals: Signals,
    /// Registers of the measurements.
    measured: Measured,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    clock: BoardClock,
    next_tick: LocalTime,
    /// `next_tick` in physical time.
    wake: SimTime,
    slave: Slave,
    firmware: Firmware,
    scales: [Scale; 2],
    /// State of the bridges as last written to the plant: true for closed.
    driven: [bool; 2],
    reply: Reply,
    requests: EventTiming,
    requests_taken: u64,
    saturated: u64,
    clock_check: ClockCheck,
}

/// Time from the return of the supply until a board works. ASSUMED.
const BOOT_TIME: SimDuration = SimDuration::from_millis(50);

/// Returns the end of the first complete tick after power-on.
fn first_tick(clock: &BoardClock, power_on: SimTime) -> LocalTime {
    let (shown, tick) = (clock.local_at(power_on).as_nanos(), TICK.as_nanos());
    LocalTime::from_nanos((shown.div_euclid(tick) + 1) * tick)
}

/// Names and units of a board's diagnostics, without those of the request timing.
const DIAGNOSTICS: [(&str, Unit); 16] = [
    ("missed_points", Unit::One),
    ("filled_steps", Unit::One),
    ("lost_points", Unit::One),
    ("watchdog_drops", Unit::One),
    ("saturated", Unit::One),
    ("requests", Unit::One),
    ("response/shortest", Unit::Second),
    ("response/longest", Unit::Second),
    ("response/half_range", Unit::Second),
    ("answers", Unit::One),
    ("refused", Unit::One),
    ("damaged", Unit::One),
    ("garbage", Unit::One),
    ("framing_errors", Unit::One),
    ("superseded", Unit::One),
    ("events_lost", Unit::One),
];

/// Names and units of the additional diagnostics of the board of a free shaft.
const SHAFT_DIAGNOSTICS: [(&str, Unit); 2] = [("lag", Unit::One), ("stalled", Unit::One)];

impl MotorBoard {
    /// Creates a board at power-on, on the bus of that name.
    ///
    /// # Errors
    /// [`SbcpError::Address`] if the id is not a valid slave address.
    pub fn new(bus: &str, config: &BoardConfig) -> Result<Self, SbcpError> {
        let policy = match config.firmware.generation {
            Generation::First => AnswerPolicy::MainLoop,
            Generation::LowLatency => AnswerPolicy::AtOnce,
        };
        let protocol = SlaveConfig {
            policy,
            low_latency_request: Some(COMMAND_LEN),
            ..SlaveConfig::new(CLASS_MOTORDRIVER)
        };
        let (clock, next_tick) = (config.clock, first_tick(&config.clock, SimTime::ZERO));
        let limits = config.position_limits;
        let scale = |n: usize| match config.attachment {
            Attachment::Leg { side } => Scale::new(Joint::ALL[n], side, limits[n]),
            Attachment::Shaft => Scale::free(),
        };
        let registers = table(config)?;
        Ok(Self {
            measured: Measured::in_table(&registers),
            name: config.name.clone(),
            id: config.id,
            prefix: format!("{bus}/{}", config.name),
            attachment: config.attachment,
            firmware: config.firmware,
            with_bytewise_reception: false,
            signals: Signals::default(),
            state: State {
                clock,
                next_tick,
                wake: clock.sim_at(next_tick),
                slave: Slave::new(protocol, registers)?,
                firmware: Firmware::new(config.firmware, limits),
                scales: [scale(0), scale(1)],
                driven: [false; 2],
                reply: Reply::default(),
                requests: EventTiming::new(None),
                requests_taken: 0,
                saturated: 0,
                clock_check: ClockCheck::default(),
            },
        })
    }

    /// Enables byte-wise reception for a bus on which packets may follow one another without a gap:
    /// each byte that may complete a packet then is processed on its arrival. This costs time and
    /// makes no difference otherwise, because master and bus controller send single packets.
    #[must_use]
    pub fn with_bytewise_reception(self, with_bytewise_reception: bool) -> Self {
        Self {
            with_bytewise_reception,
            ..self
        }
    }

    /// Sets the nominal period of requests, the grid of `request/phase/deviation`. `None`, the
    /// default, if requests come as fast as the bus permits.
    #[must_use]
    pub fn with_nominal_period(mut self, period: Option<Duration>) -> Self {
        self.state.requests = EventTiming::new(period);
        self
    }
}

impl State {
    /// Starts from the saved registers; the counters go on.
    fn power_on(&mut self, now: SimTime, config: FirmwareConfig) {
        self.slave.power_cycle();
        let registers = self.slave.registers();
        let limit = |motor| registers.get(MotorRegister::PositionLimit.address(motor));
        let limits = [0, 1].map(|motor| limit(motor).unwrap_or_default());
        self.firmware.power_cycle(config, limits);
        self.next_tick = first_tick(&self.clock, now);
        self.wake = self.clock.sim_at(self.next_tick);
    }

    fn tick(
        &mut self,
        now: SimTime,
        signals: &Signals,
        measured: &Measured,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        self.next_tick = self.next_tick + TICK;
        self.wake = self.clock.sim_at(self.next_tick);
        let positions = self.measure(signals, measured, plant)?;
        self.slave
            .set_reply(&self.reply.bytes())
            .expect("a reply is shorter than a packet");
        self.slave.main_loop(now);
        self.process_events();
        let calibrating = self.firmware.is_calibrating();
        let duties = self.firmware.tick(positions);
        if calibrating {
            self.update_mode_registers();
        }
        self.drive(duties, signals, plant)
    }

    /// Commands the bridges by the duties of the motors; `None` for an open bridge.
    #[inline]
    fn drive(
        &mut self,
        duties: [Option<i32>; 2],
        signals: &Signals,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        for (n, (duty, motor)) in duties.into_iter().zip(&signals.motors).enumerate() {
            let driven = duty.is_some();
            if let Some(duty) = duty {
                let volts = self.scales[n].signed(f64::from(duty) * VOLTS_PER_DUTY);
                plant.actuate(motor.voltage.clone())?[0] = volts;
            }
            if driven != self.driven[n] {
                self.driven[n] = driven;
                plant.actuate(motor.bridge.clone())?[0] = f64::from(u8::from(driven));
                if !driven {
                    plant.actuate(motor.voltage.clone())?[0] = 0.0;
                }
            }
        }
        Ok(())
    }

    /// Samples the sensors into reply and registers, and returns the positions of the motors
    /// \[counts\].
    fn measure(
        &mut self,
        signals: &Signals,
        measured: &Measured,
        plant: &mut dyn PlantAccess,
    ) -> Result<[i32; 2], TaskError> {
        let registers = self.slave.registers_mut();
        let sampled = plant.sample(signals.sampled.clone())?;
        let mut positions = [0; 2];
        for (n, &place) in signals.positions.iter().enumerate() {
            positions[n] = self.scales[n].counts(sampled[place]);
            let word = Scale::position_word(positions[n]);
            self.reply.positions[n] = word;
            registers.set(measured.positions[n], word);
        }
        if let Some(range) = &signals.angles {
            for (n, angle) in sampled[range.clone()].iter().take(3).enumerate() {
                let word = magnetic_word(*angle);
                self.reply.magnetic[n] = word;
                registers.set(measured.magnetic[n], word);
            }
        }
        if let Some(range) = &signals.force {
            for (n, newtons) in sampled[range.clone()].iter().take(3).enumerate() {
                let (word, saturated) = force_word(*newtons);
                self.reply.force[n] = word;
                self.saturated += u64::from(saturated);
                registers.set(measured.force[n], word);
            }
        }
        Ok(positions)
    }

    /// Executes the requests received from the master since the last call.
    fn process_events(&mut self) {
        while let Some(event) = self.slave.poll_event() {
            match event {
                SlaveEvent::LowLatency { at, payload } => {
                    self.requests.record(at.as_nanos());
                    self.requests_taken += 1;
                    if let Some(goals) = command(&payload) {
                        let firmware = &mut self.firmware;
                        firmware.command(goals);
                        let (period, counts) = (firmware.smooth_period(), firmware.smooth_counts());
                        self.clock_check.count_point(period, counts, at);
                    }
                }
                SlaveEvent::Written { address, value, .. } => {
                    self.firmware.written(address, value);
                    self.update_mode_registers();
                }
                SlaveEvent::Saved { .. } => {}
            }
        }
    }

    fn update_mode_registers(&mut self) {
        for motor in 0..2 {
            let mode = self.firmware.mode_register(motor);
            self.slave
                .registers_mut()
                .put(MotorRegister::Mode.address(motor), mode)
                .expect("every motor has a mode");
        }
    }
}

impl Part for MotorBoard {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.signals = Signals::find(owner, &self.name, self.attachment, plant)?;
        Ok(())
    }

    fn diagnostics(&self) -> Vec<Port> {
        let diagnostic = |(name, unit)| Port::output(format!("{}/{name}", self.prefix), unit, 1);
        let timing = EventTiming::ports(&format!("{}/request", self.prefix));
        let of_shaft: &[_] = match self.attachment {
            Attachment::Leg { .. } => &[],
            Attachment::Shaft => &SHAFT_DIAGNOSTICS,
        };
        DIAGNOSTICS
            .into_iter()
            .map(diagnostic)
            .chain(timing)
            .chain(of_shaft.iter().copied().map(diagnostic))
            .collect()
    }

    fn read_diagnostics(&self, _now: SimTime, values: &mut [f64]) {
        let State {
            slave,
            firmware,
            requests,
            requests_taken,
            saturated,
            ..
        } = &self.state;
        let (smooth, bus) = (firmware.smooth_counts(), slave.counters());
        let shortest = bus.response_shortest.as_secs_f64();
        let longest = bus.response_longest.as_secs_f64();
        let (counters, rest) = values.split_at_mut(DIAGNOSTICS.len());
        let timing = requests.values();
        let (first, of_shaft) = rest.split_at_mut(timing.len());
        first.copy_from_slice(&timing);
        if self.attachment == Attachment::Shaft {
            let velocity = firmware.velocity(0);
            of_shaft.copy_from_slice(&[velocity.lag(), velocity.stalled() as f64]);
        }
        counters.copy_from_slice(&[
            smooth.missed as f64,
            smooth.filled as f64,
            smooth.lost as f64,
            firmware.watchdog_drops() as f64,
            *saturated as f64,
            *requests_taken as f64,
            shortest,
            longest,
            0.5 * (longest - shortest),
            bus.answers as f64,
            bus.refused as f64,
            bus.damaged as f64,
            bus.garbage as f64,
            bus.framing_errors as f64,
            bus.superseded as f64,
            bus.events_lost as f64,
        ]);
    }

    fn report_health(&self, health: &mut BusHealth) {
        let board = format!("board {} (id {})", self.name, self.id);
        let counts = self.state.firmware.smooth_counts();
        self.state.clock_check.report(board, counts, health);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.name, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (name, state): (String, State) = snapshot.read()?;
        if name != self.name {
            return Err(SnapshotError::Mismatch {
                expected: self.name.clone(),
                found: name,
            });
        }
        self.state = state;
        Ok(())
    }
}

impl Node for MotorBoard {
    fn name(&self) -> &str {
        &self.name
    }

    fn receive(&mut self, piece: Piece<'_>) {
        self.state.slave.receive(piece);
        self.state.process_events();
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        self.with_bytewise_reception
            .then(|| self.state.slave.min_bytes_needed())
    }

    fn listens_to(&self, spacing: SimDuration) -> Option<Addresses> {
        if self.with_bytewise_reception {
            return None;
        }
        self.state.slave.packet_address(spacing).map(Addresses::one)
    }

    fn boot_time(&self) -> Option<SimDuration> {
        Some(BOOT_TIME)
    }

    fn power_off(&mut self, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.state.drive([None; 2], &self.signals, plant)
    }

    fn power_on(&mut self, now: SimTime) {
        self.state.power_on(now, self.firmware);
    }

    fn next_wake(&self) -> Option<SimTime> {
        Some(self.state.wake)
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while self.state.wake <= now {
            self.state.tick(now, &self.signals, &self.measured, plant)?;
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.state.slave.poll_transmit(bytes)
    }
}
