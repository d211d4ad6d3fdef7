//! Reading `[controller]` and its process variables.

use twinrig_document::{Item, Reported, Table, suggestion};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use super::checks::above_nyquist;
use super::names::kind;
use super::options::options;
use super::time::TIME;
use crate::catalogue::{Kind, VariableSpec};
use crate::language::{Key, Part, Shape, Special, TableSpec, Type, contextual, table};
use crate::scenario::{ControllerSpec, IoSpec};

/// Kind of a controller table without a controller.
pub(crate) const NO_CONTROLLER: &str = "none";

table! {
    /// Keys of `[controller]` of every kind.
    pub(super) controller_table = TableSpec::new("[controller]", "controller and its variables")
        .selected_by("kind");
    KIND: () = "kind", contextual(Shape::Other(Special::Kind(Part::Controller))), "controller; `none` for none",
        r#"kind = "cpg""#, required();
    PERIOD: SimDuration = "period", Type::POSITIVE_DURATION, "control period", r#"period = "2 ms""#,
        required();
    COMPUTE_TIME: Timing = "compute_time", TIME, "duration of an iteration",
        r#"compute_time = "400 us""#, default("'0 s'");
}

/// Reads `[controller]`; none if its kind is `none`.
pub(super) fn controller(
    item: &Item<'_>,
    kinds: &[Kind],
) -> Result<Option<ControllerSpec>, Reported> {
    use controller_table::{COMPUTE_TIME, KIND, PERIOD};
    let table = &item.table()?;
    let keys = controller_table::TABLE.of(table);
    let is_none = |kind: Item<'_>| kind.text() == Ok(NO_CONTROLLER);
    if item.peek(KIND.name).is_some_and(is_none) {
        keys.expect(&KIND);
        return Ok(None);
    }
    let kind = keys.read_with(&KIND, |item| kind(item, Part::Controller, kinds));
    let (period, compute_time) = (keys.read(&PERIOD), keys.read(&COMPUTE_TIME));
    let kind = kind.inspect_err(|_| table.give_up())?;
    let options = options(table, &kind.options);
    let variables = variables(table, kind, period.ok());
    Ok(Some(ControllerSpec {
        kind: kind.name.clone(),
        period: period?,
        compute_time: compute_time?,
        options: options?,
        variables: variables?,
    }))
}

/// Reads the process variables that the table sets.
fn variables(
    table: &Table<'_>,
    kind: &Kind,
    period: Option<SimDuration>,
) -> Result<Vec<(String, f64)>, Reported> {
    let mut keys: Vec<&str> = Vec::new();
    for key in kind.variables.iter().map(VariableSpec::key) {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let values: Vec<Result<Vec<_>, Reported>> = keys
        .into_iter()
        .filter_map(|key| {
            table
                .get(key)
                .map(|item| read_variable(&item, kind, key, period))
        })
        .collect();
    let values: Result<Vec<_>, Reported> = values.into_iter().collect();
    let values = values?.concat();
    let by_default =
        |variable: &&VariableSpec| !values.iter().any(|(name, _)| *name == variable.name);
    for variable in kind.variables.iter().filter(by_default) {
        let problem = period.and_then(|period| above_nyquist(variable, variable.default, period));
        if let Some((message, help)) = problem {
            return Err(table.report(
                controller_table::PERIOD.name,
                format!("{message}, by default"),
                help,
            ));
        }
    }
    Ok(values)
}

/// Reads the variables that one key sets: `hip_height = "12 cm"` all of its groups, `hip_height = {
/// fore = …, hind = … }` each.
fn read_variable(
    item: &Item<'_>,
    kind: &Kind,
    key: &str,
    period: Option<SimDuration>,
) -> Result<Vec<(String, f64)>, Reported> {
    let variables = kind.variables_of(key);
    let groups: Vec<&str> = variables.iter().filter_map(|v| v.group()).collect();
    let quantity = |item: &Item<'_>, variable: &VariableSpec| {
        let value = item.quantity(variable.unit, &variable.range)?;
        match period.and_then(|period| above_nyquist(variable, value, period)) {
            Some((message, help)) => Err(item.report(message, help)),
            None => Ok(value),
        }
    };
    if !item.is_table() {
        let read = |variable: &&VariableSpec| {
            let value = quantity(item, variable)?;
            Ok((variable.name.clone(), value))
        };
        return variables.iter().map(read).collect();
    }
    if groups.is_empty() {
        let message = format!("`{key}` is the same for all legs");
        return Err(item.report(message, "give one value"));
    }
    let table = item.table()?;
    let read: Vec<_> = variables
        .iter()
        .map(|variable| {
            let group = variable.group().unwrap_or_default();
            let value = table.optional(group, |item| quantity(item, variable))?;
            Ok(value.map(|value| (variable.name.clone(), value)))
        })
        .collect();
    let read: Result<Vec<_>, Reported> = read.into_iter().collect();
    Ok(read?.into_iter().flatten().collect())
}

/// Returns the variables that a `[[change]]` sets, whose `set` is `item`.
pub(super) fn changed_variables<'k>(
    item: &Item<'_>,
    kind: &'k Kind,
) -> Result<Vec<&'k VariableSpec>, Reported> {
    let name = item.text()?;
    let variables = kind.variables_of(name);
    if variables.is_empty() {
        let mut known: Vec<&str> = Vec::new();
        for variable in &kind.variables {
            for name in [variable.key(), variable.name.as_str()] {
                if !known.contains(&name) {
                    known.push(name);
                }
            }
        }
        let message = format!(
            "the controller `{}` has no process variable `{name}`",
            kind.name
        );
        return Err(item.report(message, suggestion(name, "it has", known)));
    }
    Ok(variables)
}

/// Returns the default of `[io]`: one exchange in each control period, with a transfer time of
/// zero.
pub(super) fn io_default(control: Option<&ControllerSpec>) -> IoSpec {
    const STEP: SimDuration = SimDuration::from_millis(1);
    IoSpec {
        step: control.map_or(STEP, |control| control.period),
        transfer_time: Timing::Constant(SimDuration::ZERO),
    }
}
