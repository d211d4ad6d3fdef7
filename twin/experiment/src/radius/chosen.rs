//! Choice of the axes of a study.

use twinrig_campaign::radius::{AxisGrid, AxisValues, DisturbanceAxis, KeyChange, KeyRule};
use twinrig_document::{
    Document, DocumentError, Item, Placed, Problem, Range, Reported, fitting_units, print_quantity,
    quantity_name, quoted, suggestion,
};
use twinrig_kernel::Unit;
use twinrig_rig::error::Error as RigError;

use super::context::{DisturbanceContext, Found};
use super::disturbances::{DISTURBANCES, Disturbance};
use crate::error::Error;
use crate::runs::keys::key_of;

/// A key of the scenario as an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyAxis {
    /// Dotted key or process variable.
    pub key: String,
    /// Value without a disturbance, in TOML; none: that of the scenario.
    pub from: Option<String>,
    /// Value of the greatest disturbance, in TOML.
    pub to: String,
}

/// Axes of a study.
pub(super) struct ChosenAxes {
    pub(super) axes: Vec<DisturbanceAxis>,
    /// Disturbances without an axis, with the reason.
    pub(super) left_out: Vec<String>,
}

/// Returns the axes of the named disturbances and of keys; those of all disturbances that apply if
/// nothing is named.
pub(super) fn chosen(
    context: &DisturbanceContext<'_>,
    names: &[String],
    along: &[KeyAxis],
) -> Result<ChosenAxes, Error> {
    let mut chosen = ChosenAxes {
        axes: Vec::new(),
        left_out: Vec::new(),
    };
    for name in names {
        let known = DISTURBANCES.iter().find(|it| it.name == *name);
        let axis = known.map(|it| it.axis(context));
        chosen.axes.push(match axis {
            Some(Ok(axis)) => axis,
            Some(Err(why)) => {
                let help = "leave it out, or name a key by --along";
                return Err(refused(format!("`{name}` has no axis here: {why}"), help));
            }
            None => {
                let names = DISTURBANCES.iter().map(|it| it.name);
                let help = suggestion(name, "disturbances", names);
                return Err(refused(format!("there is no disturbance `{name}`"), help));
            }
        });
    }
    if names.is_empty() && along.is_empty() {
        for it in DISTURBANCES {
            let Disturbance { name, .. } = it;
            match it.axis(context) {
                Ok(axis) => chosen.axes.push(axis),
                Err(why) => chosen.left_out.push(format!("{name}: {why}")),
            }
        }
    }
    for axis in along {
        chosen.axes.push(of_key(context, axis)?);
    }
    if chosen.axes.is_empty() {
        let why = format!("no disturbance has an axis: {}", chosen.left_out.join("; "));
        return Err(refused(why, "name a key of the scenario by --along"));
    }
    Ok(chosen)
}

fn of_key(context: &DisturbanceContext<'_>, axis: &KeyAxis) -> Result<DisturbanceAxis, Error> {
    let given = read("--along", "key", &quoted(&axis.key), placed)?;
    let key = key_of(&given, context.scenario(), &context.catalogue);
    let key = key.map_err(|problem| DocumentError {
        problems: vec![problem],
    })?;
    let (limit, unit) = quantity("--to", &key, &axis.to)?;
    let (nominal, of) = match (&axis.from, context.value(&key)) {
        (Some(from), _) => quantity("--along", &key, from)?,
        (None, Found::Quantity(number, unit)) => (number, unit),
        (None, Found::Missing) => {
            let help = format!("give the value without a disturbance: --along {key}=VALUE");
            return Err(at(
                &given,
                format!("the scenario does not set `{key}`"),
                help,
            ));
        }
        (None, _) => {
            let message = format!("`{key}` is not a quantity in the scenario");
            return Err(at(&given, message, "name a key with a number".to_owned()));
        }
    };
    if of != unit {
        return Err(unit_differs(&key, of, unit, &axis.to));
    }
    if nominal == limit {
        let shown = print_quantity(nominal, of);
        let message = format!("`{key}` is {shown} without a disturbance already");
        return Err(at(&given, message, "give another value by --to".to_owned()));
    }
    Ok(DisturbanceAxis {
        name: axis.key.clone(),
        about: format!("value of {key}"),
        values: AxisValues {
            nominal,
            limit,
            unit,
            grid: if nominal == 0.0 {
                AxisGrid::Geometric
            } else {
                AxisGrid::Linear
            },
        },
        keys: vec![KeyChange {
            key,
            rule: KeyRule::Equal,
        }],
    })
}

/// Returns the error of a greatest value in another unit than the value without a disturbance.
fn unit_differs(key: &str, nominal: Unit, limit: Unit, text: &str) -> Error {
    let is = |unit| match unit {
        Unit::One => "a plain number".to_owned(),
        unit => format!("{} in {unit}", quantity_name(unit)),
    };
    let help = match (nominal, limit) {
        (Unit::One, _) => "write the number without a unit".to_owned(),
        (_, Unit::One) => format!("write its unit, as in --to \"{text} {nominal}\""),
        _ => format!("units that fit: {}", fitting_units(nominal)),
    };
    refused(
        format!(
            "--to {text} is {}, and `{key}` is {} without a disturbance",
            is(limit),
            is(nominal)
        ),
        help,
    )
}

/// Reads a value of the command line; messages show `origin` as its file.
fn read<T>(
    origin: &str,
    key: &str,
    text: &str,
    reader: impl FnOnce(&Item<'_>) -> Result<T, Reported>,
) -> Result<T, Error> {
    let mut document = Document::parse(origin, "")?;
    document.set(origin, key, text)?;
    let read = document.check(|table| {
        let mut item = table.keys().next().and_then(|first| table.get(first));
        for part in key.split('.').skip(1) {
            item = item.and_then(|item| item.peek(part));
        }
        let item = item.ok_or_else(|| table.missing(key))?;
        reader(&item)
    });
    Ok(read?)
}

fn placed(item: &Item<'_>) -> Result<Placed<String>, Reported> {
    item.placed_text()
}

fn quantity(origin: &str, key: &str, text: &str) -> Result<(f64, Unit), Error> {
    read(origin, key, text, |item| {
        let unit = item.any_unit()?;
        Ok((item.quantity(unit, &Range::ANY)?, unit))
    })
}

fn refused(why: String, help: impl Into<String>) -> Error {
    Error::from(RigError::InvalidOptions {
        why,
        help: help.into(),
    })
}

fn at(given: &Placed<String>, message: String, help: String) -> Error {
    Error::from(RigError::Document(DocumentError {
        problems: vec![Problem::at(&given.place, message, help)],
    }))
}
