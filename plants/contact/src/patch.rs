//! Parts of the ground with another friction.

use std::ops::Range;

use twinrig_kernel::SimTime;

use crate::ground::{Ground, GroundError};

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
    fn applies(&self, x: f64, now: SimTime) -> bool {
        self.begin <= now && self.end.is_none_or(|end| now < end) && self.extent.contains(&x)
    }
}

impl Ground {
    /// Returns the ground with patches, of which the last that applies at a place and a time has
    /// effect; outside of all of them the coefficient is that of the ground.
    ///
    /// # Errors
    /// [`GroundError::Value`] for a negative friction, an empty extent or an empty time.
    pub fn with_patches(mut self, patches: Vec<Patch>) -> Result<Self, GroundError> {
        for patch in &patches {
            let error = |what, value| Err(GroundError::Value { what, value });
            if !(patch.friction.is_finite() && patch.friction >= 0.0) {
                return error("friction of a patch", patch.friction);
            }
            let length = patch.extent.end - patch.extent.start;
            if length.is_nan() || length <= 0.0 {
                return error("length of a patch", length);
            }
            if patch.end.is_some_and(|end| end <= patch.begin) {
                return error("duration of a patch", 0.0);
            }
        }
        self.patches = patches;
        Ok(self)
    }

    /// Returns whether the friction differs between places or times.
    pub fn has_patches(&self) -> bool {
        !self.patches.is_empty()
    }

    /// Returns the coefficient of friction at a place at a time.
    pub fn friction_at(&self, x: f64, now: SimTime) -> f64 {
        let mut patches = self.patches.iter().rev();
        let patch = patches.find(|patch| patch.applies(x, now));
        patch.map_or(self.friction, |patch| patch.friction)
    }

    /// Returns the first instant after `now` at which the friction changes with time.
    pub fn next_change(&self, now: SimTime) -> Option<SimTime> {
        let ends = self.patches.iter().filter_map(|patch| patch.end);
        let begins = self.patches.iter().map(|patch| patch.begin);
        begins.chain(ends).filter(|at| *at > now).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::Terrain;

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
