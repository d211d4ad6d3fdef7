//! Acquisition of tactile sensors, from scenario options.

mod calibration;
mod config;
mod constants;
mod filter;

use twinrig_document::Range;
use twinrig_kernel::Unit;
use twinrig_runtime::Wire;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue};
use twinrig_tactile::protocol::Message;
use twinrig_tactile::{CHANNELS, TactileDriver};

pub use calibration::CalibrationFile;
pub use filter::{NamedCalibrations, filters};

use crate::error::BuildError;
use crate::parts::analog_sources::clock_option;
use crate::parts::bus_kind::{BusContext, BusKind, SensorMount};
use crate::parts::decoder::framed;
use crate::parts::option::{choice, option};
use config::{FRESH, NEWEST, SIGNAL, config, signal, sources};

/// Name of the kind.
pub const NAME: &str = "tactile";
/// Baud rate of the board's serial line \[bit/s\].
const BAUD: u32 = 921_600;
/// Conversions per sample, the default first.
const OVERSAMPLING: [&str; 3] = ["1", "2", "4"];

/// Returns the bus kind `tactile`.
pub(crate) fn kind() -> BusKind {
    let about = "acquisition cards of a tactile sensor, and filters that estimate its load";
    let kind = BusKind::new(NAME, about, driver, wire)
        .with_faults()
        .with_place(CHANNELS[0])
        .with_place(CHANNELS[1])
        .with_place(CHANNELS[2])
        .at_baud(BAUD)
        .with_decoder(|_, _| framed::<Message>())
        .mounting(|options| {
            Some(SensorMount {
                signal: signal(options).to_owned(),
                sensor: options.name("sensor")?.clone(),
                cell: options.natural("cell"),
            })
        })
        .calibrated(filter::calibrations)
        .measuring(|options| sources(options).map(|source| source.1).into());
    options().into_iter().fold(kind, BusKind::with_option)
}

fn options() -> Vec<OptionSpec> {
    let deviation = |unit| Accepts::Quantity {
        unit,
        range: Range::NOT_NEGATIVE,
    };
    let [piezoresistive, piezoelectric, reference] = CHANNELS;
    vec![
        OptionSpec {
            default: Some(OptionValue::Text(SIGNAL.to_owned())),
            ..option(
                "signal",
                "load at which the sensor is mounted",
                Accepts::Text,
            )
        },
        option(
            "sensor",
            "name or path of the file with the sensor that is mounted there, in `benches/`; a bench has its own",
            Accepts::Name,
        ),
        option(
            "cell",
            "number of the cell of `sensor`, whose constants are drawn within the `spread` of the file (none: those of the file)",
            Accepts::Natural(0..=u64::from(u32::MAX)),
        ),
        option(
            "period",
            "time between two samples (1 ms)",
            Accepts::Duration,
        ),
        choice("oversampling", "conversions per sample", &OVERSAMPLING),
        choice(
            "take",
            "whether a transfer waits for a fresh sample",
            &[NEWEST, FRESH],
        ),
        option(
            "zero",
            "whether the force of the reference cell at the start is its zero (false)",
            Accepts::Boolean,
        ),
        option(
            "noise",
            "deviations of the noise of the channels (0.305 mV, 0.305 mV, 1 mN)",
            Accepts::Group(vec![
                option(
                    piezoresistive,
                    "of the first voltage",
                    deviation(Unit::Volt),
                ),
                option(
                    piezoelectric,
                    "of the second voltage",
                    deviation(Unit::Volt),
                ),
                option(reference, "of the reference cell", deviation(Unit::Newton)),
            ]),
        ),
        option(
            "jitter",
            "delay of transmissions by the firmware of the board (0 to 50 us)",
            Accepts::Time,
        ),
        clock_option(),
        filter::table(),
    ]
}

/// Builds the driver with the filters of the scenario.
///
/// # Errors
/// As [`filters`], and options that the board cannot have.
pub fn driver(context: &BusContext<'_>) -> Result<TactileDriver, BuildError> {
    let config = config(context)?;
    let filters = filters(context, NamedCalibrations::Own)?;
    let mut driver = config.driver()?;
    for filter in filters {
        driver = driver.with_stage(Box::new(filter));
    }
    Ok(driver)
}

fn wire(context: &BusContext<'_>) -> Result<impl Wire + use<>, BuildError> {
    Ok(config(context)?.wire(&context.fault_schedule())?)
}
