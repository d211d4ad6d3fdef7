//! Simulated part of a scenario in an FMU.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{Group, RigError};

/// Part of a scenario that an FMU contains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FmuPart {
    /// The plant alone: inputs are its commands.
    #[default]
    Plant,
    /// The whole rig with controller, driver, wire, boards and plant: inputs are the process
    /// variables of the controller.
    Rig,
}

impl FmuPart {
    /// Every part.
    pub(crate) const ALL: [Self; 2] = [Self::Plant, Self::Rig];

    /// Returns the name, as on the command line.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Plant => "plant",
            Self::Rig => "rig",
        }
    }
}

impl fmt::Display for FmuPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for FmuPart {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut all = Self::ALL.into_iter();
        let found = all.find(|part| part.name() == text);
        found.ok_or_else(|| format!("`{text}` is neither `plant` nor `rig`"))
    }
}

/// A plant or a rig behind the calls of an instance, in its own time, which begins at 0.
pub(crate) trait Simulated: Send {
    /// Returns the value of an input.
    fn input(&self, index: usize) -> f64;

    /// Sets inputs, given by index, to finite values for the time from now on: all or none. A value
    /// that is refused is [`RigError::Change`].
    fn set_inputs(&mut self, values: &[(usize, f64)]) -> Result<(), RigError>;

    /// Handles the events of time 0, after which time can advance.
    fn begin(&mut self) -> Result<(), RigError>;

    /// Advances to `to`, which is later than the present time.
    fn advance(&mut self, to: SimTime) -> Result<(), RigError>;

    /// Returns the present time.
    fn now(&self) -> SimTime;

    /// Computes the outputs at the present time, for [`Simulated::output`].
    fn observe(&mut self) -> Result<(), RigError>;

    /// Returns the value of an output.
    fn output(&self, group: Group, index: usize) -> f64;

    /// Returns the fingerprint of all samples and events so far, of a rig.
    fn fingerprint(&self) -> Option<String>;

    /// Saves everything that affects later values.
    fn save(&self) -> Snapshot;

    /// Restores a saved state.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), RigError>;
}

/// Returns the error of a snapshot with another number of values.
pub(crate) fn mismatch(expected: usize, found: usize) -> RigError {
    let text = |count| format!("a part with {count} inputs");
    let (expected, found) = (text(expected), text(found));
    SnapshotError::Mismatch { expected, found }.into()
}
