//! Measurements of a flow.

use nalgebra::{Matrix3, Vector3};
use twinrig_legged::Readings;
use twinrig_runtime::EnergyBalance;

use crate::articulated::{into_world, rotation};
use crate::flow::{Flow, ImpulseSums};
use crate::real::{Lanes, Real};
use crate::site::{Footing, Site};

impl<const N: usize> Flow<N> {
    /// Returns a contact point of one leg; computes this leg only.
    fn site(&self, leg: usize, links: usize) -> Site<f64, N> {
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

    /// Returns gap \[m\] and ground normal of the contact point of a leg that is nearest to the
    /// ground.
    fn nearest(&self, leg: usize) -> Option<(f64, Vector3<f64>)> {
        let ground = self.model.ground.as_ref()?;
        let upright = rotation(self.state.attitude);
        let points = (3..=N).map(|links| {
            let point = self
                .site(leg, links)
                .in_world(self.state.position, &upright);
            let below = ground.below(&Vector3::from(point));
            (below.gap, below.normal)
        });
        points.reduce(|a, b| if b.0 < a.0 { b } else { a })
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

    fn foot_position(&self, leg: usize) -> Vector3<f64> {
        let upright = rotation(self.state.attitude);
        self.site(leg, 3)
            .in_world(self.state.position, &upright)
            .into()
    }

    fn foot_velocity(&self, leg: usize) -> Vector3<f64> {
        let upright = rotation(self.state.attitude);
        into_world(&upright, self.site(leg, 3).velocity).into()
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.impulse_sums.ground[leg]
    }

    fn ground_normal(&self, leg: usize) -> Vector3<f64> {
        self.nearest(leg)
            .map_or_else(Vector3::z, |(_, normal)| normal)
    }

    fn clearance(&self, leg: usize) -> f64 {
        self.nearest(leg).map_or(f64::INFINITY, |(gap, _)| gap)
    }
}
