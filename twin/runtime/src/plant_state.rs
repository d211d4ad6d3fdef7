//! Where a plant is, in words that others understand.

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

/// Where a plant is at an instant, as vectors of `f64` with names, in SI units: for another plant to go on from there, whose
/// own coordinates may be others. A [`Snapshot`](twinrig_kernel::Snapshot) is exact, private and for a plant of the same make; this is what models of
/// the same thing have in common.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    /// When.
    pub time: SimTime,
    values: Vec<(String, Vec<f64>)>,
}

impl PlantState {
    /// Nothing, at `time`.
    pub fn at(time: SimTime) -> Self {
        Self {
            time,
            values: Vec::new(),
        }
    }

    /// The same, and `values` for `name`, whatever was there.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, values: &[f64]) -> Self {
        let name = name.into();
        self.values.retain(|(known, _)| *known != name);
        self.values.push((name, values.to_vec()));
        self
    }

    /// The values of `name`.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let mut all = self.values.iter();
        all.find(|(known, _)| known == name)
            .map(|(_, values)| values.as_slice())
    }

    /// What of it has a name that `keep` wants.
    #[must_use]
    pub fn only(&self, keep: impl Fn(&str) -> bool) -> Self {
        let mut kept = self.clone();
        kept.values.retain(|(name, _)| keep(name));
        kept
    }

    /// Names and values, in the order in which they were given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &[f64])> {
        let all = self.values.iter();
        all.map(|(name, values)| (name.as_str(), values.as_slice()))
    }
}
