//! Dynamics of a servo and its load under a constant duty cycle.

use libm::sin;
use serde::{Deserialize, Serialize};
use twinrig_actuator::serial::Winding;
use twinrig_kernel::SimDuration;
use twinrig_robot::serial::{Friction, Gear};

use crate::error::ServoBenchError;
use crate::parameters::ServoBenchParameters;

/// Standard gravity \[m/s²\].
const GRAVITY: f64 = 9.80665;
/// Length of a substep over the shortest time constant: the midpoint rule then is far from its
/// limit of stability, 2.
const RESOLUTION: f64 = 0.2;
/// Substeps of a period of the controller beyond which a servo is too stiff.
const SUBSTEPS_MAX: f64 = 1000.0;

/// State of motor and arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// Angle of the arm \[rad\].
    pub angle: f64,
    /// Its rate; exactly zero at rest \[rad/s\].
    pub rate: f64,
    /// Rise of the temperature of the winding \[K\].
    pub rise: f64,
    /// Angle by which the motor is ahead of the arm, within the backlash \[rad\].
    pub lead: f64,
    /// Rate of the motor while no teeth of the gear touch, \[rad/s\]; otherwise it is that of the
    /// arm.
    pub loose: Option<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) winding: Winding,
    pub(crate) motor_inertia: f64,
    pub(crate) load_inertia: f64,
    /// Greatest lead of the motor to either side \[rad\].
    pub(crate) half_gap: f64,
    /// Torque of gravity on a horizontal arm \[N·m\].
    weight: f64,
    offset: f64,
    pub(crate) friction: Friction,
    pub(crate) gear: Gear,
    pub(crate) is_lossy: bool,
    /// Substeps of a period.
    pub(crate) substeps: u32,
}

impl Model {
    pub(crate) fn new(parameters: &ServoBenchParameters) -> Result<Self, ServoBenchError> {
        let (load, motor) = (&parameters.load, &parameters.motor);
        let load_inertia = (load.mass + load.arm_mass / 3.0) * load.length * load.length;
        let moment = (load.mass + 0.5 * load.arm_mass) * load.length;
        let constant = motor.torque_constant;
        let damping = constant * constant / motor.resistance + parameters.friction.viscous;
        // Within the backlash the motor is alone.
        let inertia = if parameters.gear.backlash > 0.0 {
            motor.inertia
        } else {
            motor.inertia + load_inertia
        };
        let time_constant_s = inertia / damping;
        let period_s = parameters.controller.period;
        let substeps = (period_s / (RESOLUTION * time_constant_s)).ceil().max(1.0);
        if substeps > SUBSTEPS_MAX {
            return Err(ServoBenchError::Stiff {
                time_constant_s,
                period_s,
            });
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 1 and SUBSTEPS_MAX"
        )]
        let substeps = substeps as u32;
        Ok(Self {
            winding: Winding::new(motor, &parameters.supply),
            motor_inertia: motor.inertia,
            load_inertia,
            // Without a load nothing is on the other side of the gap.
            half_gap: if load_inertia > 0.0 {
                0.5 * parameters.gear.backlash
            } else {
                0.0
            },
            weight: moment * GRAVITY,
            offset: load.offset,
            friction: parameters.friction,
            gear: parameters.gear,
            is_lossy: parameters.gear.is_lossy(),
            substeps,
        })
    }

    /// Divides a period of the controller into substeps of at most `longest`; they get no longer.
    pub(crate) fn divide(
        &mut self,
        period: SimDuration,
        longest: SimDuration,
    ) -> Result<(), ServoBenchError> {
        let substeps = period.as_nanos().div_ceil(longest.as_nanos().max(1));
        match u32::try_from(substeps) {
            Ok(substeps) if f64::from(substeps) <= SUBSTEPS_MAX => {
                self.substeps = self.substeps.max(substeps);
                Ok(())
            }
            _ => Err(ServoBenchError::Fine {
                longest_s: longest.as_secs_f64(),
                least_s: period.as_secs_f64() / SUBSTEPS_MAX,
            }),
        }
    }

    /// Returns kinetic and potential energy; the latter is zero where the arm hangs down \[J\].
    pub(crate) fn stored(&self, state: &State) -> [f64; 2] {
        let (motor, load) = (self.motor_inertia, self.load_inertia);
        let half = sin(0.5 * (state.angle + self.offset));
        let kinetic = match state.loose {
            None => (motor + load) * state.rate * state.rate,
            Some(rate) => motor * rate * rate + load * state.rate * state.rate,
        };
        [0.5 * kinetic, 2.0 * self.weight * half * half]
    }

    /// Returns the torque of gravity on the shaft \[N·m\].
    pub(crate) fn gravity(&self, angle: f64) -> f64 {
        -self.weight * sin(angle + self.offset)
    }
}
