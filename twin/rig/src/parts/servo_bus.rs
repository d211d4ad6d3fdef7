//! Buses of serial servos, one at each joint of a leg, from scenario options.

use twinrig_document::{Range, suggestion};
use twinrig_dynamixel::ax::AX12A;
use twinrig_dynamixel::x::{XL330_M288, XM430_W350};
use twinrig_dynamixel::{
    DynamixelDriver, Instruction, JointSignals, Packet, Parser, ProtocolVersion, ReadPattern,
    Received, ServoBusConfig, ServoBusWire, ServoConfig, ServoKind, ServoModel,
};
use twinrig_feetech::{SCS0009, STS3215};
use twinrig_kernel::{BoardClock, Direction as PortDirection, LocalDuration, SimDuration, signal};
use twinrig_scenario::{Accepts, FirmwarePlace, OptionSpec, OptionValue, Options};

use crate::error::BuildError;
use crate::parts::bus_kind::{BusContext, BusKind};
use crate::parts::decoder::{Decoder, Direction};
use crate::parts::option::{choice, number, option};
use crate::parts::usb;

/// Baud rate by default \[bit/s\], which all models have.
const BAUD: u32 = 1_000_000;
/// Bits of a byte with start and stop bit.
const BITS: u64 = 10;
/// Least time-out of an answer by default, besides its bytes and the return delay, and its margin
/// above the times for which the converter holds an answer. ASSUMED.
const TIMEOUT: SimDuration = SimDuration::from_millis(20);
const MARGIN: SimDuration = SimDuration::from_millis(4);
/// Temperature of the servos \[°C\]. ASSUMED.
const TEMPERATURE: f64 = 25.0;
/// Joints of a leg, in the order of the identifiers.
const JOINTS: [&str; 3] = ["hip", "knee", "abduction"];

/// Models by their names in scenarios, the default first.
type Models = &'static [(&'static str, &'static ServoKind)];
const DYNAMIXEL: Models = &[
    ("xl330-m288", &XL330_M288),
    ("xm430-w350", &XM430_W350),
    ("ax-12a", &AX12A),
];
const FEETECH: Models = &[("sts3215", &STS3215), ("scs0009", &SCS0009)];

/// Returns the models of servos on buses, by their names in scenarios.
pub fn servo_models() -> impl Iterator<Item = (&'static str, &'static ServoKind)> {
    DYNAMIXEL.iter().chain(FEETECH).copied()
}

/// Returns the bus kind `dynamixel`.
pub(crate) fn dynamixel() -> BusKind {
    let about = "Dynamixel servos at the joints of the legs, on RS-485 or TTL behind USB; for [actuator] kind = \"serial\", firmware = \"bus\"";
    kind("dynamixel", about, DYNAMIXEL)
}

/// Returns the bus kind `feetech`.
pub(crate) fn feetech() -> BusKind {
    let about = "Feetech servos at the joints of the legs, on TTL behind USB; for [actuator] kind = \"serial\", firmware = \"bus\"";
    kind("feetech", about, FEETECH)
}

fn kind(name: &str, about: &str, models: Models) -> BusKind {
    let config = move |context: &BusContext<'_>| config(context, models);
    let driver = move |context: &BusContext<'_>| -> Result<DynamixelDriver, BuildError> {
        Ok(config(context)?.driver()?)
    };
    let wire = move |context: &BusContext<'_>| -> Result<ServoBusWire, BuildError> {
        Ok(config(context)?.wire()?)
    };
    let measured = ["position", "rate", "current", "supply"];
    let measured = measured.map(|what| signal::of_leg("*", &format!("*/{what}")));
    let kind = BusKind::new(name, about, driver, wire)
        .with_baud(|options| {
            let baud = options.natural("baud");
            baud.and_then(|baud| u32::try_from(baud).ok())
                .unwrap_or(BAUD)
        })
        .with_faults()
        .with_board_faults()
        .with_decoder(move |options, direction| decoder(protocol(models, options), direction))
        .with_frames(move |options| protocol(models, options).frames())
        .measuring(move |_| measured.to_vec());
    let kind = JOINTS
        .into_iter()
        .fold(kind, |kind, joint| kind.with_place(format!("*/{joint}")));
    options(models).into_iter().fold(kind, BusKind::with_option)
}

