//! Readings of the robot for the output signals.

use nalgebra::{Matrix3, Vector3};
use rapier3d_f64::math::Vector;
use twinrig_contact::Surface;
use twinrig_legged::{FootMotion, LEGS, Readings, surfaces_below};
use twinrig_runtime::EnergyBalance;

use crate::conversion::{to_nalgebra, wxyz};
use crate::robot::Machine;

impl Readings for Machine {
    fn position(&self) -> Vector3<f64> {
        to_nalgebra(self.trunk().pose.translation)
    }

    fn attitude(&self) -> [f64; 4] {
        wxyz(self.trunk().pose.rotation)
    }

    fn rotation(&self) -> Matrix3<f64> {
        let rotation = self.trunk().pose.rotation;
        let column = |axis| to_nalgebra(rotation * axis);
        Matrix3::from_columns(&[column(Vector::X), column(Vector::Y), column(Vector::Z)])
    }

    fn velocity(&self) -> Vector3<f64> {
        to_nalgebra(self.trunk().velocity)
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        let trunk = self.trunk();
        to_nalgebra(trunk.pose.rotation.inverse() * trunk.turning)
    }

    fn energy(&self) -> EnergyBalance {
        self.state.ledger.balance()
    }

    fn hip(&self, leg: usize) -> f64 {
        self.state.legs[leg].angles[0] - self.model.legs[leg].pantograph.hip_reference()
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        self.state.legs[leg].drives[0].rate
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        self.state.legs[leg].drives[0].torque
    }

    fn pulley(&self, leg: usize) -> f64 {
        self.state.legs[leg].drives[1].angle
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        self.state.legs[leg].drives[1].rate
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        self.state.legs[leg].drives[1].torque
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        self.state.legs[leg].tension
    }

    fn abduction(&self, leg: usize) -> f64 {
        self.state.legs[leg].abduction.angle
    }

    fn abduction_torque(&self, leg: usize) -> f64 {
        self.state.legs[leg].abduction.torque
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        self.state.legs[leg].angles
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        let mut feet = [FootMotion::default(); LEGS];
        for (leg, (foot, model)) in feet.iter_mut().zip(&self.model.legs).enumerate() {
            let view = self.view(leg);
            foot.position = to_nalgebra(view.place(&model.foot));
            foot.velocity = to_nalgebra(view.speed(&model.foot));
        }
        feet
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        surfaces_below(self.model.ground.as_ref(), feet)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.state.legs[leg].ground
    }

    fn segments_impulse(&self, leg: usize) -> [f64; 3] {
        self.state.body.segments[leg]
    }

    fn trunk_impulse(&self) -> [f64; 3] {
        self.state.body.trunk
    }
}
