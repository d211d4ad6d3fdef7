//! Timing of a USB converter between host and bus, from scenario options.

use twinrig_document::Range;
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;
use twinrig_scenario::{Accepts, OptionSpec, Options};
use twinrig_wire::{UsbPreset, UsbTiming};

use crate::error::BuildError;
use crate::parts::option::{choice, number, option};

/// Maximum setting of the latency timer of an FT2232H (FTDI, AN232B-04).
const LATENCY_TIMER_MAX: SimDuration = SimDuration::from_millis(255);

/// Returns the keys of the table `usb`.
pub(super) fn options() -> Vec<OptionSpec> {
    vec![
        choice(
            "preset",
            "preset of the host timing",
            &UsbPreset::ALL.map(UsbPreset::name),
        ),
        option(
            "latency_timer",
            "latency timer of the converter",
            Accepts::Duration,
        ),
        option(
            "turnaround",
            "delay from a completion to the waiting program",
            Accepts::Duration,
        ),
        option(
            "jitter",
            "delay of reads of the host in addition to the turnaround",
            Accepts::Time,
        ),
        option(
            "write_jitter",
            "delay of writes of the host before the USB frame",
            Accepts::Time,
        ),
        option(
            "frame_offset",
            "reading of the USB frame clock at the start",
            Accepts::Duration,
        ),
        option(
            "frame_clock",
            "relative rate error of the USB frame clock; positive: fast",
            number(Range::between(-0.1, 0.1)),
        ),
    ]
}

/// Returns the timing that the table `usb` states.
pub(super) fn timing(options: Option<&Options>) -> Result<UsbTiming, BuildError> {
    let Some(options) = options else {
        return Ok(UsbTiming::default());
    };
    let preset = options
        .text("preset")
        .map_or(Ok(UsbPreset::default()), str::parse)?;
    let default = UsbTiming::preset(preset);
    let duration = |name, default| options.duration(name).unwrap_or(default);
    let time = |name, default: &Timing| options.time(name).unwrap_or(default).clone();
    let latency_timer = duration("latency_timer", default.latency_timer);
    if latency_timer > LATENCY_TIMER_MAX {
        let why = format!("the latency timer of the converter is limited to {LATENCY_TIMER_MAX}");
        return Err(why.into());
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the magnitude of the option is at most 0.1"
    )]
    let frame_rate_ppb = libm::rint(options.number("frame_clock").unwrap_or(0.0) * 1e9) as i64;
    Ok(UsbTiming {
        latency_timer,
        turnaround: duration("turnaround", default.turnaround),
        jitter: time("jitter", &default.jitter),
        write_jitter: time("write_jitter", &default.write_jitter),
        frame_offset: duration("frame_offset", default.frame_offset),
        frame_rate_ppb,
        ..default
    })
}
