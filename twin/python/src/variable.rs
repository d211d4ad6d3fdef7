//! Process variables as Python sees them.

use std::ops::Bound;

use twinrig::runtime::ProcessVariable;

/// Name, unit, present, least and greatest value of a process variable.
pub(crate) type VariableFields = (String, &'static str, f64, f64, f64);

/// Returns the fields of a variable.
pub(crate) fn variable_fields(variable: &ProcessVariable) -> VariableFields {
    let (unit, (least, greatest)) = (variable.unit().symbol(), extremes(variable.range()));
    let name = variable.name().to_owned();
    (name, unit, variable.value(), least, greatest)
}

/// Returns the least and the greatest number of a range: a bound that is excluded is replaced by
/// the number next to it.
fn extremes(range: (Bound<f64>, Bound<f64>)) -> (f64, f64) {
    let least = match range.0 {
        Bound::Included(least) => least,
        Bound::Excluded(below) => below.next_up(),
        Bound::Unbounded => f64::NEG_INFINITY,
    };
    let greatest = match range.1 {
        Bound::Included(greatest) => greatest,
        Bound::Excluded(above) => above.next_down(),
        Bound::Unbounded => f64::INFINITY,
    };
    (least, greatest)
}
