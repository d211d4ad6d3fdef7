//! Values that replace those of another document.

use std::collections::BTreeMap;

use crate::error::Problem;
use crate::node::{Node, Value};
use crate::source::Place;

/// Code of the warning for a key that is set twice.
pub(crate) const SET_TWICE: &str = "set-twice";

/// Values that replace those of another document; returned by [`crate::Item::overrides`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    pub(crate) leaves: Vec<(Vec<String>, Place, Node)>,
}

impl Overrides {
    /// Whether no value is replaced.
    pub fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// Returns these values and then `others`, which replace those of the same keys.
    #[must_use]
    pub fn and(&self, others: &Self) -> Self {
        Self {
            leaves: [self.leaves.as_slice(), &others.leaves].concat(),
        }
    }

    /// Dotted keys of the replaced values.
    pub fn keys(&self) -> impl Iterator<Item = String> + use<'_> {
        self.leaves.iter().map(|(keys, ..)| keys.join("."))
    }

    /// Keys that occur twice in different spellings, as in `leg.aslp.l1` and `"leg.aslp".l1`: a
    /// problem at each occurrence but the last.
    pub(crate) fn set_twice(&self) -> Vec<Problem> {
        let mut last: BTreeMap<&[String], &Place> = BTreeMap::new();
        let mut problems = Vec::new();
        for (keys, place, _) in &self.leaves {
            if let Some(earlier) = last.insert(keys, place) {
                let message = format!("`{}` is set twice, and the last one counts", keys.join("."));
                problems.push(Problem::at(earlier, message, "leave one of them out"));
            }
        }
        problems
    }

    pub(crate) fn of(node: &Node) -> Self {
        let mut leaves = Vec::new();
        collect(node, &mut Vec::new(), &mut leaves);
        Overrides { leaves }
    }
}

fn collect(node: &Node, path: &mut Vec<String>, leaves: &mut Vec<(Vec<String>, Place, Node)>) {
    let Value::Table(entries) = &node.value else {
        return;
    };
    for entry in entries {
        let depth = path.len();
        path.extend(entry.key.split('.').map(str::to_owned));
        if matches!(entry.node.value, Value::Table(_)) {
            collect(&entry.node, path, leaves);
        } else {
            leaves.push((path.clone(), entry.key_place.clone(), entry.node.clone()));
        }
        path.truncate(depth);
    }
}
