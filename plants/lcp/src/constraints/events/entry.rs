//! Rows of the problem of an instant.

use crate::constraints::mode::Mode;
use crate::model::articulated::Row;
use crate::model::real::Lanes;

/// Unilateral constraint inside a leg, in the order of the guards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stop {
    Closed,
    Open,
    Extended,
    Bottomed,
    Cable,
}

impl Stop {
    pub(crate) const ALL: [Self; 5] = [
        Self::Closed,
        Self::Open,
        Self::Extended,
        Self::Bottomed,
        Self::Cable,
    ];

    /// Returns the name used in events and messages.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::Open => "open",
            Self::Extended => "extended",
            Self::Bottomed => "bottomed",
            Self::Cable => "cable",
        }
    }

    /// Returns the lanes in which the stop is active.
    pub(crate) fn active_in(self, mode: &Mode) -> Lanes {
        let active = &mode.active;
        match self {
            Self::Closed => active.closed,
            Self::Open => active.open,
            Self::Extended => active.extended,
            Self::Bottomed => active.bottomed,
            Self::Cable => active.cable,
        }
    }

    /// Returns the lanes in which the stop is active, for modification.
    pub(crate) fn active_mut(self, mode: &mut Mode) -> &mut Lanes {
        let active = &mut mode.active;
        match self {
            Self::Closed => &mut active.closed,
            Self::Open => &mut active.open,
            Self::Extended => &mut active.extended,
            Self::Bottomed => &mut active.bottomed,
            Self::Cable => &mut active.cable,
        }
    }
}

/// Meaning of a row of the problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Role {
    Stop(Stop),
    /// Normal of a foot; where it slides, its friction is included.
    Normal {
        links: usize,
        slides: Option<[f64; 2]>,
    },
    /// First or second tangent of a sticking foot.
    Tangent {
        links: usize,
        which: usize,
    },
}

impl Role {
    /// Returns the index among the forces on a leg.
    pub(crate) const fn slot(self) -> usize {
        match self {
            Self::Stop(stop) => stop as usize,
            Self::Normal { links, .. } => 5 + 3 * (links - 3),
            Self::Tangent { links, which } => 5 + 3 * (links - 3) + which,
        }
    }

    pub(crate) const fn is_tangent(self) -> bool {
        matches!(self, Self::Tangent { .. })
    }
}

/// Number of possible forces on a leg, indexed by [`Role::slot`].
pub(crate) const SLOTS: usize = 11;

/// Selection of the rows of feet on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feet {
    /// Normal and two tangents: friction is part of the problem.
    WithTangents,
    /// A foot that slides faster than [`STICKING`](super::closed::STICKING) has its normal only,
    /// with friction included.
    BySpeed,
    /// The same after an event: a sticking foot continues to stick unless the impact moved it.
    AfterEvent,
}

/// A closed constraint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry<const N: usize> {
    pub(crate) role: Role,
    pub(crate) row: Row<f64, N>,
    /// Direction of its force: equal to `row`, except for sliding feet.
    pub(crate) force_row: Row<f64, N>,
    pub(crate) gap: f64,
    /// Whether it was active before, and whether it separates.
    pub(super) was_active: bool,
    pub(super) separates: bool,
    /// Rate of the gap, and its acceleration at constant velocities.
    pub(crate) rate: f64,
    pub(crate) bias: f64,
    /// Acceleration of the cable's gap by its pulley \[m/s²\], and mobility of the pulley at the
    /// end of the cable \[1/kg\].
    pub(crate) winding: f64,
    pub(crate) compliance: f64,
    /// Direction of the ground force on a foot, world frame.
    pub(crate) direction: [f64; 3],
}

impl<const N: usize> Entry<N> {
    pub(super) fn is_normal(&self) -> bool {
        !self.role.is_tangent()
    }
}
