//! Identification of a plant in a study.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Formulation of the constraints that a label does not mention.
const RIGID: &str = "rigid";
const COMPLIANT: &str = "compliant";

/// Plant and formulation of its constraints. Each formulation is a model of its own, with its own
/// reference.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlantId {
    /// Name used in scenarios.
    #[serde(rename = "plant")]
    pub name: String,
    /// Formulation of stops, cables and contact: `rigid` or `compliant`; `None` for a plant without
    /// the choice.
    pub constraints: Option<String>,
}

impl PlantId {
    /// A plant without a choice of constraints.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            constraints: None,
        }
    }

    /// Returns the plant with this formulation of its constraints.
    #[must_use]
    pub fn with_constraints(self, constraints: &str) -> Self {
        Self {
            constraints: Some(constraints.to_owned()),
            ..self
        }
    }

    /// Returns whether the constraints are compliant.
    pub fn is_compliant(&self) -> bool {
        self.constraints.as_deref() == Some(COMPLIANT)
    }

    /// Returns the name, followed by the constraints unless they are rigid: `lcp, compliant`.
    pub fn label(&self) -> String {
        match self.constraints.as_deref() {
            None | Some(RIGID) => self.name.clone(),
            Some(constraints) => format!("{}, {constraints}", self.name),
        }
    }
}

impl fmt::Display for PlantId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.label())
    }
}

/// A plant equals its label.
impl PartialEq<str> for PlantId {
    fn eq(&self, label: &str) -> bool {
        self.label() == label
    }
}

/// A plant equals its label.
impl PartialEq<&str> for PlantId {
    fn eq(&self, label: &&str) -> bool {
        *self == **label
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn label_mentions_constraints_other_than_rigid() {
        let plant = PlantId::new("lcp");
        let [rigid, compliant] =
            ["rigid", "compliant"].map(|word| plant.clone().with_constraints(word));
        assert_eq!(plant.label(), "lcp");
        assert!(rigid == "lcp" && compliant == "lcp, compliant");
        assert_ne!(rigid, compliant);
        let json = serde_json::to_value(&compliant).unwrap();
        assert_eq!(
            json.to_string(),
            r#"{"plant":"lcp","constraints":"compliant"}"#
        );
    }
}
