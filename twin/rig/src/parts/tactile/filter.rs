//! Filters of the load, from scenario options.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use twinrig_document::{Placed, Range};
use twinrig_estimate::{Calibration, Model, Piezoresistive, RECOVERY, Settings, StateSettings};
use twinrig_kernel::Unit;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};
use twinrig_tactile::{LoadFilter, LoadFilterConfig};

use super::config::{BENCH, config};
use crate::error::BuildError;
use crate::parts::bus_kind::BusContext;
use crate::parts::option::{choice, number, option};
use crate::parts::tactile::constants::{Constants, LINEAR, LOADING, UNLOADING, required};

/// Name of the table.
pub(super) const FILTER: &str = "filter";

const MODELS: [&str; 4] = ["F3", "F1", "F2", "F4"];
/// Key of the calibration.
const CALIBRATION: &str = "calibration";
/// Last parts of other signals below a load.
const TAKEN: [&str; 5] = [
    "rate",
    "conductance",
    "piezoresistive",
    "piezoelectric",
    "reference",
];
/// Names of the state variables of all models, with their units.
const STATES: [(&str, Unit); 9] = [
    ("force", Unit::Newton),
    ("rate", Unit::NewtonPerSecond),
    ("acceleration", Unit::One),
    ("crystal_rate", Unit::NewtonPerSecond),
    ("voltage", Unit::Volt),
    ("frequency", Unit::Hertz),
    ("gain", Unit::One),
    ("creep", Unit::One),
    ("bias", Unit::Volt),
];

fn quantity(unit: Unit, range: Range) -> Accepts {
    Accepts::Quantity { unit, range }
}

/// Returns the option of the filters of a sensor.
pub(super) fn table() -> OptionSpec {
    let about = "filters of the load, by the name of their estimate: `bench/force/NAME`";
    let keys = vec![
        choice("model", "process model", &MODELS),
        option(
            CALIBRATION,
            "name or path of a file with the constants of both cells, in `calibrations/`: in place of those here",
            Accepts::Name,
        ),
        option(
            "low_pass",
            "cut-off frequency of a low-pass filter of fourth order before the filter (none)",
            quantity(Unit::Hertz, Range::POSITIVE),
        ),
        piezoresistive(),
        piezoelectric(),
        option(
            "frequency",
            "measured frequency of the load, which F2 requires",
            Accepts::Group(vec![
                option("signal", "signal of the controller [Hz]", Accepts::Text),
                option(
                    "noise",
                    "its deviation (0.05 Hz)",
                    quantity(Unit::Hertz, Range::POSITIVE),
                ),
            ]),
        ),
        states(
            "process",
            "deviations that a millisecond adds to the state variables (0)",
        ),
        states("initial", "deviations of the state variables at the start"),
        option(
            "white",
            "density of white noise of the derivative of the highest derivative of the force: N²/s³ in F1, N²/s⁵ in F2, F3 and F4 (0)",
            number(Range::NOT_NEGATIVE),
        ),
        option(
            "recovery",
            "whether an estimate that is lost in saturation is set to the measured voltage (true)",
            Accepts::Boolean,
        ),
    ];
    option(
        FILTER,
        about,
        Accepts::Table(Box::new(Accepts::Group(keys))),
    )
}

fn states(name: &str, about: &str) -> OptionSpec {
    let deviation = |(name, unit): (&str, Unit)| {
        let about = match name {
            "acceleration" => "of the second derivative of the force in N/s²".to_owned(),
            "crystal_rate" => "of the rate behind the silicone, in F3 and F4".to_owned(),
            "voltage" => "of the amplifier, in F3 and F4".to_owned(),
            "gain" => "of the relative deviation of the gain, in F4".to_owned(),
            "creep" => "of the relative creep, in F4".to_owned(),
            "bias" => "of the bias of the piezoelectric voltage".to_owned(),
            name => format!("of the {name}"),
        };
        option(name, &about, quantity(unit, Range::NOT_NEGATIVE))
    };
    option(name, about, Accepts::Group(STATES.map(deviation).into()))
}

fn noise() -> OptionSpec {
    option(
        "noise",
        "deviation of its voltage",
        quantity(Unit::Volt, Range::POSITIVE),
    )
}

