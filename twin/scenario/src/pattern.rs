//! Patterns of touch-downs.

use twinrig_document::Placed;

use crate::facts::LegFact;
use crate::language::Words;

/// The phase of each leg's touch-down in the cycle of the first leg.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// Diagonal legs in phase.
    Trot,
    /// Legs of one side in phase.
    Pace,
    /// Lateral sequence: a hind leg, the fore leg of its side, the other hind leg, the other fore
    /// leg, a quarter of a cycle apart.
    Walk,
    /// Fore legs in phase, hind legs in phase.
    Bound,
    /// Diagonal sequence: as [`Pattern::Walk`], but each hind leg is followed by the fore leg of
    /// the other side.
    DiagonalWalk,
    /// The hind legs, then the fore legs, in both pairs the left one first by a tenth of a cycle.
    DiagonalGallop,
    /// As [`Pattern::DiagonalGallop`], but the right one of the hind legs is the first.
    RotaryGallop,
    /// Phases of the legs as shares of a cycle; only differences count.
    Given(Vec<(Placed<String>, f64)>),
}

impl Words for Pattern {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("trot", Pattern::Trot),
        ("pace", Pattern::Pace),
        ("walk", Pattern::Walk),
        ("bound", Pattern::Bound),
        ("diagonal-walk", Pattern::DiagonalWalk),
        ("diagonal-gallop", Pattern::DiagonalGallop),
        ("rotary-gallop", Pattern::RotaryGallop),
    ];
}

impl Pattern {
    /// Returns the pattern of that name in a scenario.
    pub fn named(name: &str) -> Option<&'static Self> {
        let found = Self::WORDS.iter().find(|(word, _)| *word == name);
        found.map(|(_, pattern)| pattern)
    }

    /// Returns the phase of a touch-down of `leg`, as a share of the cycle of the left fore leg;
    /// none if the pattern does not have the leg.
    ///
    /// ```
    /// use twinrig_scenario::{LegFact, Pattern};
    ///
    /// let leg = LegFact { name: "LH".to_owned(), fore: false, left: true };
    /// assert_eq!(Pattern::named("walk").and_then(|walk| walk.share(&leg)), Some(0.75));
    /// ```
    pub fn share(&self, leg: &LegFact) -> Option<f64> {
        let [lf, rf, lh, rh] = match self {
            Self::Trot => [0.0, 0.5, 0.5, 0.0],
            Self::Pace => [0.0, 0.5, 0.0, 0.5],
            Self::Walk => [0.0, 0.5, 0.75, 0.25],
            Self::Bound => [0.0, 0.0, 0.5, 0.5],
            Self::DiagonalWalk => [0.0, 0.5, 0.25, 0.75],
            Self::DiagonalGallop => [0.0, 0.1, 0.5, 0.6],
            Self::RotaryGallop => [0.0, 0.1, 0.6, 0.5],
            Self::Given(legs) => {
                let phase = legs.iter().find(|(name, _)| name.value == leg.name);
                return phase.map(|(_, share)| *share);
            }
        };
        Some(match (leg.fore, leg.left) {
            (true, true) => lf,
            (true, false) => rf,
            (false, true) => lh,
            (false, false) => rh,
        })
    }
}
