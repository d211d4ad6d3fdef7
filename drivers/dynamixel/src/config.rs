use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_wire::{FaultSchedule, UsbTiming};

use crate::codes::Instruction;
use crate::error::{PacketError, ServoBusError};
use crate::fast::FastAnswer;
use crate::firmware::ServoKind;
use crate::protocol::ProtocolVersion;
use crate::request::{BulkReads, Request};
use crate::table::ServoModel;

/// Servo on a bus.
#[derive(Clone, Debug)]
pub struct ServoConfig {
    /// Name, for messages, diagnostics and faults: `LF/hip`.
    pub name: String,
    /// Kind.
    pub kind: &'static ServoKind,
    /// Identifier.
    pub id: u8,
    /// Values of registers at power-on that differ from the initial ones, by address.
    pub registers: Vec<(u16, i32)>,
    /// Values that the driver writes when it prepares the servo, by address.
    pub settings: Vec<(u16, i32)>,
    /// Signals of the plant.
    pub signals: JointSignals,
    /// Command of the process \[rad\].
    pub command: String,
    /// Voltage of the supply where the plant has none \[V\].
    pub voltage: f64,
    /// Temperature \[°C\].
    pub temperature: f64,
    /// Clock.
    pub clock: BoardClock,
}

impl ServoConfig {
    pub(crate) fn model(&self) -> &'static ServoModel {
        self.kind.model
    }

    /// Rejects a register that the servo does not have, and a value that does not fit into it.
    fn check_value(&self, address: u16, value: i32) -> Result<(), ServoBusError> {
        let servo = || self.name.clone();
        let Some(item) = self.model().item(address) else {
            return Err(ServoBusError::Register {
                servo: servo(),
                address,
            });
        };
        if item.representable(value) == value {
            return Ok(());
        }
        let [least, greatest] = [i32::MIN, i32::MAX].map(|it| item.representable(it));
        Err(ServoBusError::Value {
            servo: servo(),
            register: item.name,
            value,
            least,
            greatest,
        })
    }
}

/// Signals of a servo in the plant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JointSignals {
    /// Angle of the shaft \[rad\].
    pub angle: String,
    /// Its rate \[rad/s\].
    pub rate: String,
    /// Current of the motor \[A\], if the plant has it.
    pub current: String,
    /// Voltage of the supply \[V\], if the plant has it.
    pub supply: String,
    /// Duty cycle of the bridge, −1 to 1.
    pub duty: String,
    /// Whether the bridge is closed: 1, or 0.
    pub bridge: String,
}

impl JointSignals {
    /// Returns the signals of a joint: `leg/LF/hip/position` and so on.
    pub fn of_joint(joint: &str) -> Self {
        let of = |what: &str| format!("{joint}/{what}");
        Self {
            angle: of("position"),
            rate: of("rate"),
            current: of("current"),
            supply: of("supply"),
            duty: of("duty"),
            bridge: of("bridge"),
        }
    }
}

/// Way to read the positions of all servos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReadPattern {
    /// One after the other, each by an instruction of its own.
    Read,
    /// By one instruction, answered by one after the other.
    #[default]
    SyncRead,
    /// The same with registers for each servo.
    BulkRead,
    /// By one instruction, with one answer of all.
    FastSyncRead,
}

/// Bus with its servos.
#[derive(Clone, Debug)]
pub struct ServoBusConfig {
    /// Name of the bus in the scenario.
    pub name: String,
    /// Servos, all with the same protocol and with goal and position at the same addresses.
    pub servos: Vec<ServoConfig>,
    /// Time of a byte.
    pub byte_time: SimDuration,
    /// Way to read the positions.
    pub pattern: ReadPattern,
    /// Nominal period of the transfers.
    pub period: SimDuration,
    /// Time-out of an answer besides its bytes and the return delay.
    pub timeout: SimDuration,
    /// USB converter.
    pub usb: UsbTiming,
    /// Time for which the host receives nothing after its own transmission.
    pub turnaround: SimDuration,
    /// Faults.
    pub faults: FaultSchedule,
    /// Seed of the run.
    pub seed: u64,
}

