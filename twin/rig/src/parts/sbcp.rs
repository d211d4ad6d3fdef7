//! SBCP bus of Oncilla with its motordriver boards, from scenario options.

use std::time::Duration;

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, signal};
use twinrig_motordriver::{
    Attachment, BoardConfig, Bus, BusConfig, BusTopology, BusWire, FirmwareConfig, Following,
    Generation, Interpolation, MotorDriver, SessionConfig, SessionGains, Side,
};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    ControllerConfig, ErrorCode, FRAMES, ForwardingMode, Instruction, Packet, Parser,
};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};

use crate::error::BuildError;
use crate::parts::bus_kind::{BusContext, BusKind};
use crate::parts::decoder::{Decoder, Direction};
use crate::parts::option::{choice, number, option};
use crate::parts::usb;

/// Baud rate of the bus \[bit/s\]: the rate closest to 3.3 Mbit/s that the board processor
/// supports.
const BAUD: u32 = 3_333_333;
/// Identifiers of the boards of Oncilla (public liboncilla-hw sources, 2014).
const IDS: [(&str, u8, Side); 4] = [
    ("LF", 1, Side::Left),
    ("RF", 2, Side::Right),
    ("LH", 3, Side::Left),
    ("RH", 4, Side::Right),
];

/// Maximum response time of a board with the first firmware, whose main loop has a period of 1 ms
/// of the board's clock.
const FIRST_ANSWERS: SimDuration = SimDuration::from_micros(1_100);

const CONTROLLER: &str = "controller";
const DIRECT: &str = "direct";
const CUT_THROUGH: &str = "cut-through";
const STORE: &str = "store-and-forward";
const LOW_LATENCY: &str = "low-latency";
const FIRST: &str = "first";
const SMOOTH: &str = "smooth";
const PLAIN: &str = "plain";
const WITHOUT: &str = "without-heuristics";

pub(crate) fn kind() -> BusKind {
    let about = "Oncilla's bus: one motordriver board per leg or motor on a free shaft, on RS-485 behind USB; for legs with [actuator] kind = \"motor\"";
    let kind = BusKind::new("sbcp", about, driver, wire)
        .at_baud(BAUD)
        .with_faults()
        .with_board_faults()
        .with_place("link")
        .with_place("*")
        .with_decoder(|_, direction| decoder(direction))
        .with_frames(|_| FRAMES);
    let measured = [
        signal::HIP_POSITION,
        signal::KNEE_POSITION,
        signal::ANGLES,
        signal::FOOT_FORCE,
    ];
    let mut measured = measured.map(|name| signal::of_leg("*", name)).to_vec();
    measured.push(signal::of_motor("*", "position"));
    let kind = kind.measuring(move |_| measured.clone());
    options().into_iter().fold(kind, BusKind::with_option)
}

/// Returns the decoder of the packets in a direction.
fn decoder(direction: Direction) -> Decoder {
    let mut parser = Parser::default();
    let mut skipped = 0;
    Box::new(move |mut bytes| {
        let mut texts = Vec::new();
        while let Some(packet) = parser.next(&mut bytes) {
            texts.push(packet_text(&packet, direction));
        }
        if parser.skipped() > skipped {
            texts.push(format!("{} bytes of no packet", parser.skipped() - skipped));
            skipped = parser.skipped();
        }
        texts
    })
}

/// Returns the text of a packet: board, instruction or result, and the payload in words.
fn packet_text(packet: &Packet<'_>, direction: Direction) -> String {
    let (class, id) = (packet.class(), packet.id());
    let leg = IDS.iter().find(|(_, known, _)| *known == id);
    let board = match leg {
        Some((leg, ..)) if class == CLASS_MOTORDRIVER => (*leg).to_owned(),
        _ => format!("{class}.{id}"),
    };
    let code = match direction {
        Direction::ToBoards => Instruction(packet.code()).to_string(),
        Direction::ToDriver => ErrorCode(packet.code()).to_string(),
    };
    let (words, rest) = packet.payload().as_chunks::<2>();
    let words = words.iter().map(|word| u16::from_le_bytes(*word));
    let rest = rest.iter().copied().map(u16::from);
    let numbers: Vec<String> = words.chain(rest).map(|it| it.to_string()).collect();
    format!("{board} {code} {}", numbers.join(" "))
        .trim_end()
        .to_owned()
}

