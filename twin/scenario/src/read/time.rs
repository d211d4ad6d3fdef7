//! Reading time models.

use twinrig_document::{Item, Reported};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use crate::language::{Accepts, Key, Shape, TableSpec, Type, table};

/// A time model: a duration, a distribution, or a trace.
pub(crate) const TIME: Type<Timing> = Type::new(
    Shape::Either(&[
        Shape::One(Accepts::Duration),
        Shape::Table(time_table::TABLE),
    ]),
    |item, _| time_model(item),
);

/// Durations that are used in turn.
const TRACE: Type<Vec<SimDuration>> =
    Type::new(Shape::list(&Shape::One(Accepts::Duration), 1), |item, _| {
        item.each(Item::duration)
    });

table! {
    /// Keys of a time model.
    pub(crate) time_table = TableSpec::new("time", "distribution of durations, or a trace of them")
        .refined(|schema| {
            schema["anyOf"] = serde_json::json!([
                { "required": [TRACE.name], "maxProperties": 1 },
                { "required": [MIN.name, MAX.name], "properties": { TRACE.name: false } },
            ]);
        });
    MIN: SimDuration = "min", Type::DURATION, "least duration, uniform without `mean`",
        r#"min = "200 us", max = "900 us""#;
    MAX: SimDuration = "max", Type::DURATION,
        "greatest duration", r#"min = "200 us", max = "900 us""#;
    MEAN: SimDuration = "mean", Type::DURATION,
        "mean of a normal distribution, truncated to `min` and `max`",
        r#"mean = "0.3 ms", deviation = "50 us", min = "0 ms", max = "1 ms""#, needs("deviation");
    DEVIATION: SimDuration = "deviation", Type::DURATION, "its standard deviation",
        r#"mean = "1 ms", deviation = "0.1 ms", min = "0 ms", max = "2 ms""#, needs("mean");
    TRACE: Vec<SimDuration> = "trace", super::TRACE, "durations, used in turn",
        r#"trace = ["0.3 ms", "0.4 ms"]"#;
}

/// Reads a time model: a duration, or a table.
pub(crate) fn time_model(item: &Item<'_>) -> Result<Timing, Reported> {
    if !item.is_table() {
        return Ok(Timing::Constant(item.duration()?));
    }
    let table = &item.table()?;
    let table = time_table::TABLE.of(table);
    let (min, max) = (table.get(&time_table::MIN), table.get(&time_table::MAX));
    let (mean, deviation) = (
        table.get(&time_table::MEAN),
        table.get(&time_table::DEVIATION),
    );
    let trace = table.get(&time_table::TRACE);
    match (min?, max?, mean?, deviation?, trace?) {
        (None, None, None, None, Some(trace)) if !trace.is_empty() => Ok(Timing::Trace(trace)),
        (Some(min), Some(max), None, None, None) if min <= max => Ok(Timing::Uniform { min, max }),
        (Some(min), Some(max), Some(mean), Some(deviation), None) if min <= mean && mean <= max => {
            Ok(Timing::Normal {
                mean,
                deviation,
                min,
                max,
            })
        }
        _ => {
            let message = format!("`{}` is not a valid time model", item.key());
            let help = "write a duration, { min, max }, { mean, deviation, min, max } with min ≤ mean ≤ max, or { trace = [ … ] }";
            Err(item.report(message, help))
        }
    }
}
