//! Measurements of the plant.

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_legged::{FootMotion, LEGS, Readings};
use twinrig_runtime::EnergyBalance;

use crate::integrators::flow::{Flow, ImpulseSums};
use crate::model::articulated::{into_world, rotation};
use crate::model::feet::{feet, surfaces};
use crate::model::real::{Lanes, Real};
use crate::model::site::{Footing, Site};

impl<const N: usize> Flow<N> {
    /// Returns a contact point of one leg; computes this leg only.
    pub(crate) fn site(&self, leg: usize, links: usize) -> Site<f64, N> {
        let of = |lanes: &[Lanes; N]| lanes.map(|lane| lane.lane(leg));
        let turns = of(&self.state.angles).map(Real::sin_cos);
        let (sines, cosines) = (turns.map(|(sine, _)| sine), turns.map(|(_, cosine)| cosine));
        Site::from_turns(
            &self.model.legs[leg].constants,
            [&sines, &cosines, &of(&self.state.rates)],
            [self.state.velocity, self.state.turning],
            0,
            links,
        )
    }

    /// Returns gap and velocity of a contact point relative to the ground; none without ground.
    pub(crate) fn footing(&self, leg: usize, links: usize) -> Option<Footing<f64>> {
        let ground = self.model.ground.as_ref()?;
        let upright = rotation(self.state.attitude);
        let site = self.site(leg, links);
        Some(site.footing(ground, self.state.position, &upright))
    }

    fn mean(&self, of: impl Fn(&ImpulseSums) -> Lanes, leg: usize) -> f64 {
        let [before, after] = [&self.impulse_sums_before, &self.impulse_sums]
            .map(|impulse_sums| of(impulse_sums).lane(leg));
        if self.run_seconds > 0.0 {
            (after - before) / self.run_seconds
        } else {
            0.0
        }
    }
}

impl<const N: usize> Readings for Flow<N> {
    fn position(&self) -> Vector3<f64> {
        self.state.position.into()
    }

    fn attitude(&self) -> [f64; 4] {
        self.state.attitude
    }

    fn rotation(&self) -> Matrix3<f64> {
        let rows = rotation(self.state.attitude);
        Matrix3::from_fn(|i, j| rows[i][j])
    }

    fn velocity(&self) -> Vector3<f64> {
        into_world(&rotation(self.state.attitude), self.state.velocity).into()
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        self.state.turning.into()
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn hip(&self, leg: usize) -> f64 {
        self.state.angles[0].lane(leg) - self.model.legs[leg].pantograph.hip_reference()
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        self.state.rates[0].lane(leg)
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        self.mean(|impulse_sums| impulse_sums.hip, leg)
    }

    fn pulley(&self, leg: usize) -> f64 {
        self.state.pulley.lane(leg)
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        self.state.pulley_rate.lane(leg)
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        self.mean(|impulse_sums| impulse_sums.knee, leg)
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        self.mean(|impulse_sums| impulse_sums.cable, leg)
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        std::array::from_fn(|i| self.state.angles[i].lane(leg))
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        feet(&self.model, &self.state)
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        surfaces(&self.model, &self.state, feet)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.impulse_sums.ground[leg]
    }
}

#[cfg(test)]
mod tests {
    use twinrig_legged::{Base, Drives};

    use super::*;
    use crate::fixtures::{HARD, flat, flow, robot, tumbling};

    #[test]
    fn feet_of_all_legs_match_the_contact_points_of_each() {
        let mut flow = flow::<4>(&robot(), Base::Free, HARD, Drives::None, Some(flat()));
        tumbling(&mut flow);
        for angle in &mut flow.state.angles {
            *angle += Lanes::new([0.0, 0.7, -1.4, 2.1]);
        }
        let rotation = rotation(flow.state.attitude);
        let feet = flow.feet();
        let surfaces = flow.surfaces(&feet);
        for leg in 0..LEGS {
            let sites = [3, 4].map(|links| flow.site(leg, links));
            let [foot, tip] = sites.map(|site| site.in_world(flow.state.position, &rotation));
            let velocity = into_world(&rotation, sites[0].velocity);
            assert_eq!(feet[leg].position, Vector3::from(foot));
            assert_eq!(feet[leg].velocity, Vector3::from(velocity));
            assert_eq!(surfaces[leg].gap, foot[2].min(tip[2]));
        }
        assert!(
            (0..LEGS).any(|leg| surfaces[leg].gap < feet[leg].position.z),
            "a toe is below its foot"
        );
    }
}
