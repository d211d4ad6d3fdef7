//! Parts of the ground with another friction.

use std::ops::Range;

use twinrig_kernel::SimTime;

/// Coefficient of friction over an extent of the ground along x, for a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Coulomb coefficient \[1\].
    pub friction: f64,
    /// Extent along x; infinite for all the ground \[m\].
    pub extent: Range<f64>,
    /// The time from which it applies.
    pub begin: SimTime,
    /// The time from which it applies no more; none for the rest of the run.
    pub end: Option<SimTime>,
}

impl Patch {
    #[inline]
    pub(crate) fn applies(&self, x: f64, now: SimTime) -> bool {
        self.begin <= now && self.end.is_none_or(|end| now < end) && self.extent.contains(&x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::{Ground, Terrain};

    const EVERYWHERE: Range<f64> = f64::NEG_INFINITY..f64::INFINITY;

    #[test]
    fn last_patch_that_applies_has_effect() {
        let at = SimTime::from_nanos;
        let patch = |friction, extent, begin, end: Option<u64>| Patch {
            friction,
            extent,
            begin: at(begin),
            end: end.map(at),
        };
        let patches = vec![
            patch(0.1, EVERYWHERE, 5, Some(9)),
            patch(0.2, 1.0..2.0, 0, None),
            patch(0.3, 1.5..3.0, 7, Some(8)),
        ];
        let ground = Ground::new(Terrain::Flat, 0.6, 0.0).unwrap();
        let ground = ground.with_patches(patches).unwrap();
        let of = |x, now| ground.friction_at(x, at(now));
        // Beginnings belong to a patch, ends do not.
        assert_eq!(
            [of(0.0, 4), of(0.0, 5), of(0.0, 8), of(0.0, 9)],
            [0.6, 0.1, 0.1, 0.6]
        );
        assert_eq!(
            [of(1.0, 5), of(1.5, 5), of(1.5, 7), of(2.0, 7)],
            [0.2, 0.2, 0.3, 0.3]
        );
        let mut changes = vec![];
        let mut now = at(0);
        while let Some(next) = ground.next_change(now) {
            changes.push(next.as_nanos());
            now = next;
        }
        assert_eq!(changes, [5, 7, 8, 9]);
    }

    #[test]
    fn invalid_patches_are_rejected() {
        let valid = Patch {
            friction: 0.1,
            extent: EVERYWHERE,
            begin: SimTime::ZERO,
            end: None,
        };
        let is_valid = |patch: Patch| {
            let ground = Ground::new(Terrain::Flat, 0.6, 0.0).unwrap();
            ground.with_patches(vec![patch]).is_ok()
        };
        assert!(is_valid(valid.clone()));
        let friction = f64::NAN;
        assert!(!is_valid(Patch {
            friction,
            ..valid.clone()
        }));
        let extent = 1.0..1.0;
        assert!(!is_valid(Patch {
            extent,
            ..valid.clone()
        }));
        let end = Some(SimTime::ZERO);
        assert!(!is_valid(Patch { end, ..valid }));
    }
}
