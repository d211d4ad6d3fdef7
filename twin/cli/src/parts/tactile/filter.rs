//! Filters of the load, from scenario options.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use twinrig_document::Range;
use twinrig_estimate::{
    ChargeAmplifier, Decay, ForceResponse, Hysteresis, Model, Piezoresistive, RECOVERY, Settings,
    Sigmoid, StateSettings,
};
use twinrig_kernel::{SimDuration, Unit};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};
use twinrig_tactile::{LoadFilter, LoadFilterConfig};

use crate::error::BuildError;
use crate::parts::option::{choice, number, option};

/// Name of the table.
pub(super) const FILTER: &str = "filter";

const MODELS: [&str; 3] = ["F3", "F1", "F2"];
/// Last parts of other signals below a load.
const TAKEN: [&str; 5] = [
    "rate",
    "conductance",
    "piezoresistive",
    "piezoelectric",
    "reference",
];
const LINEAR: &str = "linear";
const LOADING: &str = "loading";
const UNLOADING: &str = "unloading";
/// Names of the state variables of all models, with their units.
const STATES: [(&str, Unit); 7] = [
    ("force", Unit::Newton),
    ("rate", Unit::NewtonPerSecond),
    ("acceleration", Unit::One),
    ("crystal_rate", Unit::NewtonPerSecond),
    ("voltage", Unit::Volt),
    ("frequency", Unit::Hertz),
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
            "density of white noise of the derivative of the highest derivative of the force: N²/s³ in F1, N²/s⁵ in F2 and F3 (0)",
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
            "crystal_rate" => "of the rate behind the silicone, in F3".to_owned(),
            "voltage" => "of the amplifier, in F3".to_owned(),
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
        "piezoelectric cell; F1 requires `gain`, F2 `rate` and `acceleration`, F3 `gain` and the times",
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
                "sensitivity to the rate of the force: V = gain · rate in F1 and at low frequencies in F3",
            ),
            option(
                "amplifier_time",
                "time constant of the amplifier, in F3",
                Accepts::PositiveDuration,
            ),
            option(
                "silicone_time",
                "time constant of the silicone, in F3",
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

/// Returns the filters of a sensor at the load `signal`, sampled at a period; `reference`: a
/// reference cell measures the load.
pub(super) fn filters(
    options: &Options,
    signal: &str,
    period: SimDuration,
    reference: bool,
) -> Result<Vec<LoadFilter>, BuildError> {
    let filter = |(name, value): &(twinrig_document::Placed<String>, OptionValue)| {
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
        let rate = 1.0 / period.as_secs_f64();
        let frequency = keys.group("frequency");
        let built = settings(keys).and_then(|settings| {
            Ok(LoadFilter::new(LoadFilterConfig {
                name: name.value.clone(),
                signal: signal.to_owned(),
                settings,
                low_pass: keys.number("low_pass").map(|cutoff| [cutoff, rate]),
                ranges: [
                    range(keys.group("piezoresistive"), f64::NEG_INFINITY),
                    range(keys.group("piezoelectric"), -1.0),
                ],
                frequency: frequency
                    .and_then(|it| it.text("signal"))
                    .map(str::to_owned),
                reference,
            })?)
        });
        built.map_err(|error| format!("`{FILTER}.{}`: {error}", name.value).into())
    };
    options.named(FILTER).iter().map(filter).collect()
}

/// Returns the range in which a voltage is plausible: up to `max`, and from `min`, or `least` times
/// the maximum.
fn range(group: Option<&Options>, least: f64) -> RangeInclusive<f64> {
    let number = |name: &str| group.and_then(|group| group.number(name));
    let max = number("max").unwrap_or(f64::INFINITY);
    number("min").unwrap_or(least * max)..=max
}

fn settings(keys: &Options) -> Result<Settings, BuildError> {
    let noise = |group: Option<&Options>| group.and_then(|group| group.number("noise"));
    let square = |x: f64| x * x;
    let cell = keys.group("piezoresistive").map(|group| {
        let response = response(group)?;
        let variance = square(required(group, "piezoresistive", "noise")?);
        Ok::<_, BuildError>(Piezoresistive { response, variance })
    });
    let frequency = keys.group("frequency").map(|frequency| {
        let hertz = frequency.number("noise").unwrap_or(FREQUENCY_NOISE);
        square(TAU * hertz)
    });
    Ok(Settings {
        model: model(keys)?,
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

fn required(group: &Options, table: &str, name: &str) -> Result<f64, BuildError> {
    let missing = || format!("`{table}` has no `{name}`");
    group.number(name).ok_or_else(|| missing().into())
}

fn response(group: &Options) -> Result<ForceResponse, BuildError> {
    const TABLE: &str = "piezoresistive";
    if let Some(linear) = group.group(LINEAR) {
        return Ok(ForceResponse::Linear {
            gain: required(linear, LINEAR, "per_newton")?,
            offset: required(linear, LINEAR, "offset")?,
        });
    }
    let sigmoid = |name: &str| {
        let branch = group.group(name);
        let branch =
            branch.ok_or_else(|| format!("`{TABLE}` has neither `{LINEAR}` nor `{name}`"))?;
        Ok::<_, BuildError>(Sigmoid {
            a: required(branch, name, "rise")?,
            b: -1.0 / required(branch, name, "width")?,
            c: -required(branch, name, "mid")?,
            d: required(branch, name, "base")?,
        })
    };
    Ok(ForceResponse::Hysteresis(Hysteresis {
        loading: sigmoid(LOADING)?,
        unloading: sigmoid(UNLOADING)?,
        switch: 1.0 / required(group, TABLE, "switch")?,
    }))
}

fn model(keys: &Options) -> Result<Model, BuildError> {
    const TABLE: &str = "piezoelectric";
    let empty = Options::default();
    let group = keys.group(TABLE).unwrap_or(&empty);
    let gain = || required(group, TABLE, "gain");
    let time = |name: &str| {
        let time = group.duration(name).map(SimDuration::as_secs_f64);
        time.ok_or_else(|| BuildError::from(format!("`{TABLE}` has no `{name}`")))
    };
    let decay = |name: &str| {
        let decay = group.group(name);
        let decay = decay.ok_or_else(|| BuildError::from(format!("`{TABLE}` has no `{name}`")))?;
        Ok::<_, BuildError>(Decay {
            value: required(decay, name, "value")?,
            scale_hz: required(decay, name, "scale")?,
        })
    };
    let state = |name: &str| state(keys, name);
    Ok(match keys.text("model") {
        Some("F1") => Model::F1 {
            gain: gain()?,
            states: ["force", "rate", "bias"].map(state),
        },
        Some("F2") => Model::F2 {
            rate: decay("rate")?,
            acceleration: decay("acceleration")?,
            states: ["force", "rate", "acceleration", "frequency", "bias"].map(state),
        },
        _ => Model::F3 {
            amplifier: ChargeAmplifier {
                // The gain is that of the sensor; the amplifier inverts.
                sensitivity: -gain()?,
                feedback_s: time("amplifier_time")?,
                lag_s: time("silicone_time")?,
            },
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
const INITIAL: [f64; 7] = [1.0, 10.0, 100.0, 10.0, 0.1, 1.0, 0.1];

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