fn options() -> Vec<OptionSpec> {
    let register = || Accepts::Natural(0..=u64::from(u16::MAX));
    let each = |accepts| Accepts::Each(Box::new(accepts));
    vec![
        choice(
            "topology",
            "connection between USB and the boards",
            &[CONTROLLER, DIRECT],
        ),
        choice(
            "passing",
            "forwarding mode of the bus controller",
            &[CUT_THROUGH, STORE],
        ),
        option(
            "gap",
            "pause of the bus controller between a response and the next request (2 us)",
            Accepts::Duration,
        ),
        option(
            "silence",
            "silence of a board after which the bus controller reports a timeout (20 us)",
            Accepts::Duration,
        ),
        choice(
            "firmware",
            "firmware generation: boards respond immediately or from their main loop",
            &[LOW_LATENCY, FIRST],
        ),
        option(
            "following",
            "set-point tracking of the motors (smooth)",
            each(Accepts::Choice(
                [SMOOTH, PLAIN, WITHOUT].map(str::to_owned).into(),
            )),
        ),
        option(
            "clock",
            "relative rate errors of the board clocks; positive: fast",
            each(number(Range::between(-0.1, 0.1))),
        ),
        option(
            "phase",
            "start times of the main loops of the boards",
            each(Accepts::Duration),
        ),
        option("usb", "timing of USB", Accepts::Group(usb::options())),
        option(
            "gains",
            "gains of the position controllers: p, i, d (400, 20, 200)",
            Accepts::Group(vec![
                option("p", "proportional gain", register()),
                option("i", "integral gain", register()),
                option("d", "derivative gain", register()),
            ]),
        ),
        option(
            "max_torque",
            "maximum motor current in units of 20 mA (1100)",
            register(),
        ),
        option(
            "max_speed",
            "maximum speed of the interpolation in counts/s (32000)",
            register(),
        ),
        option(
            "error_threshold",
            "number of errors that ends the run; negative: unlimited (1)",
            number(Range::ANY),
        ),
        option(
            "cycle_timeout",
            "timeout of a response (derived from topology, USB and firmware)",
            Accepts::Duration,
        ),
        option(
            "calibration_timeout",
            "timeout of the calibration (5 s)",
            Accepts::Duration,
        ),
        option(
            "free_running",
            "start the next cycle as soon as the previous one is complete",
            Accepts::Boolean,
        ),
        option("trace", "also trace the bytes on RS-485", Accepts::Boolean),
    ]
}

fn driver(context: &BusContext<'_>) -> Result<MotorDriver, BuildError> {
    Ok(Bus::driver(&config(context)?)?)
}

fn wire(context: &BusContext<'_>) -> Result<BusWire, BuildError> {
    Ok(Bus::wire(&config(context)?)?)
}

fn config(context: &BusContext<'_>) -> Result<BusConfig, BuildError> {
    let options = context.options;
    let topology = if options.text("topology") == Some(DIRECT) {
        // An absent choice has its default value.
        let passing = (options.text("passing") == Some(STORE)).then_some("passing");
        let pauses = ["gap", "silence"];
        let pauses = pauses
            .into_iter()
            .filter(|name| options.get(name).is_some());
        if let Some(name) = passing.into_iter().chain(pauses).next() {
            let why = format!(
                "`{name}` is a setting of the bus controller, which topology = \"direct\" does not have: remove one of the two"
            );
            return Err(why.into());
        }
        BusTopology::Direct
    } else {
        let controller = controller(options);
        if options.text("firmware") == Some(FIRST) && controller.timeout < FIRST_ANSWERS {
            let why = format!(
                "boards with the first firmware respond within {FIRST_ANSWERS}, but the timeout of the bus controller is {}: write topology = \"direct\", or a longer `silence`",
                controller.timeout
            );
            return Err(why.into());
        }
        BusTopology::Controller(controller)
    };
    Ok(BusConfig {
        name: context.name.to_owned(),
        boards: boards(context)?,
        topology,
        usb: usb::timing(options.group("usb"))?,
        session: session(context),
        faults: context.fault_schedule(),
        seed: context.seed,
        trace: options.boolean("trace").unwrap_or(false),
        ..BusConfig::default()
    })
}

