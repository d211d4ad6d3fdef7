//! Currents and torques of the motor of a servo.

use libm::exp;
use twinrig_robot::serial::{ServoMotor, Supply};

use super::Bridge;

/// Temperature coefficient of the resistance of copper at 20 °C \[1/K\].
const COPPER: f64 = 3.93e-3;

/// Motor at a supply; torques and rates refer to the output of the gear.
#[derive(Clone, Copy, Debug)]
pub struct Winding {
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
}

/// Electrical state at an instant.
#[derive(Clone, Copy, Debug, Default)]
pub struct Electric {
    /// Voltage of the supply behind its resistance \[V\].
    pub voltage: f64,
    /// Current of the motor \[A\].
    pub current: f64,
    /// Torque of the motor \[N·m\].
    pub torque: f64,
}

impl Winding {
    /// Creates the winding of a motor.
    pub fn new(motor: &ServoMotor, supply: &Supply) -> Self {
        Self {
            voltage: supply.voltage,
            supply_resistance: supply.resistance,
            resistance: motor.resistance,
            constant: motor.torque_constant,
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
        }
    }

    /// Returns voltage, current and torque at a rate \[rad/s\], with a rise of the temperature
    /// \[K\].
    #[inline]
    pub fn electric(&self, bridge: Bridge, rate: f64, rise: f64) -> Electric {
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

    /// Returns the decrease of the torque with the rate at a current below its limit, with the
    /// bridge closed \[N·m·s/rad\]; zero at the limit.
    pub(crate) fn damping(&self, duty: f64, current: f64, rise: f64) -> f64 {
        if current.abs() >= self.current_limit {
            return 0.0;
        }
        let winding = self.resistance * (1.0 + COPPER * rise);
        let saturated = 1.0 + self.saturation * current.abs();
        let slope = self.constant / (saturated * saturated);
        slope * self.constant / (winding + self.supply_resistance * duty * duty)
    }

    /// Returns the rise of the temperature of the winding \[K\] after some seconds of a constant
    /// current, from the rise before, exactly.
    #[inline]
    pub fn warmed(&self, rise: f64, current: f64, seconds: f64) -> f64 {
        if self.heat_per_joule == 0.0 {
            return rise;
        }
        let winding = self.resistance * (1.0 + COPPER * rise);
        let heating = current * current * winding * self.heat_per_joule;
        if self.cooling == 0.0 {
            return rise + seconds * heating;
        }
        let final_rise = heating / self.cooling;
        final_rise + (rise - final_rise) * exp(-seconds * self.cooling)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_robot::RobotFile;

    use super::*;

    proptest! {
        /// Of the torque, but where the current is at its limit within the difference.
        #[test]
        fn damping_is_minus_the_derivative_of_the_torque(
            duty in -1.0..1.0_f64, rate in -6.0..6.0_f64, rise in 0.0..100.0_f64,
            limit in 0.2..3.0_f64, resistance in 0.0..2.0_f64,
        ) {
            let cub = RobotFile::find("cheetah-cub-sts3215", "/".as_ref()).unwrap();
            let mut servo = cub.robot().unwrap().serial.unwrap();
            servo.motor.current_limit = Some(limit);
            servo.motor.saturation_current = Some(2.0);
            servo.supply.resistance = resistance;
            let winding = Winding::new(&servo.motor, &servo.supply);
            let at = |rate| winding.electric(Bridge::Duty(duty), rate, rise);
            let step = 1e-4;
            let [before, here, after] = [rate - step, rate, rate + step].map(at);
            let is_at = |it: &Electric| it.current.abs() >= limit;
            prop_assume!(is_at(&before) == is_at(&after));
            prop_assume!(before.current * after.current > 0.0);
            let difference = (before.torque - after.torque) / (2.0 * step);
            let damping = winding.damping(duty, here.current, rise);
            prop_assert!((damping - difference).abs() < 1e-6, "{damping} {difference}");
        }
    }
}
