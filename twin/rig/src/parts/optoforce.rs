//! `OptoForce` force sensors, from scenario options.

use twinrig_devices::optoforce::{Cutoff, OptoForce, SampleChoice, Speed};
use twinrig_document::Range;
use twinrig_kernel::Unit;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue};

use crate::error::BuildError;
use crate::parts::analog_sources::{clock, clock_option};
use crate::parts::bus_kind::{BusContext, BusKind};
use crate::parts::option::{choice, option};

/// Baud rate of the sensor's USB serial port \[bit/s\].
const BAUD: u32 = 1_000_000;
/// Default signal that a sensor measures.
const SIGNAL: &str = "leg/LF/foot/force";
const NEWEST: &str = "newest";
const FRESH: &str = "fresh";
/// Sampling rates by their names in scenarios, the default first.
const SPEEDS: [(&str, Speed); 5] = [
    ("100 Hz", Speed::Hz100),
    ("1000 Hz", Speed::Hz1000),
    ("333 Hz", Speed::Hz333),
    ("30 Hz", Speed::Hz30),
    ("10 Hz", Speed::Hz10),
];
/// Cut-off frequencies of the filter by their names in scenarios, the default first.
const FILTERS: [(&str, Cutoff); 7] = [
    ("15 Hz", Cutoff::Hz15),
    ("none", Cutoff::None),
    ("500 Hz", Cutoff::Hz500),
    ("150 Hz", Cutoff::Hz150),
    ("50 Hz", Cutoff::Hz50),
    ("5 Hz", Cutoff::Hz5),
    ("1.5 Hz", Cutoff::Hz1p5),
];

/// Returns the bus kind `optoforce`.
pub(crate) fn kind() -> BusKind {
    let about = "force sensor on a separate serial port; measures one force of the plant";
    let kind = BusKind::of_device("optoforce", about, config)
        .at_baud(BAUD)
        .measuring(|options| {
            options
                .text("signal")
                .map(str::to_owned)
                .into_iter()
                .collect()
        });
    options().into_iter().fold(kind, BusKind::with_option)
}

fn options() -> Vec<OptionSpec> {
    vec![
        OptionSpec {
            default: Some(OptionValue::Text(SIGNAL.to_owned())),
            ..option(
                "signal",
                "force signal of the plant to measure",
                Accepts::Text,
            )
        },
        choice(
            "speed",
            "rate at which samples are sent",
            &SPEEDS.map(|(name, _)| name),
        ),
        choice(
            "filter",
            "cut-off frequency of the filter",
            &FILTERS.map(|(name, _)| name),
        ),
        option(
            "zero",
            "whether the reading at the start is the zero force (false)",
            Accepts::Boolean,
        ),
        choice(
            "take",
            "whether a transfer waits for a fresh sample",
            &[NEWEST, FRESH],
        ),
        option(
            "range",
            "force at 6000 counts (1600 N)",
            Accepts::Quantity {
                unit: Unit::Newton,
                range: Range::POSITIVE,
            },
        ),
        clock_option(),
    ]
}

fn config(context: &BusContext<'_>) -> Result<OptoForce, BuildError> {
    let options = context.options;
    let mut sensor = OptoForce::new(context.name, options.text("signal").unwrap_or(SIGNAL));
    sensor.speed = named(&SPEEDS, options.text("speed"));
    sensor.cutoff = named(&FILTERS, options.text("filter"));
    sensor.zero = options.boolean("zero").unwrap_or(false);
    if options.text("take") == Some(FRESH) {
        sensor.take = SampleChoice::Fresh;
    }
    if let Some(range) = options.number("range") {
        sensor.sensitivity = OptoForce::COUNTS / range;
    }
    sensor.clock = clock(options)?;
    Ok(sensor)
}

fn named<T: Copy + Default>(all: &[(&str, T)], name: Option<&str>) -> T {
    let found = all.iter().find(|(known, _)| Some(*known) == name);
    found.map_or_else(T::default, |(_, value)| *value)
}
