//! Friction's share of the energy that an impulse of the ground dissipates.

/// A component of an impulse, with the velocity along it before and after \[N·s, m/s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slide {
    /// The impulse.
    pub impulse: f64,
    /// The velocity before it.
    pub before: f64,
    /// The velocity after it.
    pub after: f64,
}

impl Slide {
    /// Energy that the impulse takes: its work at the mean velocity, with its sign turned \[J\].
    pub fn taken(&self) -> f64 {
        -0.5 * self.impulse * (self.before + self.after)
    }
}

/// Friction's share of the energy that an impulse along the ground dissipates, and the rest \[J\].
///
/// An impulse takes what it does at the mean velocity; so much is exact. Where a foot slides on, friction takes all of that.
/// Where its slide ends or turns round meanwhile, the mean velocity may be against the one that friction answers to: other
/// impulses throw the foot forward, and friction, which holds it, would be said to give energy. There it takes what Coulomb's
/// law says at the velocity that is left, nothing where the foot holds, and the rest is a matter of the impact.
pub fn taken_by_friction(along: [Slide; 2]) -> (f64, f64) {
    let [first, second] = along.map(|slide| slide.taken());
    let all = first + second;
    if all >= 0.0 {
        return (all, 0.0);
    }
    let [first, second] = along.map(|slide| -slide.impulse * slide.after);
    // What the solver leaves of a foot that holds has no sign.
    let taken = (first + second).max(0.0);
    (taken, all - taken)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NONE: Slide = Slide {
        impulse: 0.0,
        before: 0.0,
        after: 0.0,
    };

    #[test]
    fn a_foot_that_slides_on_gives_all_to_friction() {
        let slide = Slide {
            impulse: -0.2,
            before: 1.0,
            after: 0.5,
        };
        let (taken, rest) = taken_by_friction([slide, NONE]);
        assert!((taken - 0.15).abs() < 1e-15 && rest == 0.0);
    }

    #[test]
    fn a_foot_that_is_thrown_forward_and_held_takes_nothing() {
        // It slid backwards at 1 m/s; without friction it would go forwards.
        let slide = Slide {
            impulse: -0.2,
            before: -1.0,
            after: 0.0,
        };
        assert_eq!(taken_by_friction([slide, NONE]), (0.0, -0.1));
    }

    proptest! {
        #[test]
        fn friction_takes_and_nothing_is_lost(
            impulse in prop::array::uniform2(-1.0..1.0_f64),
            before in prop::array::uniform2(-1.0..1.0_f64),
            after in prop::array::uniform2(-1.0..1.0_f64),
        ) {
            let slide = |i: usize| Slide { impulse: impulse[i], before: before[i], after: after[i] };
            let (taken, rest) = taken_by_friction([slide(0), slide(1)]);
            prop_assert!(taken >= 0.0);
            let all = slide(0).taken() + slide(1).taken();
            prop_assert!((taken + rest - all).abs() < 1e-15);
        }
    }
}
