//! Spellings of units.

use twinrig_kernel::Unit;

/// Conversion from a spelled unit to the SI unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Scale {
    /// Power of ten, applied to the decimal digits: `12.6 cm` is exactly `0.126`.
    Ten(i32),
    /// Other factor: radians per degree, seconds per minute.
    Factor(f64),
}

use Scale::{Factor, Ten};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const TURN_PER_MINUTE: f64 = std::f64::consts::PI / 30.0;

/// A physical quantity: its unit, name and spellings, the commonest first.
pub(crate) struct Kind {
    pub unit: Unit,
    pub name: &'static str,
    pub spellings: &'static [(&'static str, Scale)],
}

/// All quantities that may occur in a document.
pub(crate) const KINDS: &[Kind] = &[
    Kind {
        unit: Unit::One,
        name: "a plain number",
        spellings: &[("", Ten(0)), ("%", Ten(-2)), ("ppm", Ten(-6))],
    },
    Kind {
        unit: Unit::Radian,
        name: "an angle",
        spellings: &[("deg", Factor(DEGREE)), ("rad", Ten(0)), ("mrad", Ten(-3))],
    },
    Kind {
        unit: Unit::RadianPerSecond,
        name: "an angular velocity",
        spellings: &[
            ("rad/s", Ten(0)),
            ("deg/s", Factor(DEGREE)),
            ("rpm", Factor(TURN_PER_MINUTE)),
        ],
    },
    Kind {
        unit: Unit::Meter,
        name: "a length",
        spellings: &[
            ("m", Ten(0)),
            ("cm", Ten(-2)),
            ("mm", Ten(-3)),
            ("um", Ten(-6)),
            ("km", Ten(3)),
        ],
    },
    Kind {
        unit: Unit::MeterPerSecond,
        name: "a speed",
        spellings: &[
            ("m/s", Ten(0)),
            ("cm/s", Ten(-2)),
            ("mm/s", Ten(-3)),
            ("km/h", Factor(1.0 / 3.6)),
        ],
    },
    Kind {
        unit: Unit::RadianPerSecondSquared,
        name: "an angular acceleration",
        spellings: &[("rad/s²", Ten(0)), ("deg/s²", Factor(DEGREE))],
    },
    Kind {
        unit: Unit::RadianPerNewtonSecond,
        name: "an angular velocity per force",
        spellings: &[("rad/(N·s)", Ten(0)), ("rad/(s·N)", Ten(0))],
    },
    Kind {
        unit: Unit::MeterPerSecondSquared,
        name: "an acceleration",
        spellings: &[("m/s²", Ten(0)), ("mm/s²", Ten(-3))],
    },
    Kind {
        unit: Unit::Newton,
        name: "a force",
        spellings: &[("N", Ten(0)), ("mN", Ten(-3)), ("kN", Ten(3))],
    },
    Kind {
        unit: Unit::NewtonPerSecond,
        name: "a rate of force",
        spellings: &[("N/s", Ten(0)), ("kN/s", Ten(3))],
    },
    Kind {
        unit: Unit::NewtonSecond,
        name: "an impulse",
        spellings: &[("N·s", Ten(0)), ("mN·s", Ten(-3))],
    },
    Kind {
        unit: Unit::NewtonMeter,
        name: "a torque",
        spellings: &[("N·m", Ten(0)), ("mN·m", Ten(-3)), ("N·mm", Ten(-3))],
    },
    Kind {
        unit: Unit::NewtonPerMeter,
        name: "a stiffness",
        spellings: &[("N/m", Ten(0)), ("N/mm", Ten(3)), ("kN/m", Ten(3))],
    },
    Kind {
        unit: Unit::NewtonMeterPerRadian,
        name: "a torsional stiffness",
        spellings: &[("N·m/rad", Ten(0)), ("mN·m/rad", Ten(-3))],
    },
    Kind {
        unit: Unit::NewtonMeterSecondPerRadian,
        name: "a joint friction",
        spellings: &[("N·m·s/rad", Ten(0)), ("mN·m·s/rad", Ten(-3))],
    },
    Kind {
        unit: Unit::NewtonSecondPerMeter,
        name: "a damping",
        spellings: &[("N·s/m", Ten(0))],
    },
    Kind {
        unit: Unit::Joule,
        name: "an energy",
        spellings: &[("J", Ten(0)), ("mJ", Ten(-3)), ("kJ", Ten(3))],
    },
    Kind {
        unit: Unit::Watt,
        name: "a power",
        spellings: &[("W", Ten(0)), ("mW", Ten(-3)), ("kW", Ten(3))],
    },
    Kind {
        unit: Unit::Kilogram,
        name: "a mass",
        spellings: &[("kg", Ten(0)), ("g", Ten(-3)), ("mg", Ten(-6))],
    },
    Kind {
        unit: Unit::KilogramSquareMeter,
        name: "a moment of inertia",
        spellings: &[
            ("kg·m²", Ten(0)),
            ("g·cm²", Ten(-7)),
            ("kg·cm²", Ten(-4)),
            ("kg·mm²", Ten(-6)),
            ("g·mm²", Ten(-9)),
        ],
    },
    Kind {
        unit: Unit::Second,
        name: "a duration",
        spellings: &[
            ("s", Ten(0)),
            ("ms", Ten(-3)),
            ("us", Ten(-6)),
            ("ns", Ten(-9)),
            ("min", Factor(60.0)),
        ],
    },
    Kind {
        unit: Unit::Hertz,
        name: "a frequency",
        spellings: &[("Hz", Ten(0)), ("kHz", Ten(3)), ("MHz", Ten(6))],
    },
    Kind {
        unit: Unit::BitPerSecond,
        name: "a bit rate",
        spellings: &[("bit/s", Ten(0)), ("kbit/s", Ten(3)), ("Mbit/s", Ten(6))],
    },
    Kind {
        unit: Unit::Volt,
        name: "a voltage",
        spellings: &[("V", Ten(0)), ("mV", Ten(-3))],
    },
    Kind {
        unit: Unit::Ampere,
        name: "a current",
        spellings: &[("A", Ten(0)), ("mA", Ten(-3))],
    },
    Kind {
        unit: Unit::Ohm,
        name: "a resistance",
        spellings: &[
            ("Ω", Ten(0)),
            ("ohm", Ten(0)),
            ("kohm", Ten(3)),
            ("kΩ", Ten(3)),
        ],
    },
    Kind {
        unit: Unit::Siemens,
        name: "a conductance",
        spellings: &[("S", Ten(0)), ("mS", Ten(-3)), ("uS", Ten(-6))],
    },
    Kind {
        unit: Unit::SiemensPerNewton,
        name: "a sensitivity of conductance",
        spellings: &[("S/N", Ten(0)), ("uS/N", Ten(-6))],
    },
    Kind {
        unit: Unit::VoltSecondPerNewton,
        name: "a sensitivity to the rate of a force",
        spellings: &[("V·s/N", Ten(0)), ("mV·s/N", Ten(-3))],
    },
    Kind {
        unit: Unit::NewtonMeterPerAmpere,
        name: "a torque constant",
        spellings: &[("N·m/A", Ten(0)), ("mN·m/A", Ten(-3))],
    },
    Kind {
        unit: Unit::Pascal,
        name: "a pressure",
        spellings: &[("Pa", Ten(0)), ("kPa", Ten(3))],
    },
    Kind {
        unit: Unit::Kelvin,
        name: "a temperature",
        spellings: &[("K", Ten(0))],
    },
    Kind {
        unit: Unit::JoulePerKelvin,
        name: "a heat capacity",
        spellings: &[("J/K", Ten(0)), ("mJ/K", Ten(-3))],
    },
];

