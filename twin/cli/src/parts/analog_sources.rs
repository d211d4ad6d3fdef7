//! What is connected to the analog inputs of boards, out of a scenario's words: `inputs.3 = { signal = "…", scale = 0.1 }`.

use twinrig_document::Range;
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};
use twinrig_wire::AnalogSource;

use crate::error::BuildError;
use crate::parts::option::{number, option};

/// The option `name`, for a board with so many inputs.
pub(crate) fn inputs(name: &str, about: &str, count: usize) -> OptionSpec {
    let analog_source = || {
        Accepts::Group(vec![
            option("signal", "of the plant", Accepts::Text),
            option(
                "component",
                "of the signal (0)",
                Accepts::Natural(0..=u64::from(u8::MAX)),
            ),
            option(
                "scale",
                "what the input reads for one unit of the signal (1)",
                number(Range::ANY),
            ),
            option(
                "offset",
                "what the input reads for zero (0)",
                number(Range::ANY),
            ),
        ])
    };
    let channels =
        (0..count).map(|channel| option(&channel.to_string(), "an input", analog_source()));
    option(name, about, Accepts::Group(channels.collect()))
}

/// The inputs that the option `name` connects, by number.
pub(crate) fn analog_sources(
    options: &Options,
    name: &str,
) -> Result<Vec<(usize, AnalogSource)>, BuildError> {
    let Some(channels) = options.group(name) else {
        return Ok(Vec::new());
    };
    let analog_source = |channel: &str| {
        let analog_source = channels.group(channel)?;
        Some((channel.parse(), analog_source))
    };
    let mut analog_sources = Vec::new();
    for (number, analog_source) in channels
        .iter()
        .filter_map(|(channel, _)| analog_source(channel))
    {
        let number = number?;
        let signal = analog_source.text("signal");
        let signal = signal.ok_or_else(|| format!("`{name}.{number}` names no `signal`"))?;
        let component = analog_source.natural("component").unwrap_or_default();
        let analog_source = AnalogSource {
            signal: signal.to_owned(),
            component: usize::try_from(component)?,
            scale: analog_source.number("scale").unwrap_or(1.0),
            offset: analog_source.number("offset").unwrap_or_default(),
        };
        analog_sources.push((number, analog_source));
    }
    Ok(analog_sources)
}

/// The signals of the plant that the option `name` connects.
pub(crate) fn signals(options: &Options, name: &str) -> Vec<String> {
    let channels = options.group(name);
    let channels = channels.into_iter().flat_map(Options::iter);
    let signal = |value: &OptionValue| match value {
        OptionValue::Group(analog_source) => analog_source.text("signal").map(str::to_owned),
        _ => None,
    };
    channels.filter_map(|(_, value)| signal(value)).collect()
}

/// The option for a board's clock.
pub(crate) fn clock_option() -> OptionSpec {
    let about = "by how much the clock of the board is fast";
    option("clock", about, number(Range::between(-0.1, 0.1)))
}

/// That clock.
pub(crate) fn clock(options: &Options) -> Result<twinrig_kernel::BoardClock, BuildError> {
    let rate_ppb = libm::rint(options.number("clock").unwrap_or_default() * 1e9);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the option is a tenth at most"
    )]
    let rate_ppb = rate_ppb as i64;
    let offset = twinrig_kernel::LocalDuration::ZERO;
    Ok(twinrig_kernel::BoardClock::new(offset, rate_ppb)?)
}
