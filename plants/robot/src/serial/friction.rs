//! Friction of gear and bearings.

use twinrig_document::declaration::{Defaulted, quantity, record};
use twinrig_kernel::Unit;

use super::ranges::{self, zero};

record! {
    /// Friction by the torques of motor and load: the laws M1 to M6 of *Extended Friction Models
    /// for the Physics Simulation of Servo Actuators* (ICRA 2025), of which each is the one before
    /// with more parameters. With the torque τ_m of the motor and the torque τ_e of the load on the
    /// shaft, which have opposite signs where they balance (on a bench that of gravity, in a leg
    /// that of the leg with its inertia):
    ///
    /// ```text
    /// τ_f = K_v |ω| + K_c + |K_m τ_m − K_e τ_e| + Q_m τ_m² + Q_e τ_e²
    ///       + exp(−|ω/ω_s|^α) (K_cs + |K_ms τ_m − K_es τ_e|)
    /// ```
    ///
    /// M1 has K_v and K_c; M2 adds K_cs, ω_s and α; M3 has M1 and K_m = K_e; M4 both, and K_ms =
    /// K_es; M5 separate gains of motor and load; M6 the squares. A part whose parameters are zero
    /// is not computed.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Friction = "friction" {
        /// Viscous friction K_v \[N·m·s/rad\].
        pub viscous: f64 = quantity(Unit::NewtonMeterSecondPerRadian, ranges::DAMPING),
        /// Coulomb friction K_c \[N·m\].
        pub coulomb: f64 = quantity(Unit::NewtonMeter, ranges::TORQUE),
        /// Further friction at rest K_cs, of Stribeck \[N·m\].
        pub stribeck: f64 = zero(quantity(Unit::NewtonMeter, ranges::TORQUE)),
        /// Rate ω_s over which it vanishes \[rad/s\].
        pub stribeck_rate: f64 = Defaulted(RATE, 0.1, "0.1 rad/s"),
        /// Exponent α \[1\].
        pub stribeck_exponent: f64 = Defaulted(EXPONENT, 1.0, "1"),
        /// Share K_m of the motor's torque \[1\].
        pub motor_load: f64 = zero(quantity(Unit::One, ranges::SHARE)),
        /// Share K_e of the load's torque \[1\].
        pub external_load: f64 = zero(quantity(Unit::One, ranges::SHARE)),
        /// Further share K_ms of the motor's torque at rest \[1\].
        pub stribeck_motor_load: f64 = zero(quantity(Unit::One, ranges::SHARE)),
        /// Further share K_es of the load's torque at rest \[1\].
        pub stribeck_external_load: f64 = zero(quantity(Unit::One, ranges::SHARE)),
        /// Friction by the square of the motor's torque, Q_m \[1/(N·m)\].
        pub motor_load_square: f64 = zero(quantity(Unit::One, ranges::SQUARE)),
        /// Friction by the square of the load's torque, Q_e \[1/(N·m)\].
        pub external_load_square: f64 = zero(quantity(Unit::One, ranges::SQUARE)),
    }
}

record! {
    /// Backlash, and losses of the gear by the torque τ_t that it transmits to the arm, whose
    /// inertia is included: μ |τ_t|. μ depends on the direction of power: from the motor to the
    /// load (`driving`), or from the load to the motor (`driven`). At rest it is greater by the
    /// static share, which vanishes over a rate of its own: μ(ω) = μ + μ_s exp(−|ω|/ω_s). A driving
    /// gear loses a square κ τ_t² besides.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Gear = "gear" {
        /// Backlash: angle that the arm has free while the motor is held \[rad\].
        pub backlash: f64 = zero(quantity(Unit::Radian, ranges::BACKLASH)),
        /// Share while the motor drives the load \[1\].
        pub driving: f64 = zero(quantity(Unit::One, ranges::SHARE)),
        /// Share while the load drives the motor \[1\].
        pub driven: f64 = zero(quantity(Unit::One, ranges::DRIVEN_SHARE)),
        /// Further share at rest against driving \[1\].
        pub static_driving: f64 = zero(quantity(Unit::One, ranges::SHARE)),
        /// Further share while driving, per transmitted torque: κ \[1/(N·m)\].
        pub driving_square: f64 = zero(quantity(Unit::One, ranges::SQUARE)),
        /// Rate over which the static share vanishes while driving \[rad/s\].
        pub driving_rate: f64 = Defaulted(RATE, 0.1, "0.1 rad/s"),
        /// Further share at rest against being driven \[1\].
        pub static_driven: f64 = zero(quantity(Unit::One, ranges::DRIVEN_SHARE)),
        /// Rate over which the static share vanishes while driven \[rad/s\].
        pub driven_rate: f64 = Defaulted(RATE, 0.1, "0.1 rad/s"),
    }
}

