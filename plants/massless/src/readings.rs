//! Measurements of the plant.

use std::f64::consts::TAU;
use std::ops::Add;

use libm::atan2;
use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_legged::{FootMotion, LEGS, Readings, surfaces_below};
use twinrig_robot::leg::{Planar, Stop};
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

    /// The flow of each leg, and the leg's index in it.
    fn legs(&self) -> impl Iterator<Item = (&Flow, usize)> {
        let flows = self.flows.iter();
        flows.flat_map(|flow| (0..flow.model.legs.len()).map(move |leg| (flow, leg)))
    }

    /// The flow with the trunk; if there are several, the trunk is fixed and the same in all.
    fn trunk(&self) -> &Flow {
        &self.flows[0]
    }
}

impl Readings for Islands {
    fn position(&self) -> Vector3<f64> {
        let (position, model) = (self.trunk().state.position(), &self.trunk().model);
        match model.centre_of_trunk() {
            None => position,
            Some(centre) => position + self.rotation() * centre,
        }
    }

    fn attitude(&self) -> [f64; 4] {
        self.trunk().state.attitude()
    }

    fn rotation(&self) -> Matrix3<f64> {
        self.trunk().placement.rotation
    }

    fn velocity(&self) -> Vector3<f64> {
        let (velocity, model) = (self.trunk().state.velocity(), &self.trunk().model);
        self.rotation()
            * match model.centre_of_trunk() {
                None => velocity,
                Some(centre) => velocity + self.angular_velocity().cross(&centre),
            }
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
        let first = flow.state.hip(leg);
        // By its assembly mode each segment is less than half a turn from the one before: so the
        // angles follow the first through whole turns.
        let beside = |previous: f64, e: Planar| {
            let angle = atan2(e.x, -e.y);
            angle + TAU * ((previous - angle) / TAU).round()
        };
        let second = beside(first, second);
        [first, second, beside(second, third)]
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        let mut feet = [FootMotion::default(); LEGS];
        for (foot, (flow, leg)) in feet.iter_mut().zip(self.legs()) {
            *foot = flow.foot_motion(leg);
        }
        feet
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        let mut surfaces = surfaces_below(None, feet);
        for (surface, (flow, leg)) in surfaces.iter_mut().zip(self.legs()) {
            *surface = flow.placement.surfaces[leg];
        }
        surfaces
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        let (flow, leg) = self.of(leg);
        flow.impulses[leg]
    }
}

impl Flow {
    fn foot_motion(&self, leg: usize) -> FootMotion {
        let (state, rotation) = (&self.state, &self.placement.rotation);
        let foot = self.model.legs[leg].foot_in_trunk(state.foot(leg));
        let foot_velocity = state.foot_velocity(leg);
        let sideways = (state.velocity() + state.rate().cross(&foot)).y;
        FootMotion {
            position: state.position() + rotation * foot,
            velocity: rotation * Vector3::new(foot_velocity.x, sideways, foot_velocity.y),
        }
    }
}
