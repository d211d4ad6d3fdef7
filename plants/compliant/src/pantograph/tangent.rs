//! Linear response of the elements inside a leg, for the stiff mode of a leg.

use super::{Joints, Pantographs, Turns};
use crate::lanes::Lanes;

/// Derivatives of the torques inside the legs: damping and stiffness of the cable and of the stops
/// that are often pressed, and the friction of the joints. Springs and other stops are left out.
#[derive(Debug, Clone, Copy)]
pub struct Tangent<L> {
    friction: [L; 3],
    /// Arms of cable, pulley, closed pantograph and end of the range \[m\].
    arms: [L; 4],
    /// Damping and stiffness of cable, closed pantograph and end of the range.
    damping: [L; 3],
    stiffness: [L; 3],
}

impl<L: Lanes> Tangent<L> {
    /// Computes the derivatives.
    #[inline(always)]
    pub fn new<const N: usize>(
        legs: &Pantographs<L, N>,
        turns: &Turns<L, N>,
        joints: &Joints<'_, L, N>,
    ) -> Self {
        let (angles, rates) = (joints.angles, joints.rates);
        let lengths = turns.lengths(legs, rates);
        let (_, end) = legs.ends.nearer(turns.knee());
        let cable = legs.cable.tangent(
            lengths.cable - legs.cable_max + legs.pulley_radius * joints.pulley,
            lengths.rates[1] + legs.pulley_radius * joints.pulley_rate,
        );
        let closed = legs.stops.tangent(
            legs.l_delta * (angles[0] - angles[2]),
            legs.l_delta * (rates[0] - rates[2]),
        );
        let bent = legs.stops.tangent(end.depth, end.slope * lengths.turn);
        Self {
            friction: [legs.friction[0], legs.friction[1], legs.friction[2]],
            arms: [
                lengths.along[1],
                legs.pulley_radius,
                legs.l_delta,
                end.slope,
            ],
            damping: [cable[0], closed[0], bent[0]],
            stiffness: [cable[1], closed[1], bent[1]],
        }
    }

    /// Returns the torques against rates of three links and the pulley, and the tension.
    #[inline(always)]
    pub fn damped(&self, rates: [L; 4]) -> ([L; 4], L) {
        let [first, second, third, _] = rates;
        let (mut torques, tension) = self.resisted(rates, &self.damping);
        let hip = self.friction[0] * first;
        let knee = self.friction[1] * (second - first);
        let ankle = self.friction[2] * (third - second);
        torques[0] += hip - knee;
        torques[1] += knee - ankle;
        torques[2] += ankle;
        (torques, tension)
    }

    /// Returns the torques against angles of three links and the pulley, and the tension.
    #[inline(always)]
    pub fn held(&self, angles: [L; 4]) -> ([L; 4], L) {
        self.resisted(angles, &self.stiffness)
    }

    #[inline(always)]
    fn resisted(&self, [first, second, third, pulley]: [L; 4], by: &[L; 3]) -> ([L; 4], L) {
        let ([cable, radius, delta, end], turn) = (self.arms, second - first);
        let tension = (cable * turn + radius * pulley) * by[0];
        let closed = delta * delta * (first - third) * by[1];
        let knee = cable * tension + end * end * turn * by[2];
        ([closed - knee, knee, -closed, radius * tension], tension)
    }
}

#[cfg(test)]
mod tests;