/// Returns the value in SI units of a number with a unit of data sheets that is no multiple of one
/// of ours: the torque of a weight on an arm, the time of a servo for 60°.
pub(crate) fn of_data_sheet(unit: Unit, spelling: &str, number: f64) -> Option<f64> {
    let spelling = spelling.replace([' ', '·', '*', '-'], "").to_lowercase();
    match (unit, spelling.as_str()) {
        (Unit::NewtonMeter, "kgcm" | "kgfcm") => Some(number * 0.01 * GRAVITY),
        (Unit::NewtonMeter, "ozin" | "ozfin") => Some(number * OUNCE * INCH * GRAVITY),
        (Unit::RadianPerSecond, "s/60°" | "sec/60°" | "s/60deg" | "sec/60deg") => {
            Some(60.0 * DEGREE / number)
        }
        _ => None,
    }
}

/// Standard acceleration of gravity \[m/s²\], avoirdupois ounce \[kg\], inch \[m\].
const GRAVITY: f64 = 9.806_65;
const OUNCE: f64 = 0.028_349_523_125;
const INCH: f64 = 0.025_4;

/// Returns the quantity of `unit`; `None` for a unit that cannot occur in a document.
pub(crate) fn kind(unit: Unit) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.unit == unit)
}

/// Returns the quantity to which `spelling` belongs.
pub(crate) fn kind_of_spelling(spelling: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| scale(kind, spelling).is_some())
}

/// Returns the scale of `spelling` within `kind`.
pub(crate) fn scale(kind: &Kind, spelling: &str) -> Option<Scale> {
    let mut spellings = kind.spellings.iter();
    let same = spellings.clone().find(|(known, _)| *known == spelling);
    let found = same.or_else(|| {
        let spelling = normal(spelling);
        spellings.find(|(known, _)| normal(known) == spelling)
    });
    found.map(|(_, scale)| *scale)
}

/// Normalises a spelling: `kg·m²`, `kg*m^2`, `kg m2`; `µs` and `us`; `°` and `deg`.
fn normal(spelling: &str) -> String {
    let mut out = String::with_capacity(spelling.len());
    for c in spelling.trim().chars() {
        match c {
            '*' | '·' | '⋅' | ' ' => {
                if !out.ends_with('.') {
                    out.push('.');
                }
            }
            '²' => out.push('2'),
            '^' => {}
            'µ' | 'μ' => out.push('u'),
            // The ohm sign of older character sets.
            '\u{2126}' => out.push('Ω'),
            '°' => out.push_str("deg"),
            c => out.push(c),
        }
    }
    out.replace("./", "/").replace("/.", "/")
}
