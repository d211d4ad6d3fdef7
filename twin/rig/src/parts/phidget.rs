//! Phidget bridges and interface kits, from scenario options.

use twinrig_devices::phidget::{Board, Gain, Phidget};
use twinrig_scenario::{Accepts, OptionSpec};

use crate::error::BuildError;
use crate::parts::analog_sources::{analog_inputs, clock, clock_option, inputs, signals};
use crate::parts::bus_kind::{BusContext, BusKind};
use crate::parts::option::{choice, option};

const BRIDGE: &str = "bridge";
const INTERFACE_KIT: &str = "interface-kit";

/// Returns the bus kind `phidget`.
pub(crate) fn kind() -> BusKind {
    let about = "USB measurement board: bridge for load cells, or analog inputs";
    let kind = BusKind::of_device("phidget", about, config);
    let kind = kind.measuring(|options| signals(options, "inputs"));
    options().into_iter().fold(kind, BusKind::with_option)
}

fn options() -> Vec<OptionSpec> {
    let gains = Gain::ALL.map(|gain| gain.times().to_string());
    vec![
        choice("board", "type of the board", &[BRIDGE, INTERFACE_KIT]),
        inputs(
            "inputs",
            "sources of the inputs: ratios for a bridge, volts for an interface kit",
            twinrig_devices::phidget::protocol::ANALOG,
        ),
        option(
            "interval",
            "time between reports of a bridge, a multiple of 8 ms (8 ms)",
            Accepts::Duration,
        ),
        choice("gain", "amplification of a bridge", &gains),
        option(
            "trigger",
            "change of an input of an interface kit that triggers a report, in thousandths of 5 V (10)",
            Accepts::Natural(0..=u64::from(twinrig_devices::phidget::protocol::SCALE)),
        ),
        clock_option(),
    ]
}

fn config(context: &BusContext<'_>) -> Result<Phidget, BuildError> {
    let options = context.options;
    let mut board = match options.text("board") {
        Some(INTERFACE_KIT) => Board::INTERFACE_KIT,
        _ => Board::default(),
    };
    match &mut board {
        Board::Bridge { interval, gain } => {
            *interval = options.duration("interval").unwrap_or(*interval);
            let times = options.text("gain").and_then(|times| times.parse().ok());
            *gain = times.and_then(Gain::of_times).unwrap_or(*gain);
        }
        Board::InterfaceKit { trigger } => {
            let value = options.natural("trigger");
            *trigger = value.map_or(Ok(*trigger), u16::try_from)?;
        }
    }
    let mut board = Phidget::new(context.name, board);
    board.inputs = analog_inputs(options, "inputs")?;
    board.clock = clock(options)?;
    Ok(board)
}
