//! Reading `[io]`, `[observe]` and `[record]`.

use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};
use twinrig_runtime::Timing;

use super::controller::io_default;
use super::time::TIME;
use crate::language::{Key, TableSpec, Type, quantity, table};
use crate::scenario::{ControllerSpec, IoSpec, RecordSpec};

table! {
    /// Keys of `[io]`.
    pub(super) io_table = TableSpec::new("[io]", "transfers between controller and plant");
    STEP: SimDuration = "step", Type::POSITIVE_DURATION,
        "step of the I/O, which divides the controller's period", r#"step = "1 ms""#,
        otherwise("the controller's period");
    TRANSFER_TIME: Timing = "transfer_time", TIME, "duration of a transfer",
        r#"transfer_time = "300 us""#, default("'0 s'");
}

table! {
    /// Keys of `[observe]`.
    pub(super) observe_table = TableSpec::new("[observe]", "observation of the plant");
    PERIOD: SimDuration = "period", Type::POSITIVE_DURATION, "observation period of the plant",
        r#"period = "1 ms""#, default("'2 ms'");
}

/// Default of `[observe] period`, for the checks of a scenario whose own is not valid.
pub(super) const OBSERVE_PERIOD: SimDuration = SimDuration::from_millis(2);

table! {
    /// Keys of `[record]`.
    pub(super) record_table = TableSpec::new("[record]", "recording of the run");
    SIGNALS: Vec<Placed<String>> = "signals", Type::NAMES,
        "names of recorded signals; `*` and `**` are wildcards",
        r#"signals = ["body/*", "leg/**"]"#, otherwise("all");
    FRAMES: f64 = "frames", quantity(Unit::Hertz, Range::between(0.0, 1e6)),
        r#"rate at which poses are recorded; `"0 Hz"`: none"#, r#"frames = "25 Hz""#,
        default("'50 Hz'");
    BYTES: bool = "bytes", Type::BOOLEAN,
        "whether the bytes on the wires are recorded", "bytes = true",
        default("false");
}

/// Reads `[io]`.
pub(super) fn io(item: &Item<'_>, control: Option<&ControllerSpec>) -> Result<IoSpec, Reported> {
    use io_table::{STEP, TRANSFER_TIME};
    let table = &item.table()?;
    let table = io_table::TABLE.of(table);
    let (step, transfer_time) = (table.get(&STEP), table.read(&TRANSFER_TIME));
    let step = step?.unwrap_or(io_default(control).step);
    if let Some(control) = control
        && !control.period.is_multiple_of(step)
    {
        let message = "the controller's period is not a multiple of the step of its I/O";
        let help = format!("the period is {}; the step must divide it", control.period);
        return Err(table.report(&STEP, message, help));
    }
    Ok(IoSpec {
        step,
        transfer_time: transfer_time?,
    })
}

/// Reads `[observe]`.
pub(super) fn observe(item: &Item<'_>) -> Result<SimDuration, Reported> {
    observe_table::TABLE
        .of(&item.table()?)
        .read(&observe_table::PERIOD)
}

/// Reads `[record]`.
pub(super) fn record(item: &Item<'_>) -> Result<RecordSpec, Reported> {
    use record_table::{BYTES, FRAMES, SIGNALS};
    let table = &item.table()?;
    let table = record_table::TABLE.of(table);
    let (signals, frames) = (table.get(&SIGNALS), table.read(&FRAMES));
    let bytes = table.read(&BYTES);
    Ok(RecordSpec {
        signals: signals?,
        frames: Some(frames?).filter(|rate| *rate > 0.0),
        bytes: bytes?,
    })
}