fn piezoresistive() -> OptionSpec {
    let volts = |name, about| option(name, about, quantity(Unit::Volt, Range::ANY));
    let newtons = |name, about, range| option(name, about, quantity(Unit::Newton, range));
    let branch = |name: &str, about: &str| {
        option(
            name,
            about,
            Accepts::Group(vec![
                volts("base", "voltage far below the middle"),
                volts("rise", "rise from far below to far above the middle"),
                newtons("mid", "force in the middle of the rise", Range::ANY),
                newtons(
                    "width",
                    "force over which the distance from either end changes by a factor of e",
                    Range::POSITIVE,
                ),
            ]),
        )
    };
    option(
        "piezoresistive",
        "piezoresistive cell; without this table its voltage is not used",
        Accepts::Group(vec![
            noise(),
            volts(
                "min",
                "least plausible voltage: a lower one is not used (none)",
            ),
            volts("max", "greatest plausible voltage (none)"),
            option(
                LINEAR,
                "linear response",
                Accepts::Group(vec![
                    volts("offset", "voltage without force"),
                    volts("per_newton", "rise with a newton"),
                ]),
            ),
            branch(LOADING, "sigmoid of rising forces"),
            branch(UNLOADING, "sigmoid of falling forces"),
            option(
                "switch",
                "rate over which the share of the sigmoids changes by a factor of e",
                quantity(Unit::NewtonPerSecond, Range::POSITIVE),
            ),
            volts(
                "floor",
                "voltage of a cell that does not conduct, which does not creep, in F4",
            ),
        ]),
    )
}

fn piezoelectric() -> OptionSpec {
    let gain = |name, about| option(name, about, quantity(Unit::VoltSecondPerNewton, Range::ANY));
    let decay = |name, about: &str, unit: &str| {
        option(
            name,
            about,
            Accepts::Group(vec![
                option(
                    "value",
                    &format!("at frequency 0, in {unit}"),
                    number(Range::ANY),
                ),
                option(
                    "scale",
                    "frequency at which it has fallen to 1/e",
                    quantity(Unit::Hertz, Range::POSITIVE),
                ),
            ]),
        )
    };
    option(
        "piezoelectric",
        "piezoelectric cell; F1 requires `gain`, F2 `rate` and `acceleration`, F3 and F4 `gain` and the times",
        Accepts::Group(vec![
            option(
                "noise",
                "deviation of its voltage; without it the voltage is not used",
                quantity(Unit::Volt, Range::POSITIVE),
            ),
            option(
                "max",
                "greatest plausible magnitude of its voltage: that of the amplifier's rails (none)",
                quantity(Unit::Volt, Range::POSITIVE),
            ),
            gain(
                "gain",
                "sensitivity to the rate of the force: V = gain · rate in F1 and at low frequencies in F3 and F4",
            ),
            option(
                "amplifier_time",
                "time constant of the amplifier, in F3 and F4",
                Accepts::PositiveDuration,
            ),
            option(
                "silicone_time",
                "time constant of the silicone, in F3 and F4",
                Accepts::PositiveDuration,
            ),
            decay("rate", "coefficient of the rate, in F2", "V·s/N"),
            decay(
                "acceleration",
                "coefficient of the acceleration, in F2",
                "V·s²/N",
            ),
        ]),
    )
}

/// Calibrations that filters take.
#[derive(Clone, Copy)]
pub enum NamedCalibrations<'c> {
    /// Those that the filters name.
    Own,
    /// This one, in place of each of those.
    Replaced(&'c Calibration),
}

/// Returns the names of the calibrations of the filters.
pub(super) fn calibrations(options: &Options) -> Vec<Placed<String>> {
    let name = |(_, value): &(Placed<String>, OptionValue)| match value {
        OptionValue::Group(keys) => keys.name(CALIBRATION).cloned(),
        _ => None,
    };
    options.named(FILTER).iter().filter_map(name).collect()
}

/// Returns the filters of a bus.
///
/// # Errors
/// Options that no filter can have, or a calibration that cannot be read.
pub fn filters(
    context: &BusContext<'_>,
    calibrations: NamedCalibrations<'_>,
) -> Result<Vec<LoadFilter>, BuildError> {
    let config = config(context)?;
    let signal = config.signal.as_str();
    let rate = 1.0 / config.period.as_secs_f64();
    let filter = |(name, value): &(Placed<String>, OptionValue)| {
        let OptionValue::Group(keys) = value else {
            return Err(format!("`{FILTER}.{}` is not a table", name.value).into());
        };
        if TAKEN.contains(&name.value.as_str()) {
            let why = format!(
                "`{signal}/{0}` is another signal: `{FILTER}.{0}` requires another name",
                name.value
            );
            return Err(why.into());
        }
        let frequency = keys.group("frequency");
        let calibration = keys.name(CALIBRATION).map(|name| match calibrations {
            NamedCalibrations::Replaced(other) => Ok(other),
            NamedCalibrations::Own => {
                let mut known = context.calibrations.iter();
                let found = known.find(|(known, _)| *known == name.value);
                let missing = || BuildError::from(format!("`{}` has not been read", name.value));
                found.map(|found| &found.1).ok_or_else(missing)
            }
        });
        let built = calibration.transpose().and_then(|calibration| {
            let constants = Constants::of(keys, calibration)?;
            Ok(LoadFilter::new(LoadFilterConfig {
                name: name.value.clone(),
                signal: signal.to_owned(),
                settings: settings(keys, &constants)?,
                low_pass: keys.number("low_pass").map(|cutoff| [cutoff, rate]),
                ranges: [
                    range(keys.group("piezoresistive"), f64::NEG_INFINITY),
                    range(keys.group("piezoelectric"), -1.0),
                ],
                frequency: frequency
                    .and_then(|it| it.text("signal"))
                    .map(str::to_owned),
                reference: signal.starts_with(BENCH),
            })?)
        });
        built.map_err(|error| format!("`{FILTER}.{}`: {error}", name.value).into())
    };
    options_of(context).iter().map(filter).collect()
}

