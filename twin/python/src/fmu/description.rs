//! Description of an FMU, as its worker sends it.

use serde::Deserialize;

/// Description of a model.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Description {
    /// Identity of the model, which differs between its versions.
    pub token: String,
    /// Capability that it lacks for saving its state.
    pub missing_state: Option<String>,
    /// Whether all communication steps must be of equal length.
    pub fixed_step: bool,
    /// Its own step \[s\].
    pub step: Option<f64>,
    /// Whether a process can have one instance only.
    pub once_per_process: bool,
    /// Numeric variables.
    pub variables: Vec<Variable>,
    /// Variables that no signal can have.
    pub unmapped: Vec<Unmapped>,
}

/// A numeric variable.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Variable {
    /// Its name.
    pub name: String,
    /// `input`, `output`, `parameter`, `local` ….
    pub causality: String,
    /// `constant`, `fixed`, `tunable`, `discrete`, `continuous`.
    pub variability: Option<String>,
    /// Its type.
    #[serde(rename = "type")]
    pub kind: String,
    /// Number of elements.
    pub size: usize,
    /// Its unit; none: not declared.
    pub unit: Option<DeclaredUnit>,
    /// Name of the variable of which it is the time derivative.
    pub rate_of: Option<String>,
    /// Whether it has a start value.
    pub has_start: bool,
    /// Least value, in its unit; none: not declared.
    pub min: Option<f64>,
    /// Greatest value, in its unit; none: not declared.
    pub max: Option<f64>,
}

/// A unit of the model.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct DeclaredUnit {
    /// Its name.
    pub name: String,
    /// Exponents of kg, m, s, A, K, mol, cd and rad; none: the model gives a name only.
    pub exponents: Option<[i32; 8]>,
    /// Factor to these units.
    pub factor: f64,
    /// Offset in these units, added after the factor.
    pub offset: f64,
}

/// A variable that is not numeric.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Unmapped {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub kind: String,
}

impl Description {
    /// Returns the variable of that name.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|variable| variable.name == name)
    }
}

impl Variable {
    /// Returns whether the variable can be set before the start.
    pub fn is_parameter(&self) -> bool {
        let is_constant = self.variability.as_deref() == Some("constant");
        let is_set = ["parameter", "input"].contains(&self.causality.as_str());
        is_set || (self.has_start && !is_constant && self.causality != "structuralParameter")
    }
}
