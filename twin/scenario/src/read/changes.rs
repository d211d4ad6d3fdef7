//! Reading `[[change]]`.

use std::collections::BTreeSet;
use std::ops::Bound;

use twinrig_document::{Item, Range, Reported, print_quantity};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Change;

use super::checks::above_nyquist;
use super::{code, controller, print_duration};
use crate::catalogue::{Catalogue, Kind};
use crate::language::{Accepts, Declared, Key, Shape, TableSpec, Type, contextual, table};
use crate::scenario::{ChangeSpec, ControllerSpec};

table! {
    /// Keys of `[[change]]`.
    pub(super) change_table = TableSpec::new("[[change]]", "change of process variables");
    AT: () = "at", contextual(Shape::One(Accepts::Duration)), "time", r#"at = "6 s""#, required();
    SET: () = "set", contextual(Shape::One(Accepts::Text)), "process variable",
        r#"set = "frequency""#, required();
    TO: () = "to", contextual(Shape::Measured(Range::ANY)), "new value", r#"to = "3 Hz""#, one_of();
    BY: () = "by", contextual(Shape::Measured(Range::ANY)), "difference from the value before",
        r#"by = "0.1 Hz""#, one_of();
    EVERY: SimDuration = "every", Type::POSITIVE_DURATION, "time between repetitions",
        r#"by = "0.1 Hz", every = "10 s""#, needs("by");
    TIMES: u64 = "times", REPETITIONS, "number of changes, the first included",
        r#"by = "0.1 Hz", every = "10 s", times = 16"#, otherwise("to the end of the run"),
        needs("every");
}

/// Greatest number of changes of one table.
const MOST: u64 = 10_000;
const REPETITIONS: Type<u64> = Type::new(Shape::One(Accepts::Natural(1..=MOST)), |item, _| {
    times(item)
});