impl ReadPattern {
    /// All patterns, the default first.
    pub const ALL: [Self; 4] = [
        Self::SyncRead,
        Self::Read,
        Self::BulkRead,
        Self::FastSyncRead,
    ];

    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Read => "one-by-one",
            Self::SyncRead => "sync",
            Self::BulkRead => "bulk",
            Self::FastSyncRead => "fast-sync",
        }
    }

    /// Whether a model has the instruction.
    pub fn is_of(self, model: &ServoModel) -> bool {
        let instruction = match self {
            Self::Read => Instruction::READ,
            Self::SyncRead => Instruction::SYNC_READ,
            Self::BulkRead => Instruction::BULK_READ,
            Self::FastSyncRead if model.protocol == ProtocolVersion::One => return false,
            Self::FastSyncRead => Instruction::FAST_SYNC_READ,
        };
        !model.lacks.contains(&instruction)
    }
}

impl ServoBusConfig {
    /// Rejects servos with the same name or identifier, identifiers out of range, and servos whose
    /// positions cannot be read and written by one instruction.
    pub(crate) fn check(&self) -> Result<(), ServoBusError> {
        for (n, servo) in self.servos.iter().enumerate() {
            let same = |other: &&ServoConfig| other.id == servo.id || other.name == servo.name;
            if let Some(other) = self.servos[..n].iter().find(same) {
                return Err(ServoBusError::Twice {
                    first: other.name.clone(),
                    second: servo.name.clone(),
                });
            }
            let registers = |servo: &ServoConfig| {
                let model = servo.model();
                (model.protocol, model.goal(), model.present())
            };
            if registers(servo) != registers(&self.servos[0]) {
                return Err(ServoBusError::Mixed {
                    first: self.servos[0].name.clone(),
                    second: servo.name.clone(),
                });
            }
            for &(address, value) in servo.registers.iter().chain(&servo.settings) {
                servo.check_value(address, value)?;
            }
            if servo.id > servo.model().protocol.id_max() {
                return Err(ServoBusError::Id {
                    servo: servo.name.clone(),
                    id: servo.id,
                });
            }
        }
        Ok(())
    }

    /// Returns the entries of a bulk read of all servos, if that and their goals fit into packets.
    pub(crate) fn checked_reads(&self) -> Result<Vec<u8>, ServoBusError> {
        let reads = self.bulk_reads().and_then(|reads| {
            self.check_lengths(&reads)?;
            Ok(reads)
        });
        reads.map_err(|source| ServoBusError::Packet {
            servos: self.servos.len(),
            source,
        })
    }

    fn bulk_reads(&self) -> Result<Vec<u8>, PacketError> {
        let mut reads = Vec::new();
        for servo in &self.servos {
            let span = servo.model().present();
            BulkReads::append(self.protocol(), servo.id, span, &mut reads)?;
        }
        Ok(reads)
    }

    /// Checks that goals, whatever they are, and reads of all servos fit into packets.
    fn check_lengths(&self, reads: &[u8]) -> Result<(), PacketError> {
        let Some(model) = self.servos.first().map(ServoConfig::model) else {
            return Ok(());
        };
        let protocol = self.protocol();
        let size = 1 + usize::from(model.goal().length);
        // As many bytes as possible that are stuffed.
        let stuffed = [0xff, 0xff, 0xfd].into_iter().cycle();
        let goals: Vec<u8> = stuffed.take(size * self.servos.len()).collect();
        let goals = Request::SyncWrite {
            span: model.goal(),
            data: &goals,
        };
        let ids: Vec<u8> = self.servos.iter().map(|servo| servo.id).collect();
        let (span, ids) = (model.present(), &ids);
        let read = match self.pattern {
            ReadPattern::Read => Request::Read(span),
            ReadPattern::SyncRead => Request::SyncRead { span, ids },
            ReadPattern::BulkRead => Request::BulkRead(BulkReads::new(protocol, reads)),
            ReadPattern::FastSyncRead => Request::FastSyncRead { span, ids },
        };
        for request in [goals, read] {
            if model.lacks.contains(&request.instruction()) {
                return Err(PacketError::Lacking(request.instruction()));
            }
            request.encode(protocol, ProtocolVersion::BROADCAST, &mut Vec::new())?;
        }
        if self.pattern != ReadPattern::FastSyncRead {
            return Ok(());
        }
        let answer = FastAnswer {
            servos: self.servos.len(),
            data: self.servos.len() * usize::from(model.present().length),
        };
        let (found, most) = (answer.length(), protocol.packet_max());
        if found > most {
            return Err(PacketError::Length { found, most });
        }
        Ok(())
    }

    /// Returns the protocol of the servos.
    pub(crate) fn protocol(&self) -> ProtocolVersion {
        let first = self.servos.first();
        first.map_or(ProtocolVersion::Two, |servo| servo.model().protocol)
    }
}
