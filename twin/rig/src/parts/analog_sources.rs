//! Sources of the analog inputs of boards, from scenario options such as `inputs.3 = { signal =
//! "…", scale = 0.1 }`.

use twinrig_document::Range;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};
use twinrig_wire::{AnalogInput, AnalogSource};

use crate::error::BuildError;
use crate::parts::option::{number, option};

/// Returns the option `name` for a board with `count` analog inputs.
pub(crate) fn inputs(name: &str, about: &str, count: usize) -> OptionSpec {
    let analog_source = || {
        Accepts::Group(vec![
            option("signal", "signal of the plant", Accepts::Text),
            option(
                "component",
                "component of the signal (0)",
                Accepts::Natural(0..=u64::from(u8::MAX)),
            ),
            option(
                "scale",
                "reading of the input per unit of the signal (1)",
                number(Range::ANY),
            ),
            option(
                "offset",
                "reading of the input at zero (0)",
                number(Range::ANY),
            ),
        ])
    };
    let channels =
        (0..count).map(|channel| option(&channel.to_string(), "analog input", analog_source()));
    option(name, about, Accepts::Group(channels.collect()))
}

/// Returns the connected inputs of the option `name`.
pub(crate) fn analog_inputs(options: &Options, name: &str) -> Result<Vec<AnalogInput>, BuildError> {
    let Some(channels) = options.group(name) else {
        return Ok(Vec::new());
    };
    let mut inputs = Vec::new();
    for (channel, _) in channels.iter() {
        let Some(source) = channels.group(channel) else {
            continue;
        };
        let signal = source.text("signal");
        let signal = signal.ok_or_else(|| format!("`{name}.{channel}` names no `signal`"))?;
        let component = source.natural("component").unwrap_or_default();
        inputs.push(AnalogInput {
            channel: channel.parse()?,
            analog_source: Some(AnalogSource {
                signal: signal.to_owned(),
                component: usize::try_from(component)?,
                scale: source.number("scale").unwrap_or(1.0),
                offset: source.number("offset").unwrap_or_default(),
            }),
        });
    }
    Ok(inputs)
}

/// Returns the plant signals connected by the option `name`.
pub(crate) fn signals(options: &Options, name: &str) -> Vec<String> {
    let channels = options.group(name);
    let channels = channels.into_iter().flat_map(Options::iter);
    let signal = |value: &OptionValue| match value {
        OptionValue::Group(analog_source) => analog_source.text("signal").map(str::to_owned),
        _ => None,
    };
    channels.filter_map(|(_, value)| signal(value)).collect()
}

/// Returns the option for the rate error of a board's clock.
pub(crate) fn clock_option() -> OptionSpec {
    let about = "relative rate error of the board's clock; positive: fast";
    option("clock", about, number(Range::between(-0.1, 0.1)))
}

/// Returns the clock given by the option of [`clock_option`].
pub(crate) fn clock(options: &Options) -> Result<twinrig_kernel::BoardClock, BuildError> {
    let rate_ppb = libm::rint(options.number("clock").unwrap_or_default() * 1e9);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the magnitude of the option is at most 0.1"
    )]
    let rate_ppb = rate_ppb as i64;
    let offset = twinrig_kernel::LocalDuration::ZERO;
    Ok(twinrig_kernel::BoardClock::new(offset, rate_ppb)?)
}