fn options_of<'a>(context: &BusContext<'a>) -> &'a [(Placed<String>, OptionValue)] {
    context.options.named(FILTER)
}

/// Returns the range in which a voltage is plausible: up to `max`, and from `min`, or `least` times
/// the maximum.
fn range(group: Option<&Options>, least: f64) -> RangeInclusive<f64> {
    let number = |name: &str| group.and_then(|group| group.number(name));
    let max = number("max").unwrap_or(f64::INFINITY);
    number("min").unwrap_or(least * max)..=max
}

fn settings(keys: &Options, constants: &Constants<'_>) -> Result<Settings, BuildError> {
    let noise = |group: Option<&Options>| group.and_then(|group| group.number("noise"));
    let square = |x: f64| x * x;
    let cell = keys.group("piezoresistive").map(|group| {
        let response = constants.response(group)?;
        let variance = square(required(group, "piezoresistive", "noise")?);
        Ok::<_, BuildError>(Piezoresistive { response, variance })
    });
    let frequency = keys.group("frequency").map(|frequency| {
        let hertz = frequency.number("noise").unwrap_or(FREQUENCY_NOISE);
        square(TAU * hertz)
    });
    Ok(Settings {
        model: model(keys, constants)?,
        piezoresistive: cell.transpose()?,
        piezoelectric: noise(keys.group("piezoelectric")).map(square),
        frequency,
        period_s: 1e-3,
        white: keys.number("white").unwrap_or_default(),
        recovery: (keys.boolean("recovery") != Some(false)).then_some(RECOVERY),
    })
}

/// Default deviation of a measured frequency \[Hz\].
const FREQUENCY_NOISE: f64 = 0.05;

fn model(keys: &Options, constants: &Constants<'_>) -> Result<Model, BuildError> {
    let state = |name: &str| state(keys, name);
    Ok(match keys.text("model") {
        Some("F1") => Model::F1 {
            gain: constants.rate_gain()?,
            states: ["force", "rate", "bias"].map(state),
        },
        Some("F2") => Model::F2 {
            rate: constants.rate()?,
            acceleration: constants.acceleration()?,
            states: ["force", "rate", "acceleration", "frequency", "bias"].map(state),
        },
        Some("F4") => Model::F4 {
            amplifier: constants.amplifier()?,
            floor: constants.floor()?,
            states: [
                "force",
                "rate",
                "acceleration",
                "crystal_rate",
                "voltage",
                "gain",
                "creep",
                "bias",
            ]
            .map(state),
        },
        _ => Model::F3 {
            amplifier: constants.amplifier()?,
            states: [
                "force",
                "rate",
                "acceleration",
                "crystal_rate",
                "voltage",
                "bias",
            ]
            .map(state),
        },
    })
}

/// Default deviations of the state variables at the start, in the order of [`STATES`]: a load that
/// is near zero and at rest.
const INITIAL: [f64; 9] = [1.0, 10.0, 100.0, 10.0, 0.1, 1.0, 0.1, 0.1, 0.1];

/// Returns the initial value and noise of a state variable.
fn state(keys: &Options, name: &str) -> StateSettings {
    let index = STATES.iter().position(|(known, _)| *known == name);
    let unit = if name == "frequency" { TAU } else { 1.0 };
    let deviation = |table: &str| keys.group(table)?.number(name);
    let square = |x: f64| x * unit * (x * unit);
    let initial = index.map_or(0.0, |index| INITIAL[index]);
    StateSettings {
        initial: 0.0,
        variance: square(deviation("initial").unwrap_or(initial)),
        noise: square(deviation("process").unwrap_or_default()),
    }
}
