//! Readings of the plant for the output signals.

use nalgebra::{Matrix3, Vector3};
use twinrig_legged::Readings;
use twinrig_runtime::EnergyBalance;

use crate::flow::Flow;

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

    fn angles(&self, leg: usize) -> [f64; 3] {
        self.legs[leg].map_or([0.0; 3], |frame| frame.bars.map(|bar| bar.angle))
    }

    fn foot_position(&self, leg: usize) -> Vector3<f64> {
        self.foot(leg)[0]
    }

    fn foot_velocity(&self, leg: usize) -> Vector3<f64> {
        self.foot(leg)[1]
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.impulses[leg]
    }

    fn ground_normal(&self, leg: usize) -> Vector3<f64> {
        self.below(leg).normal
    }

    fn clearance(&self, leg: usize) -> f64 {
        self.below(leg).gap
    }
}
