//! Values outside of the data to which the parameters of an overlay were fitted.

use toml_edit::{TableLike, Value};
use twinrig_kernel::Unit;

use crate::error::{Problem, Warning};
use crate::node::{self, Node};
use crate::quantity::parse_with_unit;

/// Table of an overlay with the ranges of its data: keys of the file that includes it, each with
/// the least and the greatest value.
const DATA: [&str; 2] = ["fit", "data"];
/// Code of the warning for a value outside of them.
const BEYOND_FIT: &str = "beyond-fit";

/// Range of a value in the data of a fit.
#[derive(Clone, Debug)]
pub(crate) struct FittedRange {
    /// File of the overlay.
    overlay: String,
    keys: Vec<String>,
    /// Texts of the least and the greatest value.
    ends: [String; 2],
}

impl FittedRange {
    /// Returns the ranges that an overlay states.
    ///
    /// # Errors
    /// The key of one that is no range.
    pub(crate) fn of(overlay: &str, root: &dyn TableLike) -> Result<Vec<Self>, String> {
        let Some(data) = root.get(DATA[0]).and_then(|fit| fit.get(DATA[1])) else {
            return Ok(Vec::new());
        };
        let table = data.as_table_like().ok_or_else(|| DATA.join("."))?;
        let mut ranges = Vec::new();
        collect(overlay, table, &mut Vec::new(), &mut ranges)?;
        Ok(ranges)
    }

    /// Returns the first part of the key.
    pub(crate) fn table(&self) -> Option<&str> {
        self.keys.first().map(String::as_str)
    }

    /// Returns the range of the value in a table of another document, or at its root.
    pub(crate) fn below(mut self, table: Option<&str>) -> Self {
        self.keys.splice(..0, table.map(str::to_owned));
        self
    }

    /// Returns a warning about a value of a document outside of the range.
    pub(crate) fn warning(&self, root: &Node) -> Option<Warning> {
        let node = root.find(&self.keys)?;
        let (node::Value::Text(text) | node::Value::Integer(text) | node::Value::Float(text)) =
            &node.value
        else {
            return None;
        };
        let [(least, unit), (greatest, other)] = self.values()?;
        let (value, own) = parse_with_unit(text)?;
        // Of the last digits of a conversion.
        let slack = 1e-9 * least.abs().max(greatest.abs());
        let is_within = value >= least - slack && value <= greatest + slack;
        if is_within || [other, own] != [unit; 2] {
            return None;
        }
        let [from, to] = &self.ends;
        let key = self.keys.join(".");
        let message = format!(
            "`{key}` is outside of the data of {}, from {from} to {to}",
            self.overlay
        );
        let help = "parameters that were fitted to these data are extrapolated";
        Some(Warning {
            code: BEYOND_FIT,
            problem: Problem::at(&node.place, message, help),
        })
    }

    /// Returns the least and the greatest value; none where they are no range.
    fn values(&self) -> Option<[(f64, Unit); 2]> {
        let [least, greatest] = &self.ends;
        let ends @ [(from, unit), (to, other)] =
            [parse_with_unit(least)?, parse_with_unit(greatest)?];
        (from <= to && unit == other).then_some(ends)
    }
}

fn collect(
    overlay: &str,
    table: &dyn TableLike,
    path: &mut Vec<String>,
    ranges: &mut Vec<FittedRange>,
) -> Result<(), String> {
    for (key, item) in table.iter() {
        path.push(key.to_owned());
        if let Some(inner) = item.as_table_like() {
            collect(overlay, inner, path, ranges)?;
        } else {
            let range = item.as_array().and_then(|ends| {
                let mut ends = ends.iter().map(text);
                let (least, greatest) = (ends.next()?, ends.next()?);
                let range = FittedRange {
                    overlay: overlay.to_owned(),
                    keys: path.clone(),
                    ends: [least, greatest],
                };
                (ends.next().is_none() && range.values().is_some()).then_some(range)
            });
            ranges.push(range.ok_or_else(|| format!("{}.{}", DATA.join("."), path.join(".")))?);
        }
        path.pop();
    }
    Ok(())
}

/// Returns a number or a quantity as in a document.
fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.value().clone(),
        Value::Integer(number) => number.value().to_string(),
        Value::Float(number) => number.value().to_string(),
        other => other.to_string(),
    }
}
