//! Segments of a leg as rigid bodies: what a plant in maximal coordinates is made of.

use twinrig_robot::Leg;

/// A segment as a rigid body in the leg's plane: a thin uniform rod along its link, and the foot at the end of the last. A
/// rod has no inertia about itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// From the joint above to the joint below, or to the foot \[m\].
    pub length: f64,
    /// How far it reaches above the joint: what the parallel rod ends at \[m\].
    pub above: f64,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass, along the link from the joint above \[m\].
    pub centre: f64,
    /// Moment of inertia about the centre of mass, across the plane \[kg·m²\].
    pub moment: f64,
}

impl Segment {
    /// The three segments of a leg from the hip down, the foot with the third.
    pub fn of(leg: &Leg) -> [Self; 3] {
        [
            Self::rod(leg.mass.l1, 0.0, leg.l1),
            Self::rod(leg.mass.l2, 0.0, leg.l2),
            Self::rod(leg.mass.l3, leg.l_delta, leg.l3 - leg.l_delta).with_foot(leg.mass.foot),
        ]
    }

    fn rod(mass: f64, above: f64, length: f64) -> Self {
        let whole = above + length;
        Self {
            length,
            above,
            mass,
            centre: 0.5 * (length - above),
            moment: mass * whole * whole / 12.0,
        }
    }

    /// The same with a point mass at its end.
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
    fn mass_and_moments_are_those_of_the_points_that_a_rod_is_made_of() {
        let leg = Leg::example();
        let [_, _, third] = Segment::of(&leg);
        // A hundred thousand points of the rod, and the foot.
        let (count, whole) = (100_000, leg.l3);
        let points = (0..count).map(|n| {
            let at = (f64::from(n) + 0.5) / f64::from(count) * whole - leg.l_delta;
            (leg.mass.l3 / f64::from(count), at)
        });
        let points: Vec<_> = points.chain([(leg.mass.foot, third.length)]).collect();
        let mass: f64 = points.iter().map(|(m, _)| m).sum();
        let first: f64 = points.iter().map(|(m, at)| m * at).sum();
        let second: f64 = points.iter().map(|(m, at)| m * at * at).sum();
        assert!((third.mass - mass).abs() < 1e-12 * mass);
        assert!((third.mass * third.centre - first).abs() < 1e-10 * mass * whole);
        let own = third.moment + third.mass * third.centre * third.centre;
        // What points miss of a rod: 1/count² of its moment.
        assert!((own - second).abs() < 1e-9 * second);
    }
}
