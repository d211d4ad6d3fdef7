//! Declaration of an item of the thesis: a figure, a table or a section with its printed figures.

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::number::number;
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

/// Figure, table or section of the thesis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    /// Identifier on the command line: `fig-2-9`.
    pub id: &'static str,
    /// Title.
    pub title: &'static str,
    /// Place in the thesis.
    pub place: &'static str,
    /// Approximate run time in release on one processor \[s\]; above [`LONG_S`] the item is run by
    /// name or with `--all` only.
    pub run_s: f64,
    /// Printed figures.
    pub figures: &'static [PrintedFigure],
    /// Origins of ours.
    pub sources: &'static [Source],
    /// Determines ours.
    pub measure: fn(&Context<'_>) -> Result<Measurements, TwinError>,
    /// Commands that show more.
    pub commands: &'static [&'static str],
}

/// Run time above which an item is long \[s\].
pub(crate) const LONG_S: f64 = 60.0;

impl Item {
    /// Returns whether the item is run by name or with `--all` only.
    pub(crate) fn is_long(&self) -> bool {
        self.run_s > LONG_S
    }

    /// Returns the origin of the measurement with a key; none without one in a figure that is
    /// declared not run.
    pub(crate) fn source(&self, key: &str) -> Option<&'static Source> {
        let mut named = self.sources.iter();
        let named = named.find(|source| source.keys.contains(&key));
        named.or_else(|| self.sources.iter().find(|source| source.keys.is_empty()))
    }
}

/// Origin of measurements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    /// Keys of the measurements; none for all that no other source names.
    pub keys: &'static [&'static str],
    /// Meaning of their agreement.
    pub basis: Basis,
    /// Their inputs, and what was free to differ.
    pub inputs: &'static [Input],
}

impl Source {
    /// Origin of the measurements with these keys.
    pub(crate) const fn of(
        keys: &'static [&'static str],
        basis: Basis,
        inputs: &'static [Input],
    ) -> Self {
        Self {
            keys,
            basis,
            inputs,
        }
    }

    /// Origin of all measurements that no other source names.
    pub(crate) const fn rest(basis: Basis, inputs: &'static [Input]) -> Self {
        Self::of(&[], basis, inputs)
    }
}

/// A printed value or statement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Printed {
    /// Value, in the unit of the figure.
    Value(f64),
    /// Statement without a number, in words of ours.
    Statement(&'static str),
}

/// Printed figure with the rule of its verdict.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrintedFigure {
    /// Key of the measurement that it is compared with; several figures may have one in common.
    pub key: &'static str,
    /// Quantity.
    pub quantity: &'static str,
    /// Section, figure or table in which it is printed.
    pub place: &'static str,
    /// As printed.
    pub printed: Printed,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// Rule of the verdict.
    pub rule: Rule,
    /// Reason for the tolerance.
    pub tolerance: &'static str,
    /// Evidence, reason of a difference, or what ours assumes; may be empty.
    pub remark: &'static str,
    /// Whether ours is a run time, which depends on the machine.
    pub is_timing: bool,
}

impl PrintedFigure {
    /// A printed value in `unit`.
    pub(crate) const fn value(
        key: &'static str,
        quantity: &'static str,
        place: &'static str,
        value: f64,
        unit: &'static str,
    ) -> Self {
        Self {
            key,
            quantity,
            place,
            printed: Printed::Value(value),
            unit,
            rule: Rule::NotRun,
            tolerance: "",
            remark: "",
            is_timing: false,
        }
    }

    /// A statement; ours is in `unit`.
    pub(crate) const fn statement(
        key: &'static str,
        quantity: &'static str,
        place: &'static str,
        statement: &'static str,
        unit: &'static str,
    ) -> Self {
        Self {
            printed: Printed::Statement(statement),
            ..Self::value(key, quantity, place, 0.0, unit)
        }
    }

    /// Sets the rule of the verdict and the reason for its tolerance.
    pub(crate) const fn rule(self, rule: Rule, tolerance: &'static str) -> Self {
        Self {
            rule,
            tolerance,
            ..self
        }
    }

    /// Sets evidence, or the reason for which the figure was not run.
    pub(crate) const fn remark(self, remark: &'static str) -> Self {
        Self { remark, ..self }
    }

    /// Marks a run time.
    pub(crate) const fn timing(self) -> Self {
        Self {
            is_timing: true,
            ..self
        }
    }

    /// Returns the printed value, if there is one.
    pub(crate) fn printed_value(&self) -> Option<f64> {
        match self.printed {
            Printed::Value(value) => Some(value),
            Printed::Statement(_) => None,
        }
    }

    /// Returns the rule for readers: `within 1 %: the printed digits`.
    pub(crate) fn rule_text(&self) -> String {
        let with_unit = |value: f64| match self.unit {
            "" => number(value),
            unit => format!("{} {unit}", number(value)),
        };
        let rule = match self.rule {
            Rule::Within(0.0) => "exactly".to_owned(),
            Rule::Within(share) => format!("within {} %", number(100.0 * share)),
            Rule::Factor(factor) => format!("within a factor of {}", number(factor)),
            Rule::AtLeast(least) => format!("≥ {}", with_unit(least)),
            Rule::AtMost(most) => format!("≤ {}", with_unit(most)),
            Rule::Between(least, most) => {
                format!("{} to {}", number(least), with_unit(most))
            }
            Rule::NotRun => return String::new(),
        };
        match self.tolerance {
            "" => rule,
            reason => format!("{rule}: {reason}"),
        }
    }
}

/// Measurements of an item by key, each in the unit of the figures with that key.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Measurements(Vec<(&'static str, Measurement)>);

impl Measurements {
    /// Adds a value.
    pub(crate) fn set(&mut self, key: &'static str, value: f64) {
        self.add(key, Some(Measurement::exact(value)));
    }

    /// Adds a measurement; none was observed otherwise.
    pub(crate) fn add(&mut self, key: &'static str, measurement: Option<Measurement>) {
        self.0.extend(measurement.map(|found| (key, found)));
    }

    /// Returns the measurement of a key.
    pub(crate) fn get(&self, key: &str) -> Option<Measurement> {
        let found = self.0.iter().find(|(name, _)| *name == key);
        found.map(|&(_, measurement)| measurement)
    }
}
