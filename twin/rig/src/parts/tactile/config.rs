//! Settings of the acquisition of a bus.

use twinrig_kernel::SimTime;
use twinrig_runtime::{FaultKind, FaultSelection};
use twinrig_scenario::Options;
use twinrig_tactile::{CHANNELS, SampleChoice, Tactile, Unplugged};
use twinrig_wire::{AnalogInput, AnalogSource};

use crate::error::BuildError;
use crate::parts::analog_sources::clock;
use crate::parts::bus_kind::BusContext;

/// Default load at which the sensors are mounted.
pub(super) const SIGNAL: &str = "bench/force";
/// Prefix of the loads that a reference cell measures.
pub(super) const BENCH: &str = "bench/";
pub(super) const NEWEST: &str = "newest";
pub(super) const FRESH: &str = "fresh";

/// Returns the load at which the sensor is mounted.
pub(super) fn signal(options: &Options) -> &str {
    options.text("signal").unwrap_or(SIGNAL)
}

/// Returns the channels with the plant signals that they measure: the voltages below the load, and
/// the load itself, which the reference cell carries.
pub(super) fn sources(options: &Options) -> [(usize, String); 3] {
    let signal = signal(options);
    let [piezoresistive, piezoelectric, _] = CHANNELS;
    [
        (0, format!("{signal}/{piezoresistive}")),
        (1, format!("{signal}/{piezoelectric}")),
        (2, signal.to_owned()),
    ]
}

/// Returns the cables that faults unplug, at places named after the channels.
fn unplugged(context: &BusContext<'_>) -> Result<Vec<Unplugged>, BuildError> {
    let mut all = Vec::new();
    for (place, fault) in context.faults {
        let Some(channel) = CHANNELS.iter().position(|channel| channel == place) else {
            continue;
        };
        if !matches!(fault.kind, FaultKind::Unplug { .. }) {
            let why = format!(
                "the cable of a sensor can be unplugged only: `{}` is a fault of the line, `wire/{}`",
                fault.kind.name(),
                context.name
            );
            return Err(why.into());
        }
        if fault.select != FaultSelection::default() {
            let why = "the cable of a sensor is unplugged in a window of time: it has no direction, \
                       phase and frames";
            return Err(why.into());
        }
        let end = fault.lasts.and_then(|lasts| fault.at.checked_add(lasts));
        all.push(Unplugged {
            channel,
            from: fault.at,
            to: end.unwrap_or(SimTime::MAX),
        });
    }
    Ok(all)
}

/// Returns the acquisition of a bus, without filters.
pub(super) fn config(context: &BusContext<'_>) -> Result<Tactile, BuildError> {
    let options = context.options;
    let mut tactile = Tactile::new(context.name, signal(options));
    let input = |(channel, signal)| AnalogInput {
        channel,
        analog_source: Some(AnalogSource {
            signal,
            component: 0,
            scale: 1.0,
            offset: 0.0,
        }),
    };
    tactile.inputs = sources(options).map(input).into();
    tactile.period = options.duration("period").unwrap_or(tactile.period);
    if let Some(conversions) = options.text("oversampling") {
        tactile.oversampling = conversions.parse()?;
    }
    if options.text("take") == Some(FRESH) {
        tactile.take = SampleChoice::Fresh;
    }
    tactile.zero = options.boolean("zero").unwrap_or_default();
    let noise = options.group("noise");
    for (deviation, channel) in tactile.noise.iter_mut().zip(CHANNELS) {
        let set = noise.and_then(|noise| noise.number(channel));
        *deviation = set.unwrap_or(*deviation);
    }
    tactile.jitter = options.time("jitter").cloned().unwrap_or(tactile.jitter);
    tactile.clock = clock(options)?;
    tactile.unplugged = unplugged(context)?;
    tactile.seed = context.seed;
    Ok(tactile)
}
