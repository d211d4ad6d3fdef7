//! Table of the references of a study.

use twinrig_report::number::{method_setting, si};
use twinrig_report::table::{Column, Table};

use crate::plants::reference_note::ReferenceNote;

/// Returns the table of references.
pub(crate) fn references(notes: &[ReferenceNote]) -> Table {
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("reference"),
        Column::text("checked by"),
        Column::number("disagreement, RMS"),
        Column::number("greatest"),
        Column::reason(),
    ]);
    for note in notes {
        let setting = method_setting(note.step_s, note.tolerance);
        let of = note.of_plant.as_ref();
        let of = of.map_or(String::new(), |plant| format!("{plant} "));
        let method = note.method.as_ref();
        let own = method.map_or("none".to_owned(), |method| {
            format!("{of}{method} {setting}")
        });
        let check = note.check.as_ref();
        let by = check.map(|check| {
            let setting = method_setting(check.step_s, check.tolerance);
            format!("{} {setting}", check.method)
        });
        table.row([
            note.plant.label().into(),
            own.into(),
            by.into(),
            check.map(|check| si(check.disagreement_rms_m, "m")).into(),
            check.map(|check| si(check.disagreement_max_m, "m")).into(),
            note.why.clone().into(),
        ]);
    }
    table
}
