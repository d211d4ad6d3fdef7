//! Cases that Python has drawn, and the ranges to draw them from.

use std::ops::RangeInclusive;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use twinrig_testing::laws::{CASE_RANGES, Case, Damage, DamageKind, DrawnKind, ListRanges};

/// A `twinrig.laws.Case`.
#[derive(FromPyObject)]
pub(crate) struct CaseArgument {
    to_driver: Vec<DamageArgument>,
    to_devices: Vec<DamageArgument>,
    pieces: Vec<u8>,
    looks: Vec<u16>,
    saved: u16,
    saved_at: u16,
    garbage: Vec<u8>,
}

/// A `twinrig.laws.Damage`.
#[derive(FromPyObject)]
struct DamageArgument {
    after: u8,
    kind: String,
    number: u16,
}

impl CaseArgument {
    /// Returns the case.
    ///
    /// # Errors
    /// `ValueError` if a kind of damage is not known, or the garbage is empty.
    pub(super) fn case(&self) -> PyResult<Case> {
        if self.garbage.is_empty() {
            return Err(PyValueError::new_err("garbage: there must be a byte"));
        }
        Ok(Case {
            to_driver: damages(&self.to_driver)?,
            to_devices: damages(&self.to_devices)?,
            pieces: self.pieces.clone(),
            looks: self.looks.clone(),
            saved: self.saved,
            saved_at: self.saved_at,
            garbage: self.garbage.clone(),
        })
    }
}

fn damages(arguments: &[DamageArgument]) -> PyResult<Vec<Damage>> {
    let damage = |it: &DamageArgument| {
        let kind = DamageKind::named(&it.kind, it.number).ok_or_else(|| {
            let (name, number) = (&it.kind, it.number);
            PyValueError::new_err(format!("there is no damage `{name}` of number {number}"))
        })?;
        Ok(Damage {
            after: it.after,
            kind,
        })
    };
    arguments.iter().map(damage).collect()
}

type Ends<T> = (T, T);

/// Ranges by their ends, both included.
#[derive(IntoPyObject)]
pub(crate) struct Ranges {
    to_driver: Ends<usize>,
    to_devices: Ends<usize>,
    after: Ends<u8>,
    /// Name, weight, whether devices are concerned, and range of the number.
    kinds: Vec<(&'static str, u32, bool, Ends<u16>)>,
    pieces: (Ends<usize>, Ends<u8>),
    looks: (Ends<usize>, Ends<u16>),
    saved: Ends<u16>,
    saved_at: Ends<u16>,
    garbage: (Ends<usize>, Ends<u8>),
}

fn ends<T: Copy>(range: &RangeInclusive<T>) -> Ends<T> {
    (*range.start(), *range.end())
}

fn list<T: Copy>(ranges: &ListRanges<T>) -> (Ends<usize>, Ends<T>) {
    (ends(&ranges.length), ends(&ranges.number))
}

/// Returns the ranges from which the cases of all laws are drawn.
#[pyfunction]
pub(crate) fn case_ranges() -> Ranges {
    let of = &CASE_RANGES;
    let kind = |it: &DrawnKind| (it.name, it.weight, it.to_devices, ends(&it.number));
    Ranges {
        to_driver: ends(&of.to_driver),
        to_devices: ends(&of.to_devices),
        after: ends(&of.after),
        kinds: of.kinds.iter().map(kind).collect(),
        pieces: list(&of.pieces),
        looks: list(&of.looks),
        saved: ends(&of.saved),
        saved_at: ends(&of.saved_at),
        garbage: list(&of.garbage),
    }
}
