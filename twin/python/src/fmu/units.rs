//! Units of variables as units of signals.

use twinrig::kernel::Unit;

use crate::fmu::description::DeclaredUnit;

/// Exponents of kg, m, s, A, K, mol, cd and rad.
type Exponents = [i32; 8];

/// Index of the radian, which many models leave out.
const RADIAN: usize = 7;

/// Conversion from a variable to a signal: value · factor + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    factor: f64,
    offset: f64,
}

impl Scale {
    /// Equal values.
    pub const ONE: Self = Self {
        factor: 1.0,
        offset: 0.0,
    };

    /// Returns the value of the signal. A scale of one keeps the bits of the value.
    pub fn to_signal(self, value: f64) -> f64 {
        if self == Self::ONE {
            return value;
        }
        value * self.factor + self.offset
    }

    /// Returns the value of the variable.
    pub fn to_variable(self, value: f64) -> f64 {
        if self == Self::ONE {
            return value;
        }
        (value - self.offset) / self.factor
    }
}

/// A contradiction between the unit of a variable and that of its signal.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contradiction {
    /// The declared unit.
    pub declared: String,
}

/// Returns the unit of the signal of a variable, with the conversion: `wanted`, if the scenario or
/// the name of the signal requires one, else that of the dimension. A quantity without a unit of
/// signals is a plain number in base units.
pub(super) fn unit_of(
    declared: Option<&DeclaredUnit>,
    wanted: Option<Unit>,
) -> Result<(Unit, Scale), Contradiction> {
    let Some(declared) = declared else {
        return Ok((wanted.unwrap_or(Unit::One), Scale::ONE));
    };
    let scale = Scale {
        factor: declared.factor,
        offset: declared.offset,
    };
    let named = Unit::ALL.iter().copied();
    let named = named.filter(|unit| ascii(unit.symbol()) == ascii(&declared.name));
    let mut candidates: Vec<Unit> = named.collect();
    if let Some(exponents) = declared.exponents {
        candidates.retain(|unit| self::exponents(*unit) == exponents);
        let same = Unit::ALL.iter().copied();
        let same = same.filter(|unit| self::exponents(*unit) == exponents);
        candidates.extend(same);
    }
    match wanted {
        None => Ok((candidates.first().copied().unwrap_or(Unit::One), scale)),
        Some(wanted) => {
            let fits = |exponents: &Exponents| {
                without_radian(self::exponents(wanted)) == without_radian(*exponents)
            };
            if candidates.contains(&wanted) || declared.exponents.as_ref().is_some_and(fits) {
                return Ok((wanted, scale));
            }
            let declared = declared.name.clone();
            Err(Contradiction { declared })
        }
    }
}

fn without_radian(mut exponents: Exponents) -> Exponents {
    exponents[RADIAN] = 0;
    exponents
}

/// Returns the usual ASCII spelling of a symbol.
fn ascii(symbol: &str) -> String {
    let kept = symbol.chars().filter(|c| !"·.*⋅^ ".contains(*c));
    let kept = kept.map(|c| if c == '²' { '2' } else { c });
    kept.collect::<String>().replace('Ω', "Ohm")
}

/// Returns the exponents of a unit.
fn exponents(unit: Unit) -> Exponents {
    let [kg, m, s, a, k, rad] = unit.base_exponents();
    [kg, m, s, a, k, 0, 0, rad]
}
