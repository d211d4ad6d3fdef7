//! Readings of the plant for the output signals.

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_legged::{FootMotion, LEGS, Readings, surfaces_below};
use twinrig_runtime::EnergyBalance;

use crate::flow::Flow;
use crate::inputs::ABDUCTION;

impl Readings for Flow {
    fn position(&self) -> Vector3<f64> {
        self.trunk.position
    }

    fn attitude(&self) -> [f64; 4] {
        self.trunk.attitude
    }

    fn rotation(&self) -> Matrix3<f64> {
        self.trunk.rotation
    }

    fn velocity(&self) -> Vector3<f64> {
        self.trunk.velocity
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        self.trunk.angular_velocity
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn hip(&self, leg: usize) -> f64 {
        self.angles(leg)[0] - self.model.legs[leg].pantograph.hip_reference()
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        self.legs[leg].map_or(0.0, |frame| frame.bars[0].rate)
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        self.forces[leg].torques[0]
    }

    fn pulley(&self, leg: usize) -> f64 {
        self.legs[leg].map_or(0.0, |frame| frame.pulley)
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        self.legs[leg].map_or(0.0, |frame| frame.pulley_rate)
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        self.forces[leg].torques[1]
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        self.forces[leg].tension
    }

    fn abduction(&self, leg: usize) -> f64 {
        self.legs[leg].map_or(0.0, |frame| frame.carrier.angle)
    }

    fn abduction_rate(&self, leg: usize) -> f64 {
        self.legs[leg].map_or(0.0, |frame| frame.carrier.rate)
    }

    fn abduction_torque(&self, leg: usize) -> f64 {
        self.forces[leg].torques[ABDUCTION]
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        self.legs[leg].map_or([0.0; 3], |frame| frame.bars.map(|bar| bar.angle))
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        let mut feet = [FootMotion::default(); LEGS];
        for (leg, foot) in feet.iter_mut().enumerate().take(self.model.legs.len()) {
            [foot.position, foot.velocity] = self.foot(leg);
        }
        feet
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        let ground = self.model.ground.as_ref();
        surfaces_below(ground.map(|model| &model.ground), feet)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.impulses[leg]
    }

    fn segments_impulse(&self, leg: usize) -> [f64; 3] {
        self.body_impulses.segments[leg]
    }

    fn trunk_impulse(&self) -> [f64; 3] {
        self.body_impulses.trunk
    }
}