fn options(models: Models) -> Vec<OptionSpec> {
    let names: Vec<&str> = models.iter().map(|(name, _)| *name).collect();
    let registers = || Accepts::Table(Box::new(number(Range::ANY)));
    vec![
        choice("model", "model of all servos", &names),
        option(
            "first_id",
            "identifier of the first servo (1); the others follow: hip, knee, abduction of each leg",
            Accepts::Natural(0..=252),
        ),
        option(
            "baud",
            "baud rate of bus and port in bit/s (1000000)",
            Accepts::Natural(1..=u64::from(u32::MAX)),
        ),
        option(
            "read",
            "instruction by which positions are read (sync; one-by-one of models without it)",
            Accepts::Choice(ReadPattern::ALL.map(|it| it.name().to_owned()).into()),
        ),
        option(
            "settings",
            "registers that the driver writes when it prepares a servo, by the names of the manual",
            registers(),
        ),
        option(
            "registers",
            "registers of the emulated servos at power-on, by the same names",
            registers(),
        ),
        option(
            "timeout",
            "time-out of an answer besides its bytes and the return delay (20 ms, or 4 ms more than the latency timer)",
            Accepts::PositiveDuration,
        ),
        option(
            "turnaround",
            "time for which the adapter receives nothing after its own transmission (none)",
            Accepts::Duration,
        ),
        option(
            "clock",
            "relative rate errors of the servo clocks; positive: fast",
            Accepts::Each(Box::new(number(Range::between(-0.1, 0.1)))),
        ),
        option("usb", "timing of USB", Accepts::Group(usb::options())),
    ]
}

/// Returns the decoder of the packets in a direction.
fn decoder(protocol: ProtocolVersion, direction: Direction) -> Decoder {
    let mut parser = Parser::new(protocol);
    let mut skipped = 0;
    Box::new(move |bytes| {
        parser.push(bytes);
        let mut texts = Vec::new();
        while let Some(received) = parser.next_packet() {
            texts.push(match received {
                Received::Packet(packet) => packet_text(&packet, protocol, direction),
                Received::Damaged { id } => format!("{id} damaged"),
            });
        }
        if parser.skipped() > skipped {
            texts.push(format!("{} bytes of no packet", parser.skipped() - skipped));
            skipped = parser.skipped();
        }
        texts
    })
}

/// Returns the text of a packet: identifier, instruction or error, and the bytes.
fn packet_text(packet: &Packet<'_>, protocol: ProtocolVersion, direction: Direction) -> String {
    let (code, bytes) = match (direction, packet.status(protocol)) {
        (Direction::ToDriver, Some(status)) if status.error == 0 => {
            ("status".to_owned(), status.data)
        }
        (Direction::ToDriver, Some(status)) => (
            format!("status with error {:#04x}", status.error),
            status.data,
        ),
        _ => (Instruction(packet.code).to_string(), packet.parameters),
    };
    let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{} {code} {}", packet.id, bytes.join(" "))
        .trim_end()
        .to_owned()
}

/// Returns the protocol of a bus with these options.
fn protocol(models: Models, options: &Options) -> ProtocolVersion {
    let kind = chosen(models, options.text("model"));
    kind.map_or(ProtocolVersion::Two, |kind| kind.model.protocol)
}

/// Returns the value of a choice.
fn chosen<T: Copy>(all: &[(&str, T)], name: Option<&str>) -> Option<T> {
    let found = all.iter().find(|(known, _)| Some(*known) == name);
    found.or(all.first()).map(|(_, value)| *value)
}

fn config(context: &BusContext<'_>, models: Models) -> Result<ServoBusConfig, BuildError> {
    if context.actuator.firmware != FirmwarePlace::Bus {
        let why = "servos on a bus move the joints: write [actuator] kind = \"serial\", \
                   firmware = \"bus\"";
        return Err(why.into());
    }
    let options = context.options;
    let kind = chosen(models, options.text("model")).ok_or("a bus of servos needs a model")?;
    let baud = options.natural("baud").unwrap_or(u64::from(BAUD));
    let usb = usb::timing(options.group("usb"))?;
    let held = usb.latency_timer + usb.inn.hold_max();
    let timeout = TIMEOUT.max(held + MARGIN);
    Ok(ServoBusConfig {
        name: context.name.to_owned(),
        servos: servos(context, kind, baud)?,
        byte_time: SimDuration::from_nanos((BITS * 1_000_000_000).div_ceil(baud)),
        pattern: pattern(options.text("read"), kind.model),
        period: context.period,
        timeout: options.duration("timeout").unwrap_or(timeout),
        usb,
        turnaround: options.duration("turnaround").unwrap_or_default(),
        faults: context.fault_schedule(),
        seed: context.seed,
    })
}

