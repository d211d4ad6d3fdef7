//! Values outside of the data to which the parameters of an overlay were fitted.

use toml_edit::{Item, TableLike};
use twinrig_kernel::Unit;

use crate::error::{Problem, Warning};
use crate::node::{Node, Value};
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
    /// Returns the ranges that an overlay states; those that are not two values are left out.
    pub(crate) fn of(overlay: &str, root: &dyn TableLike) -> Vec<Self> {
        let data = root.get(DATA[0]).and_then(|fit| fit.get(DATA[1]));
        let mut ranges = Vec::new();
        if let Some(table) = data.and_then(Item::as_table_like) {
            collect(overlay, table, &mut Vec::new(), &mut ranges);
        }
        ranges
    }

    /// Returns a warning about a value of a document outside of the range.
    pub(crate) fn warning(&self, root: &Node) -> Option<Warning> {
        let node = root.find(&self.keys)?;
        let (Value::Text(text) | Value::Integer(text) | Value::Float(text)) = &node.value else {
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

    /// Returns the least and the greatest value.
    fn values(&self) -> Option<[(f64, Unit); 2]> {
        let [least, greatest] = &self.ends;
        Some([parse_with_unit(least)?, parse_with_unit(greatest)?])
    }
}

fn collect(
    overlay: &str,
    table: &dyn TableLike,
    path: &mut Vec<String>,
    ranges: &mut Vec<FittedRange>,
) {
    for (key, item) in table.iter() {
        path.push(key.to_owned());
        if let Some(inner) = item.as_table_like() {
            collect(overlay, inner, path, ranges);
        } else if let Some(ends) = item.as_array() {
            let mut ends = ends.iter().map(|end| match end.as_str() {
                Some(text) => text.to_owned(),
                None => end.to_string().trim().to_owned(),
            });
            if let (Some(least), Some(greatest), None) = (ends.next(), ends.next(), ends.next()) {
                ranges.push(FittedRange {
                    overlay: overlay.to_owned(),
                    keys: path.clone(),
                    ends: [least, greatest],
                });
            }
        }
        path.pop();
    }
}