fn controller(options: &Options) -> ControllerConfig {
    let default = ControllerConfig::default();
    ControllerConfig {
        passing: match options.text("passing") {
            Some(STORE) => ForwardingMode::StoreAndForward,
            _ => ForwardingMode::CutThrough,
        },
        gap: options.duration("gap").unwrap_or(default.gap),
        timeout: options.duration("silence").unwrap_or(default.timeout),
        ..default
    }
}

/// Returns the boards of the legs and of the free shafts of the scene.
fn boards(context: &BusContext<'_>) -> Result<Vec<BoardConfig>, BuildError> {
    let options = context.options;
    let firmware = FirmwareConfig {
        generation: match options.text("firmware") {
            Some(FIRST) => Generation::First,
            _ => Generation::LowLatency,
        },
        interpolation: Interpolation::Smooth,
    };
    for member in options.members() {
        let name = member.value.as_str();
        if !context.legs.contains(&name) && !context.motors.contains(&name) {
            let why = format!(
                "there is no board `{}` in this scene: boards are named after the legs and motors",
                member.value
            );
            return Err(why.into());
        }
    }
    let of_leg = |&leg: &&str| -> Result<BoardConfig, BuildError> {
        let known = IDS.into_iter().find(|(name, ..)| *name == leg);
        let (_, id, side) = known.ok_or_else(|| {
            format!("the leg `{leg}` has no board: boards exist for LF, RF, LH and RH")
        })?;
        Ok(BoardConfig {
            name: leg.to_owned(),
            id,
            attachment: Attachment::Leg { side },
            firmware,
            ..BoardConfig::default()
        })
    };
    let of_motor = |(index, &motor): (usize, &&str)| -> Result<BoardConfig, BuildError> {
        let id = u8::try_from(IDS.len() + 1 + index)?;
        Ok(BoardConfig {
            firmware,
            ..BoardConfig::shaft(motor, id)
        })
    };
    let boards = context.legs.iter().map(of_leg);
    let boards = boards.chain(context.motors.iter().enumerate().map(of_motor));
    boards.map(|board| with_options(board?, options)).collect()
}

/// Returns the board with its clock and set-point following.
fn with_options(mut board: BoardConfig, options: &Options) -> Result<BoardConfig, BuildError> {
    let name = board.name.as_str();
    let rate_ppb = match options.of_member("clock", name) {
        Some(OptionValue::Number(rate)) => libm::rint(rate * 1e9),
        _ => 0.0,
    };
    let phase = match options.of_member("phase", name) {
        Some(OptionValue::Duration(phase)) => *phase,
        _ => SimDuration::ZERO,
    };
    match options.of_member("following", name) {
        Some(OptionValue::Text(word)) if word == PLAIN => board.following = Following::Plain,
        Some(OptionValue::Text(word)) if word == WITHOUT => {
            board.firmware.interpolation = Interpolation::WithoutHeuristics;
        }
        _ => {}
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the magnitude of the option is at most 0.1"
    )]
    Ok(board.with_clock(rate_ppb as i64, phase)?)
}

fn session(context: &BusContext<'_>) -> SessionConfig {
    let (options, default) = (context.options, SessionConfig::default());
    let gains = options.group("gains");
    let default_gains = SessionGains::default();
    let register = |options: Option<&Options>, name: &str, default: u16| {
        let value = options.and_then(|options| options.natural(name));
        value
            .and_then(|value| u16::try_from(value).ok())
            .unwrap_or(default)
    };
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the conversion saturates, far above any error count"
    )]
    let threshold = |count: f64| libm::rint(count) as i64;
    SessionConfig {
        period: host(context.period),
        gains: SessionGains {
            p: register(gains, "p", default_gains.p),
            i: register(gains, "i", default_gains.i),
            d: register(gains, "d", default_gains.d),
            max_torque: register(Some(options), "max_torque", default_gains.max_torque),
            max_speed: register(Some(options), "max_speed", default_gains.max_speed),
            ..default_gains
        },
        error_threshold: options
            .number("error_threshold")
            .map_or(default.error_threshold, threshold),
        calibration_timeout: options
            .duration("calibration_timeout")
            .map_or(default.calibration_timeout, host),
        cycle_timeout: options.duration("cycle_timeout").map(host),
        free_running: options
            .boolean("free_running")
            .unwrap_or(default.free_running),
        ..default
    }
}

fn host(duration: SimDuration) -> Duration {
    Duration::from_nanos(duration.as_nanos())
}
