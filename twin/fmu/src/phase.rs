//! States of an instance, by the standard.

use std::fmt;

/// State of an instance, by the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    Instantiated,
    Initialization,
    Step,
    Terminated,
    /// A step has failed: a saved state can be restored, or the instance reset.
    Error,
    /// A part has panicked: the instance can only be freed.
    Fatal,
}

impl Phase {
    const ALL: [Self; 6] = [
        Self::Instantiated,
        Self::Initialization,
        Self::Step,
        Self::Terminated,
        Self::Error,
        Self::Fatal,
    ];
    /// Phases in which inputs can be set.
    pub(crate) const SET: &[Self] = &[Self::Instantiated, Self::Initialization, Self::Step];
    /// Phases in which outputs exist.
    pub(crate) const GET: &[Self] = &[
        Self::Initialization,
        Self::Step,
        Self::Terminated,
        Self::Error,
    ];
    /// All phases but the fatal one.
    pub(crate) const LIVE: &[Self] = &[
        Self::Instantiated,
        Self::Initialization,
        Self::Step,
        Self::Terminated,
        Self::Error,
    ];

    pub(crate) fn number(self) -> u8 {
        self as u8
    }

    pub(crate) fn of_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Instantiated => "before the initialization mode",
            Self::Initialization => "in the initialization mode",
            Self::Step => "once steps have begun",
            Self::Terminated => "after the end",
            Self::Error => "after an error: restore a saved state, or reset the instance",
            Self::Fatal => "after a panic",
        })
    }
}
