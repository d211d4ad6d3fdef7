//! Reading expectations that compare two signals.

use twinrig_document::{Item, Placed, Reported};
use twinrig_kernel::{SimDuration, Unit};

use super::one_of::one_of;
use super::signal::LIMITS;
use crate::compare::{CompareClaim, CompareMeasure, Operand};
use crate::domain::Domain;
use crate::language::{Declared, Key, TableSpec, Type, contextual, table};
use crate::limits::Limits;
use crate::read::limits::{limits, read, unit_of};

const DELAYS: Domain = CompareMeasure::Delay {
    range: SimDuration::ZERO,
}
.domain();

table! {
    /// Keys of `compare`.
    pub(super) compare_table =
        TableSpec::new("compare", "claim about a signal compared with another");
    SIGNAL: Placed<String> = "signal", Type::PLACED, "name of the signal",
        r#"signal = "leg/LF/hip/position""#, required(), qualifier();
    COMPONENT: usize = "component", Type::ELEMENT, "element of the signal, counted from 0",
        r#"signal = "body/rpy", component = 1, with = "body/rpy", with_component = 0, error = { max = "3 deg" }"#,
        otherwise("its only one"), qualifier();
    WITH: Placed<String> = "with", Type::PLACED, "name of the signal that it is compared with",
        r#"with = "leg/LF/hip/command""#, required(), qualifier();
    WITH_COMPONENT: usize = "with_component", Type::ELEMENT, "element of that signal",
        r#"signal = "body/rpy", component = "x", with = "body/rpy", with_component = "y", gain = { max = 1 }"#,
        otherwise("its only one"), qualifier();
    DELAY_RANGE: SimDuration = "delay_range", Type::POSITIVE_DURATION, "greatest delay, either way",
        r#"delay = { max = "20 ms" }, delay_range = "50 ms""#, default(r#""100 ms""#),
        needs("delay"), qualifier();
    ERROR: () = "error", contextual(LIMITS), "root mean square of the difference",
        r#"error = { max = "1 deg" }"#, one_of();
    ERROR_PEAK: () = "error_peak", contextual(LIMITS), "greatest magnitude of the difference",
        r#"error_peak = { max = "3 deg" }"#, one_of();
    DELAY: Limits = "delay", limits(Unit::Second, DELAYS),
        "time by which the signal lags the other", r#"delay = { max = "20 ms" }"#, one_of();
    CORRELATION: Limits = "correlation", limits(Unit::One, CompareMeasure::Correlation.domain()),
        "coefficient of correlation without delay", "correlation = { min = 0.99 }", one_of();
    GAIN: Limits = "gain", limits(Unit::One, CompareMeasure::Gain.domain()),
        "slope of the regression of the signal on the other",
        r#"gain = { near = 1, within = "2 %" }"#, one_of();
    PEAKS: Limits = "peaks", limits(Unit::One, CompareMeasure::Peaks.domain()),
        "mean of its maxima over the mean of the other's, one in each period of the other",
        r#"peaks = { near = 1, within = "5 %" }"#, one_of();
}

/// Reads `compare = { … }`.
pub(super) fn claim(item: &Item<'_>) -> Result<CompareClaim, Reported> {
    use compare_table::{COMPONENT, DELAY_RANGE, SIGNAL, WITH, WITH_COMPONENT};
    let table = &item.table()?;
    let table = compare_table::TABLE.of(table);
    let (signal, component) = (table.read(&SIGNAL), table.get(&COMPONENT));
    let (with, with_component) = (table.read(&WITH), table.get(&WITH_COMPONENT));
    let range = table.read(&DELAY_RANGE);
    let key = one_of(table, item, "no measure of the comparison is given")?;
    let (measure, unit, limits) = measure(table, key, range?)?;
    Ok(CompareClaim {
        signal: Operand {
            name: signal?,
            component: component?,
        },
        with: Operand {
            name: with?,
            component: with_component?,
        },
        measure,
        unit,
        limits,
    })
}

/// Reads the limits of the measure `key`.
fn measure(
    table: Declared<'_, '_>,
    key: &str,
    range: SimDuration,
) -> Result<(CompareMeasure, Unit, Limits), Reported> {
    use compare_table::{CORRELATION, DELAY, ERROR, ERROR_PEAK, GAIN};
    for (known, measure) in [
        (ERROR, CompareMeasure::Error),
        (ERROR_PEAK, CompareMeasure::ErrorPeak),
    ] {
        if known.name == key {
            // The unit of the signals is only known to the scene, which compares the two.
            return table.read_with(&known, |item| {
                let unit = unit_of(item)?;
                Ok((measure, unit, read(item, unit, &measure.domain())?))
            });
        }
    }
    let measure = match key {
        _ if key == DELAY.name => CompareMeasure::Delay { range },
        _ if key == CORRELATION.name => CompareMeasure::Correlation,
        _ if key == GAIN.name => CompareMeasure::Gain,
        _ => CompareMeasure::Peaks,
    };
    let limits = table.read_named(key)?;
    Ok((measure, measure.unit().unwrap_or(Unit::One), limits))
}