const RATE: twinrig_document::declaration::Type<f64> =
    quantity(Unit::RadianPerSecond, ranges::RATE);
const EXPONENT: twinrig_document::declaration::Type<f64> = quantity(Unit::One, ranges::EXPONENT);

/// Greatest share that a driven gear loses: with all of it no torque of the load could move it.
const DRIVEN_SHARE_MAX: f64 = 0.95;

impl Friction {
    /// Returns the friction `τ_f` ≥ 0 \[N·m\] at a rate \[rad/s\] under the torques of motor and
    /// load \[N·m\].
    #[inline]
    pub fn torque(&self, rate: f64, motor: f64, external: f64) -> f64 {
        let speed = rate.abs();
        let mut torque = self.coulomb + self.viscous * speed;
        if self.motor_load != 0.0 || self.external_load != 0.0 {
            torque += (self.motor_load * motor - self.external_load * external).abs();
        }
        if self.motor_load_square != 0.0 || self.external_load_square != 0.0 {
            torque += self.motor_load_square * motor * motor
                + self.external_load_square * external * external;
        }
        let by_load = self.stribeck_motor_load != 0.0 || self.stribeck_external_load != 0.0;
        if self.stribeck != 0.0 || by_load {
            let load = self.stribeck_motor_load * motor - self.stribeck_external_load * external;
            torque += self.stribeck_factor(speed) * (self.stribeck + load.abs());
        }
        torque
    }

    fn stribeck_factor(&self, speed: f64) -> f64 {
        let ratio = speed / self.stribeck_rate;
        let power = if self.stribeck_exponent == 1.0 {
            ratio
        } else {
            libm::pow(ratio, self.stribeck_exponent)
        };
        libm::exp(-power)
    }
}

impl Gear {
    /// No backlash and no losses.
    pub const IDEAL: Self = Self {
        backlash: 0.0,
        driving: 0.0,
        driven: 0.0,
        static_driving: 0.0,
        driving_square: 0.0,
        driving_rate: 0.1,
        static_driven: 0.0,
        driven_rate: 0.1,
    };

    /// Whether there are losses.
    pub fn is_lossy(&self) -> bool {
        [
            self.driving,
            self.driven,
            self.static_driving,
            self.driving_square,
            self.static_driven,
        ] != [0.0; 5]
    }

    /// Returns the share μ that is lost at a rate \[rad/s\] while the motor drives the load \[1\].
    #[inline]
    pub fn driving_share(&self, rate: f64) -> f64 {
        self.driving + further(self.static_driving, rate, self.driving_rate)
    }

    /// Returns the share μ that is lost at a rate \[rad/s\] while the load drives the motor \[1\].
    #[inline]
    pub fn driven_share(&self, rate: f64) -> f64 {
        let share = self.driven + further(self.static_driven, rate, self.driven_rate);
        share.min(DRIVEN_SHARE_MAX)
    }
}

/// Returns what is left at a rate of a share at rest.
#[inline]
fn further(share: f64, rate: f64, over: f64) -> f64 {
    if share == 0.0 {
        0.0
    } else {
        share * libm::exp(-rate.abs() / over)
    }
}
