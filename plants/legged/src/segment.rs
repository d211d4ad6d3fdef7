//! Leg segments as rigid bodies, for plants in maximal coordinates.

use twinrig_robot::Leg;

/// Segment as a rigid body in the plane of the leg: a thin uniform rod along its link, with the
/// foot as a point mass at the end of the last. A rod has no inertia about its own axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Distance from the joint above to the joint below, or to the foot \[m\].
    pub length: f64,
    /// Length above the joint, up to the attachment of the parallel rod \[m\].
    pub above: f64,
    /// Mass \[kg\].
    pub mass: f64,
    /// Position of the centre of mass along the link, from the joint above \[m\].
    pub centre: f64,
    /// Moment of inertia about the centre of mass, normal to the plane \[kg·m²\].
    pub moment: f64,
}

impl Segment {
    /// Returns the three segments of a leg from the hip down, the third including the foot.
    pub fn of(leg: &Leg) -> [Self; 3] {
        [
            Self::rod(leg.mass.l1, 0.0, leg.l1),
            Self::rod(leg.mass.l2, 0.0, leg.l2),
            Self::rod(leg.mass.l3, leg.l_delta, leg.l3 - leg.l_delta).with_foot(leg.mass.foot),
        ]
    }

    fn rod(mass: f64, above: f64, length: f64) -> Self {
        let total = above + length;
        Self {
            length,
            above,
            mass,
            centre: 0.5 * (length - above),
            moment: mass * total * total / 12.0,
        }
    }

    /// Returns the segment with a point mass added at its end.
    fn with_foot(self, foot: f64) -> Self {
        let mass = self.mass + foot;
        if mass <= 0.0 {
            return self;
        }
        let arm = self.length - self.centre;
        Self {
            mass,
            centre: self.centre + arm * foot / mass,
            moment: self.moment + arm * arm * self.mass * foot / mass,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mass_and_moments_match_discretised_rod() {
        let leg = Leg::example();
        let [_, _, third] = Segment::of(&leg);
        // The rod as 100 000 points, and the foot.
        let (count, length) = (100_000, leg.l3);
        let points = (0..count).map(|n| {
            let at = (f64::from(n) + 0.5) / f64::from(count) * length - leg.l_delta;
            (leg.mass.l3 / f64::from(count), at)
        });
        let points: Vec<_> = points.chain([(leg.mass.foot, third.length)]).collect();
        let mass: f64 = points.iter().map(|(m, _)| m).sum();
        let first: f64 = points.iter().map(|(m, at)| m * at).sum();
        let second: f64 = points.iter().map(|(m, at)| m * at * at).sum();
        assert!((third.mass - mass).abs() < 1e-12 * mass);
        assert!((third.mass * third.centre - first).abs() < 1e-10 * mass * length);
        let second_moment = third.moment + third.mass * third.centre * third.centre;
        // The discretisation error is 1/count² of the moment of the rod.
        assert!((second_moment - second).abs() < 1e-9 * second);
    }
}
