//! RB-110 servo board of the robot's computer, from scenario options.

use twinrig_devices::rb110::{AdcRange, PulseMap, Rb110, ServoLine};
use twinrig_document::Range;
use twinrig_kernel::{Unit, signal};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue};

use crate::error::BuildError;
use crate::parts::analog_sources::{analog_inputs, clock, clock_option, inputs, signals};
use crate::parts::bus_kind::{BusContext, BusKind};
use crate::parts::option::{choice, option};

/// Lines of Oncilla's servos (public user of the original library, 2013).
const LINES: [(&str, usize); 4] = [("LF", 15), ("RF", 13), ("LH", 9), ("RH", 11)];
const ONCILLA: &str = "oncilla";
const KONDO: &str = "kondo";
const REFERENCE: &str = "reference";
const TWICE: &str = "twice";
/// Baud rate of the link to the board \[bit/s\]. ASSUMED.
const BAUD: u32 = 1_000_000;

/// Returns the bus kind `rb110`.
pub(crate) fn kind() -> BusKind {
    let about = "servo board of Oncilla's computer: hip abduction and analog inputs";
    let kind = BusKind::of_device("rb110", about, config).at_baud(BAUD);
    let kind = kind.measuring(|options| signals(options, "inputs"));
    options().into_iter().fold(kind, BusKind::with_option)
}

fn options() -> Vec<OptionSpec> {
    vec![
        option(
            "period",
            "pulse period, which is the duration of a transfer, 10 to 20 ms (20 ms)",
            Accepts::Duration,
        ),
        choice(
            "servo",
            "servo type, which maps pulse widths to angles",
            &[ONCILLA, KONDO],
        ),
        option(
            "lines",
            "line of the servo of each leg (LF 15, RF 13, LH 9, RH 11)",
            Accepts::Each(Box::new(Accepts::Natural(0..=15))),
        ),
        inputs(
            "inputs",
            "analog inputs to read, and their sources in volts",
            twinrig_devices::rb110::protocol::ANALOG,
        ),
        choice(
            "range",
            "full scale of the analog inputs",
            &[REFERENCE, TWICE],
        ),
        option(
            "reference",
            "reference voltage of the analog inputs (2.5 V)",
            Accepts::Quantity {
                unit: Unit::Volt,
                range: Range::POSITIVE,
            },
        ),
        clock_option(),
    ]
}

fn config(context: &BusContext<'_>) -> Result<Rb110, BuildError> {
    let options = context.options;
    let pulse = match options.text("servo") {
        Some(KONDO) => PulseMap::KONDO,
        _ => PulseMap::ONCILLA,
    };
    let mut board = Rb110::with_servos(context.name, pulse, &[]);
    for &leg in context.legs {
        board.servos.push(servo(context, leg, pulse)?);
    }
    board.analog = analog_inputs(options, "inputs")?;
    board.period = options.duration("period").unwrap_or(board.period);
    board.reference = options.number("reference").unwrap_or(board.reference);
    board.clock = clock(options)?;
    if options.text("range") == Some(TWICE) {
        board.range = AdcRange::TwiceReference;
    }
    Ok(board)
}

fn servo(context: &BusContext<'_>, leg: &str, pulse: PulseMap) -> Result<ServoLine, BuildError> {
    let known = LINES.into_iter().find(|(name, _)| *name == leg);
    let line = match context.options.of_member("lines", leg) {
        Some(OptionValue::Natural(line)) => usize::try_from(*line)?,
        _ => known
            .map(|(_, line)| line)
            .ok_or_else(|| format!("the leg `{leg}` has no line: set it with `lines`"))?,
    };
    Ok(ServoLine {
        line,
        command: signal::command(leg, "abduction"),
        pulse,
    })
}
