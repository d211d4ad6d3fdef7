use std::fmt;

use serde::{Deserialize, Serialize};

macro_rules! units {
    ($($(#[$doc:meta])* $name:ident = $symbol:literal,)*) => {
        /// Unit of a signal, a process variable or an expectation: coherent SI without prefixes.
        /// All numbers inside the program are in these units; millimetres and degrees occur in
        /// files and reports only.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[non_exhaustive]
        pub enum Unit {
            $($(#[$doc])* $name,)*
        }

        impl Unit {
            /// Every unit.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// Symbol of the unit, as shown in brackets after a name: `"N·m"`.
            pub const fn symbol(self) -> &'static str {
                match self {
                    $(Self::$name => $symbol,)*
                }
            }
        }
    };
}

units! {
    /// Dimensionless: number, ratio, count, flag.
    One = "1",
    /// Angle.
    Radian = "rad",
    /// Angular velocity.
    RadianPerSecond = "rad/s",
    /// Angular acceleration.
    RadianPerSecondSquared = "rad/s²",
    /// Angular velocity per force.
    RadianPerNewtonSecond = "rad/(N·s)",
    /// Length.
    Meter = "m",
    /// Velocity.
    MeterPerSecond = "m/s",
    /// Acceleration.
    MeterPerSecondSquared = "m/s²",
    /// Force.
    Newton = "N",
    /// Rate of a force.
    NewtonPerSecond = "N/s",
    /// Impulse.
    NewtonSecond = "N·s",
    /// Torque.
    NewtonMeter = "N·m",
    /// Linear stiffness.
    NewtonPerMeter = "N/m",
    /// Linear damping.
    NewtonSecondPerMeter = "N·s/m",
    /// Torsional stiffness.
    NewtonMeterPerRadian = "N·m/rad",
    /// Torsional damping.
    NewtonMeterSecondPerRadian = "N·m·s/rad",
    /// Energy.
    Joule = "J",
    /// Power.
    Watt = "W",
    /// Mass.
    Kilogram = "kg",
    /// Moment of inertia.
    KilogramSquareMeter = "kg·m²",
    /// Time.
    Second = "s",
    /// Frequency.
    Hertz = "Hz",
    /// Data rate.
    BitPerSecond = "bit/s",
    /// Voltage.
    Volt = "V",
    /// Current.
    Ampere = "A",
    /// Electrical resistance.
    Ohm = "Ω",
    /// Electrical conductance.
    Siemens = "S",
    /// Sensitivity of a piezoresistive cell.
    SiemensPerNewton = "S/N",
    /// Sensitivity of a charge amplifier to the rate of a force.
    VoltSecondPerNewton = "V·s/N",
    /// Torque constant of a motor.
    NewtonMeterPerAmpere = "N·m/A",
    /// Pressure.
    Pascal = "Pa",
    /// Temperature.
    Kelvin = "K",
    /// Heat capacity.
    JoulePerKelvin = "J/K",
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.symbol())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_symbols_are_unique() {
        for (n, unit) in Unit::ALL.iter().enumerate() {
            assert!(
                Unit::ALL[..n]
                    .iter()
                    .all(|other| other.symbol() != unit.symbol()),
                "{unit}"
            );
        }
    }
}
