//! Conditions on elements of samples.

use twinrig_kernel::Unit;
use twinrig_runtime::Group;

use super::Layouts;
use crate::limits::{Comparison, Limits};
use crate::sequence::Condition;

/// Place of a condition's element in the samples, and its limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampledCondition {
    pub group: Group,
    element: usize,
    absolute: bool,
    pub unit: Unit,
    pub limits: Limits,
}

impl SampledCondition {
    /// Finds the element of a condition; the error is a reason for which it is unobserved.
    pub fn find(condition: &Condition, layouts: &Layouts<'_>) -> Result<Self, String> {
        let found = layouts.find(&condition.name.value);
        let found = found.filter(|(_, range)| condition.component < range.len());
        let (group, range) =
            found.ok_or_else(|| format!("there is no signal {}", condition.name.value))?;
        Ok(SampledCondition {
            group,
            element: range.start + condition.component,
            absolute: condition.absolute,
            unit: condition.unit,
            limits: condition.limits,
        })
    }

    /// Returns the compared value of a sample of its group.
    #[inline]
    pub fn value(&self, values: &[f64]) -> f64 {
        let value = values[self.element];
        if self.absolute { value.abs() } else { value }
    }

    /// Compares a value with the limits; the margin is the robustness of the condition.
    pub fn compare(&self, value: f64) -> Comparison {
        self.limits.compare(value, value)
    }

    /// Compares a value with the limits; the margin is the robustness of the negated condition.
    pub fn compare_negated(&self, value: f64) -> Comparison {
        let comparison = self.compare(value);
        Comparison {
            margin: -comparison.margin,
            other: None,
            ..comparison
        }
    }
}

/// Returns the comparison with the smaller margin, the first of equal ones.
pub(super) fn least(a: Comparison, b: Comparison) -> Comparison {
    if b.margin < a.margin { b } else { a }
}

/// Returns the comparison with the greater margin, the first of equal ones.
pub(super) fn greatest(a: Comparison, b: Comparison) -> Comparison {
    if b.margin > a.margin { b } else { a }
}
