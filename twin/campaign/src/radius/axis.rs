//! Axes: keys of a scenario and the values that they take as a disturbance grows.

use twinrig_kernel::Unit;

use crate::sweep::{SweepValue, rounded};

/// Sizes of the grid above 0.
const GRID: u32 = 9;
/// Shares of the precision that sizes are rounded to.
const ROUNDED_TO: f64 = 0.1;

/// Values of an axis, from the one without a disturbance to the limit, which may be below it. The
/// size of a disturbance is the distance from the former.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisValues {
    /// Value without a disturbance.
    pub nominal: f64,
    /// Value of the greatest disturbance.
    pub limit: f64,
    /// Their unit.
    pub unit: Unit,
    /// Sizes that are tested first.
    pub grid: AxisGrid,
}

/// Sizes that are tested first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisGrid {
    /// At equal distances.
    Linear,
    /// Each twice the one before.
    Geometric,
}

/// A disturbance that grows.
#[derive(Clone, Debug, PartialEq)]
pub struct DisturbanceAxis {
    /// Name.
    pub name: String,
    /// Meaning of its value.
    pub about: String,
    /// Its values.
    pub values: AxisValues,
    /// Keys that it sets.
    pub keys: Vec<KeyChange>,
}

/// A key and its values.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyChange {
    /// Dotted key of the scenario.
    pub key: String,
    /// Its value as a function of that of the axis.
    pub rule: KeyRule,
}

/// Value of a key as a function of that of the axis.
#[derive(Clone, Debug, PartialEq)]
pub enum KeyRule {
    /// The same.
    Equal,
    /// The value of the axis is added to this one, of the same unit.
    Added(f64),
    /// The value of the axis, a number, multiplies this one.
    Times(f64, Unit),
    /// TOML with the value of the axis in place of `{}`.
    Within(String),
}

impl AxisValues {
    /// Returns the size of the limit.
    pub fn greatest(&self) -> f64 {
        (self.limit - self.nominal).abs()
    }

    /// Returns the value of a disturbance of this size.
    pub fn value(&self, size: f64) -> f64 {
        if size >= self.greatest() {
            return self.limit;
        }
        let value = self.nominal + size.copysign(self.limit - self.nominal);
        // Sizes have few digits, and so have their values if the unperturbed one has.
        rounded(value, size * 1e-9)
    }

    /// Returns the sizes of the grid, 0 first and the limit last.
    pub(super) fn sizes(&self, precision: f64) -> Vec<f64> {
        let greatest = self.greatest();
        let share = |step: u32| match self.grid {
            AxisGrid::Linear => f64::from(step) / f64::from(GRID),
            AxisGrid::Geometric => 1.0 / f64::from(1_u32 << (GRID - step)),
        };
        let inner = (1..GRID).map(|step| legible(greatest * share(step), precision));
        std::iter::once(0.0)
            .chain(inner)
            .chain(std::iter::once(greatest))
            .collect()
    }
}

/// Rounds a size to a part of the precision, so that commands are legible.
pub(super) fn legible(size: f64, precision: f64) -> f64 {
    rounded(size, size * precision * ROUNDED_TO)
}

impl DisturbanceAxis {
    /// Returns keys and values, in TOML, of a disturbance of this size; none of size 0.
    pub fn settings(&self, size: f64) -> Vec<(String, String)> {
        if size == 0.0 {
            return Vec::new();
        }
        let value = self.values.value(size);
        let unit = self.values.unit;
        let toml = |value: f64, unit: Unit| SweepValue::quantity(value, unit).toml;
        let setting = |change: &KeyChange| {
            let value = match &change.rule {
                KeyRule::Equal => toml(value, unit),
                KeyRule::Added(base) => toml(rounded(base + value, size * 1e-9), unit),
                KeyRule::Times(base, unit) => {
                    toml(rounded(base * value, (base * size).abs() * 1e-9), *unit)
                }
                KeyRule::Within(text) => text.replace("{}", &toml(value, unit)),
            };
            (change.key.clone(), value)
        };
        self.keys.iter().map(setting).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(nominal: f64, limit: f64, unit: Unit, rule: KeyRule) -> DisturbanceAxis {
        DisturbanceAxis {
            name: "any".to_owned(),
            about: String::new(),
            values: AxisValues {
                nominal,
                limit,
                unit,
                grid: AxisGrid::Linear,
            },
            keys: vec![KeyChange {
                key: "key".to_owned(),
                rule,
            }],
        }
    }

    /// Commands have the digits that the precision takes, and no round-off.
    #[test]
    fn settings_are_legible() {
        let one = |axis: &DisturbanceAxis, size| axis.settings(size).remove(0).1;
        let friction = axis(0.6, 0.0, Unit::One, KeyRule::Equal);
        assert_eq!(one(&friction, 0.333), "0.267");
        assert_eq!(one(&friction, 0.6), "0");
        let clock = axis(0.0, 0.01, Unit::One, KeyRule::Added(-737e-6));
        assert_eq!(one(&clock, 0.0002), "-0.000537");
        let jitter = axis(
            0.0,
            0.02,
            Unit::Second,
            KeyRule::Within("[{}, {}]".to_owned()),
        );
        assert_eq!(one(&jitter, 0.00305), r#"["0.00305 s", "0.00305 s"]"#);
        let stiffness = KeyRule::Times(4400.0, Unit::NewtonPerMeter);
        let stiffness = axis(1.0, 0.0, Unit::One, stiffness);
        assert_eq!(one(&stiffness, 0.25), r#""3300 N/m""#);
        assert!(stiffness.settings(0.0).is_empty());
    }

    #[test]
    fn grids_begin_at_the_scenario_and_end_at_the_limit() {
        for grid in [AxisGrid::Linear, AxisGrid::Geometric] {
            let values = AxisValues {
                nominal: 0.6,
                limit: 1.8,
                unit: Unit::One,
                grid,
            };
            let sizes = values.sizes(0.01);
            assert!(sizes.is_sorted_by(|one, next| one < next), "{sizes:?}");
            assert_eq!((sizes[0], values.value(sizes[9])), (0.0, 1.8));
            assert_eq!(sizes.len(), 10);
        }
    }
}
