//! Measurements of the plant.

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_legged::{FootMotion, LEGS, Readings};
use twinrig_runtime::EnergyBalance;

use crate::integrators::impulse_sums::ImpulseSums;
use crate::model::feet::{feet, surfaces};
use crate::model::real::{Lanes, Real};
use crate::model::rotation::{into_world, rotation};
use crate::plant::flow::Flow;

impl<const N: usize> Flow<N> {
    fn mean(&self, of: impl Fn(&ImpulseSums) -> Lanes, leg: usize) -> f64 {
        let [before, after] = [&self.window.before, &self.run.impulse_sums]
            .map(|impulse_sums| of(impulse_sums).lane(leg));
        if self.window.seconds > 0.0 {
            (after - before) / self.window.seconds
        } else {
            0.0
        }
    }
}

impl<const N: usize> Readings for Flow<N> {
    fn position(&self) -> Vector3<f64> {
        self.run.state.position.into()
    }

    fn attitude(&self) -> [f64; 4] {
        self.run.state.attitude
    }

    fn rotation(&self) -> Matrix3<f64> {
        let rows = rotation(self.run.state.attitude);
        Matrix3::from_fn(|i, j| rows[i][j])
    }

    fn velocity(&self) -> Vector3<f64> {
        into_world(&rotation(self.run.state.attitude), self.run.state.velocity).into()
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        self.run.state.turning.into()
    }

    fn energy(&self) -> EnergyBalance {
        self.run.ledger.balance()
    }

    fn hip(&self, leg: usize) -> f64 {
        self.run.state.angles[0].lane(leg) - self.model.legs[leg].pantograph.hip_reference()
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        self.run.state.rates[0].lane(leg)
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        self.mean(|impulse_sums| impulse_sums.hip, leg)
    }

    fn pulley(&self, leg: usize) -> f64 {
        self.run.state.pulley.lane(leg)
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        self.run.state.pulley_rate.lane(leg)
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        self.mean(|impulse_sums| impulse_sums.knee, leg)
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        self.mean(|impulse_sums| impulse_sums.cable, leg)
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        std::array::from_fn(|i| self.run.state.angles[i].lane(leg))
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        feet(&self.model, &self.run.state)
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        surfaces(&self.model, &self.run.state, feet)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.run.impulse_sums.ground[leg]
    }
}

#[cfg(test)]
mod tests {
    use twinrig_legged::{Base, Drives};

    use super::*;
    use crate::fixtures::{HARD, flat, flow, robot, tumbling};
    use crate::integrators::run_state::RunState;

    #[test]
    fn feet_of_all_legs_match_the_contact_points_of_each() {
        let mut flow = flow::<4>(&robot(), Base::Free, HARD, Drives::None, Some(flat()));
        tumbling(&mut flow);
        for angle in &mut flow.run.state.angles {
            *angle += Lanes::new([0.0, 0.7, -1.4, 2.1]);
        }
        let rotation = rotation(flow.run.state.attitude);
        let feet = flow.feet();
        let surfaces = flow.surfaces(&feet);
        for leg in 0..LEGS {
            let sites =
                [3, 4].map(|links| RunState::site_of(&flow.run.state, &flow.model, leg, links));
            let [foot, tip] = sites.map(|site| site.in_world(flow.run.state.position, &rotation));
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
