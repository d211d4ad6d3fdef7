//! Accelerations, or changes of velocity, of all coordinates.

use nalgebra::{Vector3, Vector6};
use twinrig_legged::LEGS;
use twinrig_robot::leg::Planar;

use crate::rows::Row;
use crate::state::State;

/// Accelerations, or changes of velocity, of all coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) sagittal: Vector3<f64>,
    pub(crate) lateral: Vector3<f64>,
    pub(crate) foot: [Planar; LEGS],
    pub(crate) drive: [[f64; 2]; LEGS],
}

impl Motion {
    pub(crate) const fn zero() -> Self {
        let still = Vector3::new(0.0, 0.0, 0.0);
        Self {
            sagittal: still,
            lateral: still,
            foot: [Planar::new(0.0, 0.0); LEGS],
            drive: [[0.0; 2]; LEGS],
        }
    }

    /// Accelerations of the trunk: x, z, pitch, y, roll, yaw.
    pub(crate) fn trunk(&self) -> Vector6<f64> {
        let (s, l) = (&self.sagittal, &self.lateral);
        Vector6::new(s.x, s.y, s.z, l.x, l.y, l.z)
    }

    /// Adds the accelerations of trunk and legs due to coupled forces.
    pub(crate) fn add(&mut self, coupled: &Coupled) {
        self.sagittal += coupled.trunk.fixed_rows::<3>(0);
        self.lateral += coupled.trunk.fixed_rows::<3>(3);
        self.add_to_legs(&coupled.legs, 1.0);
    }

    #[inline]
    pub(crate) fn add_to_legs(&mut self, legs: &[Vector3<f64>; LEGS], magnitude: f64) {
        for ((foot, drive), leg) in self.foot.iter_mut().zip(&mut self.drive).zip(legs) {
            *foot += Planar::new(leg.x, leg.y) * magnitude;
            drive[0] += leg.z * magnitude;
        }
    }

    /// Component along a row.
    pub(crate) fn along(&self, row: &Row) -> f64 {
        let [hip, pulley] = self.drive[row.leg];
        self.sagittal.dot(&row.sagittal)
            + self.lateral.dot(&row.lateral)
            + self.foot[row.leg].dot(&row.foot)
            + hip * row.hip
            + pulley * row.pulley
    }

    /// Adds the velocity changes of `seconds` of this motion to a state.
    pub(crate) fn apply(&self, state: &mut State, seconds: f64, legs: usize) {
        let [x, z, pitch] = self.sagittal.into();
        let [y, roll, yaw] = self.lateral.into();
        state.set_velocity(state.velocity() + Vector3::new(x, y, z) * seconds);
        state.set_rate(state.rate() + Vector3::new(roll, pitch, yaw) * seconds);
        for leg in 0..legs {
            state.set_foot_velocity(leg, state.foot_velocity(leg) + self.foot[leg] * seconds);
            state.set_hip_rate(leg, state.hip_rate(leg) + self.drive[leg][0] * seconds);
            state.set_pulley_rate(leg, state.pulley_rate(leg) + self.drive[leg][1] * seconds);
        }
    }
}

/// Accelerations of the trunk (x, z, pitch, y, roll, yaw) and of all legs (x and z of the foot,
/// hip) due to one force.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coupled {
    pub(crate) trunk: Vector6<f64>,
    pub(crate) legs: [Vector3<f64>; LEGS],
}
