//! Dynamics of a servo and its load under a constant duty cycle.

use libm::{exp, sin};
use serde::{Deserialize, Serialize};

use crate::error::ServoBenchError;
use crate::friction::{Friction, Gear};
use crate::parameters::ServoBenchParameters;

/// Standard gravity \[m/s²\].
const GRAVITY: f64 = 9.80665;
/// Temperature coefficient of the resistance of copper at 20 °C \[1/K\].
const COPPER: f64 = 3.93e-3;
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

/// Command of the bridge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Bridge {
    /// Open: the motor has no current.
    Open,
    /// Duty cycle, −1 to 1.
    Duty(f64),
}

/// Electrical state at an instant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Electric {
    /// Voltage of the supply behind its resistance \[V\].
    pub voltage: f64,
    /// Current of the motor \[A\].
    pub current: f64,
    /// Torque of the motor \[N·m\].
    pub torque: f64,
}

#[derive(Clone, Debug)]
pub(crate) struct Model {
    voltage: f64,
    supply_resistance: f64,
    resistance: f64,
    constant: f64,
    current_limit: f64,
    /// `1/I_s`; zero without saturation.
    saturation: f64,
    /// Infinite without diodes.
    diode_voltage: f64,
    /// 1/C; zero without heating.
    heat_per_joule: f64,
    /// 1/T; zero without cooling.
    cooling: f64,
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
            voltage: parameters.supply.voltage,
            supply_resistance: parameters.supply.resistance,
            resistance: motor.resistance,
            constant,
            current_limit: motor.current_limit.unwrap_or(f64::INFINITY),
            saturation: motor
                .saturation_current
                .map_or(0.0, |current| 1.0 / current),
            diode_voltage: motor.diode_voltage.unwrap_or(f64::INFINITY),
            heat_per_joule: motor.heating.map_or(0.0, |heating| 1.0 / heating.capacity),
            cooling: motor
                .heating
                .and_then(|heating| heating.cooling)
                .map_or(0.0, |time| 1.0 / time),
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

    /// Returns voltage, current and torque at a rate of the motor \[rad/s\], with a rise of the
    /// temperature \[K\].
    pub(crate) fn electric(&self, bridge: Bridge, rate: f64, rise: f64) -> Electric {
        let winding = self.resistance * (1.0 + COPPER * rise);
        let Bridge::Duty(duty) = bridge else {
            let induced = self.constant * rate;
            let excess = induced.abs() - self.voltage - self.diode_voltage;
            if excess <= 0.0 {
                return Electric {
                    voltage: self.voltage,
                    ..Electric::default()
                };
            }
            let braking = excess / (winding + self.supply_resistance);
            let current = -braking.copysign(induced);
            return Electric {
                voltage: self.voltage + self.supply_resistance * braking,
                current,
                torque: self.torque(current),
            };
        };
        let unlimited = (duty * self.voltage - self.constant * rate)
            / (winding + self.supply_resistance * duty * duty);
        let current = unlimited.clamp(-self.current_limit, self.current_limit);
        Electric {
            voltage: self.voltage - self.supply_resistance * duty * current,
            current,
            torque: self.torque(current),
        }
    }

    /// Returns the torque of the motor at a current \[N·m\].
    fn torque(&self, current: f64) -> f64 {
        let linear = self.constant * current;
        if self.saturation == 0.0 {
            return linear;
        }
        linear / (1.0 + self.saturation * current.abs())
    }

    /// Returns the torque of gravity on the shaft \[N·m\].
    pub(crate) fn gravity(&self, angle: f64) -> f64 {
        -self.weight * sin(angle + self.offset)
    }

    /// Advances the temperature of the winding under a constant current, exactly.
    pub(crate) fn warm(&self, current: f64, state: &mut State, seconds: f64) {
        if self.heat_per_joule == 0.0 {
            return;
        }
        let winding = self.resistance * (1.0 + COPPER * state.rise);
        let heating = current * current * winding * self.heat_per_joule;
        if self.cooling == 0.0 {
            state.rise += seconds * heating;
        } else {
            let final_rise = heating / self.cooling;
            state.rise = final_rise + (state.rise - final_rise) * exp(-seconds * self.cooling);
        }
    }
}