/// Reads all changes, sorted by time, then in the order of the file. Since only changes set
/// variables at run time, their ranges are checked here.
pub(super) fn changes(
    root: Declared<'_, '_>,
    key: &Key<()>,
    control: Result<Option<&ControllerSpec>, Reported>,
    catalogue: &Catalogue,
    run: SimDuration,
) -> Result<Vec<ChangeSpec>, Reported> {
    let Some(items) = root.get_with(key, Item::list)? else {
        return Ok(Vec::new());
    };
    let Some(control) = control? else {
        let help = "add a [controller], or remove the changes";
        return Err(root.report(key, "there is no controller to change", help));
    };
    let mut kinds = catalogue.controllers.iter();
    let Some(kind) = kinds.find(|kind| kind.name == control.kind) else {
        return Ok(Vec::new());
    };
    let read: Vec<_> = items.iter().map(|item| change(item, kind, run)).collect();
    let read: Result<Vec<_>, Reported> = read.into_iter().collect();
    let mut changes: Vec<(ChangeSpec, &Item<'_>)> = Vec::new();
    for (list, item) in read?.into_iter().zip(&items) {
        changes.extend(list.into_iter().map(|change| (change, item)));
    }
    changes.sort_by_key(|(change, _)| change.at);
    reject_duplicates(&changes)?;
    in_range(&mut changes, control, kind)?;
    Ok(changes.into_iter().map(|(change, _)| change).collect())
}

/// Reads the time of a change or fault, with a warning if it is not before the end of the run.
pub(super) fn time_within_run(
    item: &Item<'_>,
    run: SimDuration,
    code: &'static str,
) -> Result<SimDuration, Reported> {
    let at = item.duration()?;
    if at >= run {
        let message = format!(
            "the run ends at {}: this never takes effect",
            print_duration(run)
        );
        item.warn(
            code,
            message,
            "give an earlier time, or a longer `duration`",
        );
    }
    Ok(at)
}

fn change(item: &Item<'_>, kind: &Kind, run: SimDuration) -> Result<Vec<ChangeSpec>, Reported> {
    use change_table::{AT, BY, SET, TO};
    let table = &item.table()?;
    let table = change_table::TABLE.of(table);
    let at = table.read_with(&AT, |item| time_within_run(item, run, code::CHANGE));
    let times = self::repetitions(table, at, run);
    let variables = table.read_with(&SET, |item| controller::changed_variables(item, kind));
    table.expect(&TO);
    table.expect(&BY);
    let variables = variables.inspect_err(|_| table.give_up())?;
    let amounts = |key: &Key<()>, amount: fn(f64) -> Change| {
        table.get_with(key, |item| {
            let read = variables.iter().map(|variable| {
                let range = match amount(0.0) {
                    Change::To(_) => variable.range,
                    Change::By(_) => Range::ANY,
                };
                let value = item.quantity(variable.unit, &range)?;
                Ok((variable.name.clone(), amount(value)))
            });
            read.collect::<Result<Vec<_>, Reported>>()
        })
    };
    let (to, by) = (amounts(&TO, Change::To), amounts(&BY, Change::By));
    let amounts = match (to?, by?) {
        (Some(amounts), None) | (None, Some(amounts)) => amounts,
        (Some(_), Some(_)) => {
            let message = "`to` and `by` are two changes";
            return Err(table.report(&BY, message, "give one of them"));
        }
        (None, None) => return Err(item.report("the change has no value", "give `to` or `by`")),
    };
    let change = |at: SimTime| {
        let of_variable = move |(variable, change): &(String, Change)| ChangeSpec {
            at,
            variable: variable.clone(),
            change: *change,
        };
        amounts.iter().map(of_variable)
    };
    Ok(times?.into_iter().flat_map(change).collect())
}

/// Returns the times of a change, whose first is `at`.
fn repetitions(
    table: Declared<'_, '_>,
    at: Result<SimDuration, Reported>,
    run: SimDuration,
) -> Result<Vec<SimTime>, Reported> {
    use change_table::{BY, EVERY, TIMES};
    let (every, times) = (table.get(&EVERY), table.get(&TIMES));
    let (at, every, times) = (at?, every?, times?);
    let Some(every) = every else {
        return match times {
            Some(_) => Err(table.report(&TIMES, "the changes have no interval", "give `every`")),
            None => Ok(vec![SimTime::ZERO + at]),
        };
    };
    if !table.has(&BY) {
        let message = "only a difference can be repeated";
        return Err(table.report(&EVERY, message, "give `by` in place of `to`"));
    }
    // Those before the end of the run.
    let within = match run.checked_sub(at) {
        Some(rest) if !rest.is_zero() => 1 + (rest.as_nanos() - 1) / every.as_nanos(),
        _ => 0,
    };
    let count = times.unwrap_or(within.max(1));
    if count > MOST {
        let message = format!("this is changed {count} times in the run");
        return Err(table.report(
            &EVERY,
            message,
            format!("a table has at most {MOST} changes"),
        ));
    }
    let last = every.checked_mul(count - 1);
    let last = last.and_then(|last| (SimTime::ZERO + at).checked_add(last));
    if last.is_none() {
        let help = "give a shorter interval, or fewer changes";
        return Err(table.report(&EVERY, "the last change is beyond the end of time", help));
    }
    if let Some(item) = table.item(&TIMES).filter(|_| within > 0 && within < count) {
        let late = count - within;
        let message = format!(
            "the run ends at {}: {late} of {count} changes never take effect",
            print_duration(run)
        );
        item.warn(
            code::CHANGE,
            message,
            "give a smaller number, or a longer `duration`",
        );
    }
    let time = |n| SimTime::ZERO + at + every * n;
    Ok((0..count).map(time).collect())
}

/// Reads a number of changes.
fn times(item: &Item<'_>) -> Result<u64, Reported> {
    match item.natural()? {
        times @ 1..=MOST => Ok(times),
        _ => Err(item.report(
            format!("`{}` is out of its range", item.key()),
            format!("expected a whole number from 1 to {MOST}"),
        )),
    }
}

/// Rejects two changes of one variable at one instant, whose result would depend on their order in
/// the file.
fn reject_duplicates(changes: &[(ChangeSpec, &Item<'_>)]) -> Result<(), Reported> {
    let mut changed = BTreeSet::new();
    let mut result = Ok(());
    for (change, item) in changes {
        if !changed.insert((change.at, &change.variable)) {
            let message = format!(
                "`{}` is changed twice at {}",
                change.variable,
                print_duration(change.at.since_start())
            );
            result = Err(item.report(message, "merge them, or change one of the times"));
        }
    }
    result
}

/// Greatest error of a sum of differences, as a share of them.
const ROUNDING: f64 = 1e-12;

/// Returns the bound that a value exceeds by rounding alone.
fn bound_met(range: &Range, value: f64, rounding: f64) -> Option<f64> {
    let bounds = [range.min, range.max].into_iter();
    let mut included = bounds.filter_map(|bound| match bound {
        Bound::Included(bound) => Some(bound),
        Bound::Excluded(_) | Bound::Unbounded => None,
    });
    let is_met = |bound: &f64| (value - bound).abs() <= rounding;
    included.find(|bound| !range.contains(value) && is_met(bound))
}

fn in_range(
    changes: &mut [(ChangeSpec, &Item<'_>)],
    control: &ControllerSpec,
    kind: &Kind,
) -> Result<(), Reported> {
    let mut values: Vec<(&str, f64)> = Vec::new();
    for (change, item) in changes {
        let Some(variable) = kind.variable(&change.variable) else {
            continue;
        };
        let known = values.iter().position(|(name, _)| *name == variable.name);
        let index = known.unwrap_or_else(|| {
            let set = control
                .variables
                .iter()
                .find(|(name, _)| *name == variable.name);
            let start = set.map_or(variable.default, |(_, value)| *value);
            values.push((&variable.name, start));
            values.len() - 1
        });
        let value = &mut values[index].1;
        *value = match change.change {
            Change::To(to) => to,
            Change::By(by) => {
                let sum = *value + by;
                let met = bound_met(&variable.range, sum, ROUNDING * by.abs().max(value.abs()));
                if let Some(bound) = met {
                    change.change = Change::To(bound);
                }
                met.unwrap_or(sum)
            }
        };
        if !variable.range.contains(*value) {
            let message = format!(
                "at {} this takes `{}` to {}, out of its range",
                change.at,
                variable.name,
                print_quantity(*value, variable.unit)
            );
            let help = format!(
                "it must be {}",
                variable.range.words(variable.unit.symbol())
            );
            return Err(item.report(message, help));
        }
        if let Some((message, help)) = above_nyquist(variable, *value, control.period) {
            return Err(item.report(message, help));
        }
    }
    Ok(())
}
