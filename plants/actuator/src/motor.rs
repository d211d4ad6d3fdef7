//! Direct-current motors: torque as a function of voltage and rate.

use twinrig_robot::Motor;

/// Direct-current motor behind a gear; all quantities refer to the output of the gear.
///
/// With the resistance R, the torque constant k, the gear ratio N, the rotor's inertia J and the
/// output rate ω:
///
/// ```text
/// τ = kN (V − kNω)/R        inertia J N²        damping (kN)²/R        time constant J R/k²
/// ```
///
/// ASSUMED: lossless gear and frictionless rotor. This is accurate for the motors of Oncilla: 24 V
/// over 14.05 mN·m/A is 16 312 rpm, and the data sheet has 16 320 rpm without load. The winding's
/// inductance is neglected: it delays the current by L/R, 84 µs for these motors, where the rate
/// follows within 1.66 ms. Current limits and heating are not modelled.
///
/// The *bridge* is the duty cycle of the winding's connection: 1 where the voltage is applied
/// (which brakes at zero volts), 0 where the winding is open and the motor coasts; values between
/// are shares of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DcMotor {
    /// kN/R: torque at standstill for a voltage \[N·m/V\].
    torque_per_volt: f64,
    /// (kN)²/R \[N·m·s/rad\].
    damping: f64,
    /// J N² \[kg·m²\].
    inertia: f64,
    /// Supply voltage \[V\].
    supply: f64,
}

/// Motor of a leg by its two inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegMotor {
    /// Inputs are voltage \[V\] and bridge.
    Voltage(DcMotor),
    /// Inputs are torque at standstill \[N·m\] and damping \[N·m·s/rad\]: a [`MotorLine`] that
    /// was made elsewhere.
    Line {
        /// Inertia at the output \[kg·m²\].
        inertia: f64,
    },
}

impl LegMotor {
    /// Returns the torque-rate line under the inputs.
    pub fn line(&self, first: f64, second: f64) -> MotorLine {
        match self {
            Self::Voltage(motor) => motor.line(first, second),
            Self::Line { .. } => MotorLine {
                torque: first,
                damping: second,
            },
        }
    }

    /// Inertia at the output \[kg·m²\].
    pub fn inertia(&self) -> f64 {
        match self {
            Self::Voltage(motor) => motor.inertia(),
            Self::Line { inertia } => *inertia,
        }
    }
}

/// Torque at constant voltage as a function of the rate: torque − damping · rate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotorLine {
    /// Torque at standstill \[N·m\].
    pub torque: f64,
    /// Decrease of the torque with the rate \[N·m·s/rad\].
    pub damping: f64,
}

/// Invalid parameter of a motor.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("a motor's {parameter} cannot be {value}: {why}")]
pub struct MotorError {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// Its value (SI).
    pub value: f64,
    /// Violated condition.
    pub why: &'static str,
}

impl DcMotor {
    /// Creates the motor of a robot file.
    ///
    /// # Errors
    /// [`MotorError`] where a parameter is not positive and finite.
    pub fn new(motor: &Motor) -> Result<Self, MotorError> {
        let Motor {
            resistance,
            torque_constant,
            gear,
            inertia,
            voltage,
        } = *motor;
        for (parameter, value) in [
            ("resistance", resistance),
            ("torque_constant", torque_constant),
            ("gear", gear),
            ("inertia", inertia),
            ("voltage", voltage),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(MotorError {
                    parameter,
                    value,
                    why: "it has to be positive",
                });
            }
        }
        let constant = torque_constant * gear;
        Ok(Self {
            torque_per_volt: constant / resistance,
            damping: constant * constant / resistance,
            inertia: inertia * gear * gear,
            supply: voltage,
        })
    }

    /// Returns the torque-rate line at a voltage \[V\], which is limited by the supply, and a
    /// bridge that is closed for this share of the time, 0 … 1.
    pub fn line(&self, voltage: f64, bridge: f64) -> MotorLine {
        let bridge = bridge.clamp(0.0, 1.0);
        let voltage = voltage.clamp(-self.supply, self.supply);
        MotorLine {
            torque: bridge * self.torque_per_volt * voltage,
            damping: bridge * self.damping,
        }
    }

    /// Torque at the output \[N·m\] under a voltage \[V\] at a rate \[rad/s\]; see
    /// [`DcMotor::line`].
    pub fn torque(&self, voltage: f64, bridge: f64, rate: f64) -> f64 {
        self.line(voltage, bridge).torque_at(rate)
    }

    /// Inertia at the output \[kg·m²\].
    pub fn inertia(&self) -> f64 {
        self.inertia
    }

    /// Damping at the output, bridge closed \[N·m·s/rad\].
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Time constant of the rate without load \[s\].
    pub fn time_constant(&self) -> f64 {
        self.inertia / self.damping
    }

    /// Voltage of the supply \[V\].
    pub fn supply(&self) -> f64 {
        self.supply
    }

    /// Torque at standstill under the full supply voltage \[N·m\].
    pub fn stall_torque(&self) -> f64 {
        self.torque_per_volt * self.supply
    }

    /// Rate without load under the full supply voltage \[rad/s\].
    pub fn no_load_rate(&self) -> f64 {
        self.stall_torque() / self.damping
    }
}

