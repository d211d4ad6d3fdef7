//! System queries of the check.

/// Limit of the resources of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Limit {
    /// Greatest real-time priority.
    RealTimePriority,
    /// Memory that may be locked against paging \[byte\].
    LockedMemory,
}

/// Rights to a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Access {
    /// Whether this process may read and write it.
    pub is_granted: bool,
    /// Group that may.
    pub group: Option<String>,
}

/// Output of another program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// First line that it printed.
    Line(String),
    /// It failed, with the last line of its errors.
    Failed(String),
    /// There is no such program.
    Missing,
}

/// A system: the machine, or that of a test.
pub(crate) trait System {
    /// Returns whether paths are those of Linux.
    fn is_linux(&self) -> bool;
    /// Returns the text of a file, without blanks at its ends.
    fn text(&self, path: &str) -> Option<String>;
    /// Returns the names in a folder, sorted; none if there is no such folder.
    fn names(&self, folder: &str) -> Vec<String>;
    /// Returns the rights to a device.
    fn access(&self, path: &str) -> Access;
    /// Runs a program.
    fn output(&self, program: &str, arguments: &[&str]) -> Output;
    /// Returns a limit of this process; none if it is unlimited.
    fn limit(&self, limit: Limit) -> Option<u64>;
    /// Returns the space for files in the present folder \[byte\]; none if the system does not say.
    fn free_space(&self) -> Option<u64>;
    /// Returns whether files can be created in the present folder.
    fn is_writable(&self) -> bool;
    /// Returns a variable of the environment that is set and not empty.
    fn variable(&self, name: &str) -> Option<String>;
    /// Returns whether standard output is a terminal.
    fn is_terminal(&self) -> bool;
}