/// Returns the read pattern of this name, or by default the fastest that all firmware versions of
/// the model have.
fn pattern(name: Option<&str>, model: &ServoModel) -> ReadPattern {
    let named = ReadPattern::ALL
        .into_iter()
        .find(|it| Some(it.name()) == name);
    let sync = ReadPattern::SyncRead;
    let fastest = if sync.is_of(model) {
        sync
    } else {
        ReadPattern::Read
    };
    named.unwrap_or(fastest)
}

/// Returns the servos of the joints that the controller commands.
fn servos(
    context: &BusContext<'_>,
    kind: &'static ServoKind,
    baud: u64,
) -> Result<Vec<ServoConfig>, BuildError> {
    let options = context.options;
    let mut registers = vec![baud_register(kind.model, baud)?];
    registers.extend(named_registers(options, "registers", kind.model)?);
    let settings = named_registers(options, "settings", kind.model)?;
    let voltage = context.robot.and_then(|robot| robot.serial.as_ref());
    let voltage = voltage.map(|servo| servo.supply.voltage);
    let voltage = voltage.ok_or("the robot file has no [serial]")?;
    let joints = context
        .legs
        .iter()
        .flat_map(|leg| JOINTS.map(|joint| (*leg, joint)));
    let commanded = joints.filter(|(leg, joint)| {
        let command = signal::command(leg, joint);
        let mut ports = context.process_ports.iter();
        ports.any(|port| port.direction == PortDirection::Output && port.name == command)
    });
    let first = options.natural("first_id").unwrap_or(1);
    let mut servos = Vec::new();
    for ((leg, joint), id) in commanded.zip(first..) {
        let name = format!("{leg}/{joint}");
        let rate_ppb = match options.of_member("clock", &name) {
            Some(OptionValue::Number(rate)) => libm::rint(rate * 1e9),
            _ => 0.0,
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the magnitude of the option is at most 0.1"
        )]
        let clock = BoardClock::new(LocalDuration::ZERO, rate_ppb as i64)?;
        let id = u8::try_from(id)
            .map_err(|_| format!("the servo `{name}` cannot have the identifier {id}"))?;
        servos.push(ServoConfig {
            signals: JointSignals::of_joint(&signal::of_leg(leg, joint)),
            command: signal::command(leg, joint),
            name,
            kind,
            id,
            registers: registers.clone(),
            settings: settings.clone(),
            voltage,
            temperature: TEMPERATURE,
            clock,
        });
    }
    check_members(options, &servos)?;
    Ok(servos)
}

/// Checks that options of single servos name servos of the scene.
fn check_members(options: &Options, servos: &[ServoConfig]) -> Result<(), BuildError> {
    let names = || servos.iter().map(|servo| servo.name.as_str());
    for (member, _) in options.named("clock") {
        if !names().any(|name| name == member.value) {
            let help = suggestion(&member.value, "servos", names());
            return Err(format!("there is no servo `{}`: {help}", member.value).into());
        }
    }
    Ok(())
}

/// Returns the register of the baud rate with the value of a rate.
fn baud_register(model: &ServoModel, baud: u64) -> Result<(u16, i32), BuildError> {
    let value = model.baud_rates.value(baud).ok_or_else(|| {
        let rates = model.baud_rates.names();
        format!("the {} has no {baud} bit/s; it has {rates}", model.name)
    })?;
    Ok((model.roles.baud_rate, value.into()))
}

/// Returns the registers of an option by address.
fn named_registers(
    options: &Options,
    option: &str,
    model: &ServoModel,
) -> Result<Vec<(u16, i32)>, BuildError> {
    let mut registers = Vec::new();
    for (name, value) in options.named(option) {
        let item = model.items.iter().find(|item| item.name == name.value);
        let item = item.ok_or_else(|| {
            let known = model.items.iter().map(|item| item.name);
            let help = suggestion(&name.value, "registers", known);
            format!(
                "the {} has no register `{}`: {help}",
                model.name, name.value
            )
        })?;
        if item.address == model.roles.baud_rate {
            let why = "`baud_rate` is that of the bus: write `baud`, in bit/s";
            return Err(why.into());
        }
        let whole = match value {
            OptionValue::Number(value) if libm::rint(*value) == *value => Some(*value),
            _ => None,
        };
        let in_range = whole.filter(|value| value.abs() <= f64::from(i32::MAX));
        let value = in_range
            .ok_or_else(|| format!("the register `{}` needs a whole number", name.value))?;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a whole number within range"
        )]
        registers.push((item.address, value as i32));
    }
    Ok(registers)
}
