use std::collections::BTreeMap;

/// Information about a run that is known before its start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RunInfo {
    /// Name and contents of each input file of the run: scenario, robot.
    pub files: Vec<(String, Vec<u8>)>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Build identification: version, commit.
    pub build: String,
    /// Further metadata of the run: overridden keys, the plant.
    pub notes: BTreeMap<String, String>,
    /// The robot as URDF, if there is one; empty without.
    pub description: String,
    /// Names of the tasks, indexed by their numbers in [`twinrig_runtime::RunEvent`].
    pub tasks: Vec<String>,
    /// Names of the process variables, indexed by their numbers in [`twinrig_runtime::RunEvent`].
    pub variables: Vec<String>,
    /// Names of the recorded wire traces, indexed by their numbers in
    /// [`twinrig_runtime::Observer::bytes`].
    pub traces: Vec<String>,
}
