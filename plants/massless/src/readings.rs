//! Measurements of the plant.

use std::ops::Add;

use libm::atan2;
use nalgebra::{Matrix3, Vector3};
use twinrig_leg::{Planar, Stop};
use twinrig_legged::Readings;
use twinrig_runtime::EnergyBalance;

use crate::flow::Flow;
use crate::plant::Islands;

impl Islands {
    /// The flow of a leg, and the leg's index in it.
    fn of(&self, leg: usize) -> (&Flow, usize) {
        match self.flows.as_slice() {
            [flow] => (flow, leg),
            flows => (&flows[leg], 0),
        }
    }

    /// The flow with the trunk; if there are several, the trunk is fixed and the same in all.
    fn trunk(&self) -> &Flow {
        &self.flows[0]
    }
}

impl Readings for Islands {
    fn position(&self) -> Vector3<f64> {
        self.trunk().state.position()
    }

    fn attitude(&self) -> [f64; 4] {
        self.trunk().state.attitude()
    }

    fn rotation(&self) -> Matrix3<f64> {
        self.trunk().placement.rotation
    }

    fn velocity(&self) -> Vector3<f64> {
        self.rotation() * self.trunk().state.velocity()
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        self.trunk().state.rate()
    }

    fn energy(&self) -> EnergyBalance {
        let parts = self.flows.iter().map(Flow::energy);
        parts.fold(EnergyBalance::default(), Add::add)
    }

    fn hip(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.state.hip(leg) - flow.model.legs[leg].pantograph.hip_reference()
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.state.hip_rate(leg)
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.torques[leg][0]
    }

    fn pulley(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.state.pulley(leg)
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.state.pulley_rate(leg)
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.torques[leg][1]
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.forces[leg][Stop::Cable as usize]
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        let (flow, leg) = self.of(leg);
        // The first angle is a coordinate; the others take an arc tangent each.
        let [_, second, third] = flow.placement.poses[leg].along;
        let of = |e: Planar| atan2(e.x, -e.y);
        [flow.state.hip(leg), of(second), of(third)]
    }

    fn foot_position(&self, leg: usize) -> Vector3<f64> {
        let (flow, leg) = self.of(leg);
        let foot = flow.model.legs[leg].foot_in_trunk(flow.state.foot(leg));
        flow.state.position() + flow.placement.rotation * foot
    }

    fn foot_velocity(&self, leg: usize) -> Vector3<f64> {
        let (flow, leg) = self.of(leg);
        let state = &flow.state;
        let foot = flow.model.legs[leg].foot_in_trunk(state.foot(leg));
        let foot_velocity = state.foot_velocity(leg);
        let sideways = (state.velocity() + state.rate().cross(&foot)).y;
        flow.placement.rotation * Vector3::new(foot_velocity.x, sideways, foot_velocity.y)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        let (flow, leg) = self.of(leg);
        flow.impulses[leg]
    }

    fn ground_normal(&self, leg: usize) -> Vector3<f64> {
        let (flow, leg) = self.of(leg);
        flow.placement.surfaces[leg].normal
    }

    fn clearance(&self, leg: usize) -> f64 {
        let (flow, leg) = self.of(leg);
        flow.placement.surfaces[leg].gap
    }
}
