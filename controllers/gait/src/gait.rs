//! Gait tables: the phase differences of the four legs.

use std::f64::consts::{FRAC_PI_2, PI};
use std::str::FromStr;

use crate::GaitError;

/// Corner of the trunk at which a leg is mounted; determines its phase in a gait table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner {
    /// At or in front of the centre of mass.
    pub fore: bool,
    /// On the left or in the middle plane.
    pub left: bool,
}

impl Corner {
    /// Corner of a hip at `[x, y, z]` in the trunk frame (x forward, y left) \[m\].
    pub fn of_hip(hip: [f64; 3]) -> Self {
        Self {
            fore: hip[0] >= 0.0,
            left: hip[1] >= 0.0,
        }
    }

    /// Index of the end: 0 for the fore legs, 1 for the hind legs.
    pub(crate) fn end(self) -> usize {
        usize::from(!self.fore)
    }
}

/// Gait: the phase of each leg relative to the common phase of the oscillators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gait {
    /// Diagonal legs in phase.
    #[default]
    Trot,
    /// Legs of one side in phase.
    Pace,
    /// One leg after the other, each hind leg followed by the fore leg of its side.
    Walk,
    /// Fore legs in phase, hind legs in phase.
    Bound,
}

impl Gait {
    /// All gaits.
    pub const ALL: [Self; 4] = [Self::Trot, Self::Pace, Self::Walk, Self::Bound];

    /// Name in scenarios.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trot => "trot",
            Self::Pace => "pace",
            Self::Walk => "walk",
            Self::Bound => "bound",
        }
    }

    /// Phase of the leg at `corner` relative to the common phase, in `[−π, π]` \[rad\].
    ///
    /// For left fore, right fore, left hind, right hind: trot 0 π π 0, pace 0 π 0 π, walk 0 π π/2
    /// 3π/2 (as −π/2), bound 0 0 π π.
    ///
    /// ```
    /// use twinrig_gait::{Corner, Gait};
    /// let right_hind = Corner { fore: false, left: false };
    /// assert_eq!(Gait::Trot.phase_difference(right_hind), 0.0);
    /// ```
    pub fn phase_difference(self, corner: Corner) -> f64 {
        match (self, corner.fore, corner.left) {
            (Self::Trot, fore, left) if fore != left => PI,
            (Self::Pace, _, false) | (Self::Walk, true, false) | (Self::Bound, false, _) => PI,
            (Self::Walk, false, true) => FRAC_PI_2,
            (Self::Walk, false, false) => -FRAC_PI_2,
            _ => 0.0,
        }
    }
}

impl FromStr for Gait {
    type Err = GaitError;

    fn from_str(name: &str) -> Result<Self, GaitError> {
        Self::ALL
            .into_iter()
            .find(|gait| gait.name() == name)
            .ok_or_else(|| GaitError::UnknownGait {
                name: name.to_owned(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Corner; 4] = [
        Corner {
            fore: true,
            left: true,
        },
        Corner {
            fore: true,
            left: false,
        },
        Corner {
            fore: false,
            left: true,
        },
        Corner {
            fore: false,
            left: false,
        },
    ];

    #[test]
    fn tables_are_those_of_the_textbook() {
        let table = |gait: Gait| CORNERS.map(|corner| gait.phase_difference(corner));
        assert_eq!(table(Gait::Trot), [0.0, PI, PI, 0.0]);
        assert_eq!(table(Gait::Pace), [0.0, PI, 0.0, PI]);
        assert_eq!(table(Gait::Walk), [0.0, PI, FRAC_PI_2, -FRAC_PI_2]);
        assert_eq!(table(Gait::Bound), [0.0, 0.0, PI, PI]);
    }

    #[test]
    fn in_a_walk_a_fore_leg_follows_the_hind_leg_of_its_side() {
        // A leg with a greater phase touches down earlier: order by falling phase.
        let mut order = [0, 1, 2, 3];
        let ahead = |leg: usize| {
            Gait::Walk
                .phase_difference(CORNERS[leg])
                .rem_euclid(2.0 * PI)
        };
        order.sort_by(|&a, &b| ahead(b).total_cmp(&ahead(a)));
        assert_eq!(order, [3, 1, 2, 0]); // right hind, right fore, left hind, left fore
    }

    #[test]
    fn names_parse_back_and_an_unknown_name_lists_the_known_ones() {
        for gait in Gait::ALL {
            assert_eq!(gait.name().parse(), Ok(gait));
        }
        let error = "canter".parse::<Gait>().unwrap_err();
        assert!(error.to_string().contains("trot, pace, walk, bound"));
    }
}
