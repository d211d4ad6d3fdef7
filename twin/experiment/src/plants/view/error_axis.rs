//! Lower end of an axis of errors: the smallest error shown, and the floor of the reference.

use twinrig_report::html::plot::Mark;
use twinrig_report::number::si;

use crate::plants::study::Study;

/// Smallest error shown on a logarithmic scale \[m\].
pub(crate) const LEAST_M: f64 = 1e-16;

/// Returns the mark of the floor of the reference.
pub(crate) fn floor(study: &Study) -> Mark {
    let reference = study.reference();
    let plant = reference.map_or(String::new(), |note| note.plant.label());
    let floor = study.floor();
    let label = format!(
        "floor: reference and check of {plant} differ by {}",
        si(floor, "m")
    );
    Mark::Below(floor, label)
}
