//! Reading `[[sensor]]`.

use serde_json::json;
use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};
use twinrig_runtime::{SensorModel, Timing};

use super::time::TIME;
use super::{code, print_duration};
use crate::language::{Declared, Key, Shape, TableSpec, Type, contextual, quantity, table};
use crate::scenario::SensorSpec;

/// Values in the unit of the signal, which is not known yet.
const AT_LEAST_0: Shape = Shape::Measured(Range::NOT_NEGATIVE);
const ENDS: Shape = Shape::set(&Shape::Measured(Range::ANY), 2);

table! {
    /// Keys of `[[sensor]]`.
    pub(super) sensor_table = TableSpec::new("[[sensor]]", "sensor of inputs of the controller")
        .refined(|schema| schema["properties"][RANGE.name]["maxItems"] = json!(2));
    NAME: String = "name", Type::TEXT, "name, which selects its random numbers",
        r#"name = "load cells""#, otherwise("that of each signal");
    OF: Placed<String> = "of", Type::PLACED,
        "signal that the controller reads, or pattern of signals",
        r#"of = "leg/*/foot/load""#, required();
    PERIOD: SimDuration = "period", Type::POSITIVE_DURATION, "period of the samples",
        r#"period = "5 ms""#, otherwise("a sample at each transfer");
    DELAY: Timing = "delay", TIME, "time from a sample to its arrival", r#"delay = "3 ms""#,
        default("'0 s'");
    NOISE: () = "noise", contextual(AT_LEAST_0), "standard deviation of white noise",
        r#"noise = "0.1 N""#, otherwise("none");
    BIAS: () = "bias", contextual(Shape::Measured(Range::ANY)), "constant error",
        r#"bias = "-0.2 N""#, otherwise("none");
    RANDOM_WALK: () = "random_walk", contextual(AT_LEAST_0),
        "standard deviation of a random walk after one second", r#"random_walk = "0.2 N""#,
        otherwise("none");
    RESOLUTION: () = "resolution", contextual(AT_LEAST_0), "values are multiples of it",
        r#"resolution = "0.1 N""#, otherwise("none");
    RANGE: () = "range", contextual(ENDS), "least and greatest value",
        r#"range = ["0 N", "50 N"]"#, otherwise("none");
    DROP_OUT: f64 = "drop_out", quantity(Unit::One, Range::between(0.0, 1.0)),
        "probability that a sample is lost: the one before stays", "drop_out = 0.01", default("0");
}

/// Reads all `[[sensor]]`; `has_controller` is none if its table has a problem.
pub(super) fn sensors(
    root: Declared<'_, '_>,
    key: &Key<()>,
    has_controller: Option<bool>,
    run: SimDuration,
) -> Result<Vec<SensorSpec>, Reported> {
    let read = |item: &Item<'_>| item.each(|item| sensor(item, run));
    let sensors = root.get_with(key, read)?.unwrap_or_default();
    if !sensors.is_empty() && has_controller == Some(false) {
        let help = "add a [controller], or remove the sensors";
        return Err(root.report(key, "there is no controller that reads sensors", help));
    }
    Ok(sensors)
}

fn sensor(item: &Item<'_>, run: SimDuration) -> Result<SensorSpec, Reported> {
    use sensor_table::{
        BIAS, DELAY, DROP_OUT, NAME, NOISE, OF, PERIOD, RANDOM_WALK, RANGE, RESOLUTION,
    };
    let table = &item.table()?;
    let table = sensor_table::TABLE.of(table);
    let (name, of) = (table.get(&NAME), table.read(&OF));
    let (period, delay) = (table.get(&PERIOD), table.read(&DELAY));
    let drop_out = table.read(&DROP_OUT);
    let mut unit = None;
    let mut value = |key: &Key<()>, range: Range| {
        table.get_with(key, |item| {
            let unit = one_unit(item, &mut unit)?;
            item.quantity(unit, &range)
        })
    };
    let (noise, bias) = (value(&NOISE, Range::NOT_NEGATIVE), value(&BIAS, Range::ANY));
    let random_walk = value(&RANDOM_WALK, Range::NOT_NEGATIVE);
    let resolution = value(&RESOLUTION, Range::NOT_NEGATIVE);
    let range = table.get_with(&RANGE, |item| ends(item, &mut unit));
    let delay = delay?;
    if delay.longest() >= run
        && let Some(item) = table.item(&DELAY)
    {
        let message = format!(
            "the run ends at {}: samples of the longest delay never arrive",
            print_duration(run)
        );
        item.warn(code::DELAY, message, "give a shorter delay");
    }
    Ok(SensorSpec {
        name: name?,
        of: of?,
        model: SensorModel {
            period: period?,
            delay,
            noise: noise?.unwrap_or(0.0),
            bias: bias?.unwrap_or(0.0),
            random_walk: random_walk?.unwrap_or(0.0),
            resolution: resolution?.unwrap_or(0.0),
            range: range?,
            drop_out: drop_out?,
        },
        unit,
    })
}

/// Returns the unit of a value, which is that of the values before it.
fn one_unit(item: &Item<'_>, unit: &mut Option<Placed<Unit>>) -> Result<Unit, Reported> {
    if let Some(unit) = unit {
        return Ok(unit.value);
    }
    let value = item.any_unit()?;
    let place = item.place();
    *unit = Some(Placed { value, place });
    Ok(value)
}

/// Reads the ends of a range.
fn ends(item: &Item<'_>, unit: &mut Option<Placed<Unit>>) -> Result<(f64, f64), Reported> {
    let ends = item.each(|item| item.quantity(one_unit(item, unit)?, &Range::ANY))?;
    match ends[..] {
        [least, greatest] if least < greatest => Ok((least, greatest)),
        [least, greatest] if least > greatest => Err(item.report(
            "`range` begins with the greatest value",
            "exchange its ends",
        )),
        _ => {
            let help = "give the least and the greatest value, as in [\"0 N\", \"50 N\"]";
            Err(item.report("`range` requires two different values", help))
        }
    }
}
