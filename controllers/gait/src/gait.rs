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

/// Lag of the second leg of a pair in a gallop, a tenth of a cycle \[rad\].
const PAIR_LAG: f64 = PI / 5.0;

/// Gait: the phase of each leg relative to the common phase of the oscillators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gait {
    /// Diagonal legs in phase.
    #[default]
    Trot,
    /// Legs of one side in phase.
    Pace,
    /// Lateral sequence: a quarter of a cycle apart, each hind leg followed by the fore leg of its
    /// side.
    Walk,
    /// Fore legs in phase, hind legs in phase.
    Bound,
    /// Diagonal sequence: a quarter of a cycle apart, each hind leg followed by the fore leg of the
    /// other side.
    DiagonalWalk,
    /// Transverse gallop: the hind legs, then the fore legs, in both pairs the left one first.
    DiagonalGallop,
    /// The right hind leg, the left one, then the left fore leg and the right one.
    RotaryGallop,
}

impl Gait {
    /// All gaits.
    pub const ALL: [Self; 7] = [
        Self::Trot,
        Self::Pace,
        Self::Walk,
        Self::Bound,
        Self::DiagonalWalk,
        Self::DiagonalGallop,
        Self::RotaryGallop,
    ];

    /// Name in scenarios.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trot => "trot",
            Self::Pace => "pace",
            Self::Walk => "walk",
            Self::Bound => "bound",
            Self::DiagonalWalk => "diagonal-walk",
            Self::DiagonalGallop => "diagonal-gallop",
            Self::RotaryGallop => "rotary-gallop",
        }
    }

    /// Phase of the leg at `corner` relative to the common phase, in `[−π, π]` \[rad\]. A leg with
    /// a greater phase touches down earlier.
    ///
    /// | gait | left fore | right fore | left hind | right hind |
    /// |---|---|---|---|---|
    /// | trot | 0 | π | π | 0 |
    /// | pace | 0 | π | 0 | π |
    /// | walk | 0 | π | π/2 | −π/2 |
    /// | bound | 0 | 0 | π | π |
    /// | diagonal walk | 0 | π | −π/2 | π/2 |
    /// | diagonal gallop | 0 | −π/5 | π | 4π/5 |
    /// | rotary gallop | 0 | −π/5 | 4π/5 | π |
    ///
    /// The symmetrical gaits are those of Hildebrand (Science 150, 1965) and Alexander (Int. J.
    /// Robotics Research 3, 1984). A gallop is defined by the sequence of the legs; within a pair
    /// they are a tenth of a cycle apart here, the pairs half a cycle.
    ///
    /// ```
    /// use twinrig_gait::{Corner, Gait};
    /// let right_hind = Corner { fore: false, left: false };
    /// assert_eq!(Gait::Trot.phase_difference(right_hind), 0.0);
    /// ```
    pub fn phase_difference(self, corner: Corner) -> f64 {
        let [left_fore, right_fore, left_hind, right_hind] = match self {
            Self::Trot => [0.0, PI, PI, 0.0],
            Self::Pace => [0.0, PI, 0.0, PI],
            Self::Walk => [0.0, PI, FRAC_PI_2, -FRAC_PI_2],
            Self::Bound => [0.0, 0.0, PI, PI],
            Self::DiagonalWalk => [0.0, PI, -FRAC_PI_2, FRAC_PI_2],
            Self::DiagonalGallop => [0.0, -PAIR_LAG, PI, PI - PAIR_LAG],
            Self::RotaryGallop => [0.0, -PAIR_LAG, PI - PAIR_LAG, PI],
        };
        match (corner.fore, corner.left) {
            (true, true) => left_fore,
            (true, false) => right_fore,
            (false, true) => left_hind,
            (false, false) => right_hind,
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
    fn pairs_in_phase_are_those_of_the_textbook() {
        let [lf, rf, lh, rh] = [0, 1, 2, 3];
        for (gait, pairs) in [
            (Gait::Trot, [[lf, rh], [rf, lh]]),
            (Gait::Pace, [[lf, lh], [rf, rh]]),
            (Gait::Bound, [[lf, rf], [lh, rh]]),
        ] {
            let [[a, b], [c, d]] =
                pairs.map(|pair| pair.map(|leg: usize| gait.phase_difference(CORNERS[leg])));
            assert!(a == b && c == d && (a - c).abs() == PI, "{}", gait.name());
        }
    }

    #[test]
    fn sequences_are_those_of_the_textbook() {
        let [lf, rf, lh, rh] = [0, 1, 2, 3];
        let expected = [
            (Gait::Walk, [rh, rf, lh, lf]),
            (Gait::DiagonalWalk, [lh, rf, rh, lf]),
            // After the hind legs, the fore legs in the same order, or the other way round.
            (Gait::DiagonalGallop, [lh, rh, lf, rf]),
            (Gait::RotaryGallop, [rh, lh, lf, rf]),
        ];
        for (gait, order) in expected {
            // A leg with a greater phase touches down earlier; LF with phase 0 comes round again.
            let ahead = |leg: usize| gait.phase_difference(CORNERS[leg]).rem_euclid(2.0 * PI);
            let mut found = [0, 1, 2, 3];
            found.sort_by(|&a, &b| ahead(b).total_cmp(&ahead(a)));
            let first = found.iter().position(|leg| *leg == order[0]).unwrap();
            found.rotate_left(first);
            assert_eq!(found, order, "{}", gait.name());
        }
    }

    #[test]
    fn names_parse_back_and_an_unknown_name_lists_the_known_ones() {
        for gait in Gait::ALL {
            assert_eq!(gait.name().parse(), Ok(gait));
        }
        let error = "canter".parse::<Gait>().unwrap_err();
        assert!(
            error
                .to_string()
                .contains("trot, pace, walk, bound, diagonal-walk")
        );
    }
}
