//! State of a plant by names that other plants share.

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

/// State of a plant at an instant: named vectors of `f64` in SI units, from which a plant with
/// other coordinates can resume. A [`Snapshot`](twinrig_kernel::Snapshot) is exact, private and
/// restores plants of the same kind only; this is the part that models of the same system have in
/// common.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    /// Time of the state.
    pub time: SimTime,
    values: Vec<(String, Vec<f64>)>,
}

impl PlantState {
    /// Creates an empty state at `time`.
    pub fn at(time: SimTime) -> Self {
        Self {
            time,
            values: Vec::new(),
        }
    }

    /// Sets `name` to `values`, replacing earlier ones.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, values: &[f64]) -> Self {
        let name = name.into();
        self.values.retain(|(known, _)| *known != name);
        self.values.push((name, values.to_vec()));
        self
    }

    /// Returns the values of `name`.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let mut all = self.values.iter();
        all.find(|(known, _)| known == name)
            .map(|(_, values)| values.as_slice())
    }

    /// Returns the values whose names satisfy `keep`.
    #[must_use]
    pub fn only(&self, keep: impl Fn(&str) -> bool) -> Self {
        let mut kept = self.clone();
        kept.values.retain(|(name, _)| keep(name));
        kept
    }

    /// Iterates over names and values, in the order of insertion.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &[f64])> {
        let all = self.values.iter();
        all.map(|(name, values)| (name.as_str(), values.as_slice()))
    }
}
