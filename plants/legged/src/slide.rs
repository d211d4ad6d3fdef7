//! Partition of the energy dissipated by a tangential ground impulse into friction and impact.

/// Component of an impulse, with the velocity along it before and after \[N·s, m/s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentialImpulse {
    /// The impulse.
    pub impulse: f64,
    /// The velocity before it.
    pub before: f64,
    /// The velocity after it.
    pub after: f64,
}

impl TangentialImpulse {
    /// Returns the energy dissipated by the impulse: its negative work at the mean velocity \[J\].
    pub fn taken(&self) -> f64 {
        -0.5 * self.impulse * (self.before + self.after)
    }
}

/// Returns the energy of a tangential ground impulse dissipated by friction, and the remainder
/// \[J\].
///
/// The total is exact: the work of the impulse at the mean velocity. A foot that keeps sliding in
/// its direction dissipates it all by friction. Where sliding ends or reverses during the impulse,
/// the mean velocity may oppose the velocity that friction acts against: other impulses accelerate
/// the foot, and the friction that stops it would seem to generate energy. Friction then dissipates
/// by Coulomb's law at the final velocity, zero for a foot that sticks, and the remainder belongs
/// to the impact.
pub fn taken_by_friction(along: [TangentialImpulse; 2]) -> (f64, f64) {
    let [first, second] = along.map(|slide| slide.taken());
    let all = first + second;
    if all >= 0.0 {
        return (all, 0.0);
    }
    let [first, second] = along.map(|slide| -slide.impulse * slide.after);
    // The residual velocity of a sticking foot has either sign.
    let taken = (first + second).max(0.0);
    (taken, all - taken)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NONE: TangentialImpulse = TangentialImpulse {
        impulse: 0.0,
        before: 0.0,
        after: 0.0,
    };

    #[test]
    fn sliding_foot_dissipates_all_by_friction() {
        let slide = TangentialImpulse {
            impulse: -0.2,
            before: 1.0,
            after: 0.5,
        };
        let (taken, rest) = taken_by_friction([slide, NONE]);
        assert!((taken - 0.15).abs() < 1e-15 && rest == 0.0);
    }

    #[test]
    fn accelerated_and_stopped_foot_dissipates_nothing_by_friction() {
        // The foot slid backwards at 1 m/s; without friction it would move forwards.
        let slide = TangentialImpulse {
            impulse: -0.2,
            before: -1.0,
            after: 0.0,
        };
        assert_eq!(taken_by_friction([slide, NONE]), (0.0, -0.1));
    }

    proptest! {
        #[test]
        fn friction_dissipates_and_parts_sum_to_total(
            impulse in prop::array::uniform2(-1.0..1.0_f64),
            before in prop::array::uniform2(-1.0..1.0_f64),
            after in prop::array::uniform2(-1.0..1.0_f64),
        ) {
            let slide = |i: usize| TangentialImpulse { impulse: impulse[i], before: before[i], after: after[i] };
            let (taken, rest) = taken_by_friction([slide(0), slide(1)]);
            prop_assert!(taken >= 0.0);
            let all = slide(0).taken() + slide(1).taken();
            prop_assert!((taken + rest - all).abs() < 1e-15);
        }
    }
}