impl MotorLine {
    /// Torque at a rate \[rad/s\], \[N·m\].
    pub fn torque_at(&self, rate: f64) -> f64 {
        self.torque - self.damping * rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The motor of Oncilla's joints, without its gear.
    const ROTOR: Motor = Motor {
        resistance: 0.593,
        torque_constant: 14.05e-3,
        gear: 1.0,
        inertia: 5.54e-7,
        voltage: 24.0,
    };

    fn geared(gear: f64) -> DcMotor {
        DcMotor::new(&Motor { gear, ..ROTOR }).unwrap()
    }

    #[test]
    fn motor_matches_the_data_sheet() {
        let motor = geared(1.0);
        let rpm = motor.no_load_rate() * 30.0 / core::f64::consts::PI;
        assert!((rpm - 16_320.0).abs() < 10.0, "{rpm}");
        assert!((motor.stall_torque() - 0.569).abs() < 5e-4);
        assert!((motor.time_constant() - 1.66e-3).abs() < 1e-5);
    }

    #[test]
    fn gear_scales_rate_and_torque_and_keeps_the_time_constant() {
        let (one, geared) = (geared(1.0), geared(14.0));
        assert!((geared.stall_torque() / one.stall_torque() - 14.0).abs() < 1e-12);
        assert!((one.no_load_rate() / geared.no_load_rate() - 14.0).abs() < 1e-12);
        assert!((geared.inertia() / one.inertia() - 196.0).abs() < 1e-12);
        assert!((geared.time_constant() / one.time_constant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn step_response_is_the_exponential_of_its_time_constant() {
        let motor = geared(14.0);
        let (h, mut rate) = (1e-7, 0.0);
        for step in 1..=30_000 {
            let half = rate + 0.5 * h * motor.torque(12.0, 1.0, rate) / motor.inertia();
            rate += h * motor.torque(12.0, 1.0, half) / motor.inertia();
            let time = h * f64::from(step);
            let exact = 0.5 * motor.no_load_rate() * -libm::expm1(-time / motor.time_constant());
            assert!((rate - exact).abs() < 1e-6 * motor.no_load_rate(), "{time}");
        }
    }

    #[test]
    fn open_bridge_coasts_and_closed_bridge_at_zero_volts_brakes() {
        let motor = geared(14.0);
        assert_eq!(motor.torque(24.0, 0.0, 50.0), 0.0);
        assert_eq!(motor.torque(0.0, 1.0, 50.0), -50.0 * motor.damping());
        assert_eq!(motor.torque(0.0, 1.0, 0.0), 0.0);
    }

    #[test]
    fn voltage_is_limited_by_the_supply_and_bridge_by_one() {
        let motor = geared(14.0);
        assert_eq!(motor.torque(100.0, 1.0, 0.0), motor.stall_torque());
        assert_eq!(motor.torque(-100.0, 2.0, 0.0), -motor.stall_torque());
        assert_eq!(motor.torque(24.0, -1.0, 0.0), 0.0);
    }

    #[test]
    fn invalid_motors_are_rejected_with_the_parameters_name() {
        let with = |change: fn(&mut Motor)| {
            let mut motor = ROTOR;
            change(&mut motor);
            DcMotor::new(&motor).unwrap_err().parameter
        };
        assert_eq!(with(|motor| motor.resistance = 0.0), "resistance");
        assert_eq!(with(|motor| motor.gear = -14.0), "gear");
        assert_eq!(with(|motor| motor.inertia = f64::NAN), "inertia");
        assert_eq!(with(|motor| motor.voltage = f64::INFINITY), "voltage");
    }
}
