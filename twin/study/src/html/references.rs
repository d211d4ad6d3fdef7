//! Table of the references of a study.

use crate::reference_note::ReferenceNote;
use twinrig_report::number::{method_setting, si};

use twinrig_report::html::element::{element, escaped};
use twinrig_report::html::table::HtmlTable;

/// Returns the table of references.
pub(super) fn references(notes: &[ReferenceNote]) -> String {
    let mut table = HtmlTable::new(
        "plant | reference | checked by | disagreement, RMS | greatest |",
        3,
    );
    for note in notes {
        let setting = method_setting(note.step_s, note.tolerance);
        let of = note.of_plant.as_ref();
        let of = of.map_or(String::new(), |plant| format!("{} ", escaped(plant)));
        let own = note.method.as_ref().map_or("none".to_owned(), |method| {
            format!("{of}{} {setting}", escaped(method))
        });
        let check = note.check.as_ref();
        let by = check.map(|check| {
            let setting = method_setting(check.step_s, check.tolerance);
            format!("{} {setting}", escaped(&check.method))
        });
        table.row(
            "",
            vec![
                element("b", "", &escaped(&note.plant.label())),
                own,
                by.unwrap_or_default(),
                check.map_or(String::new(), |check| si(check.disagreement_rms_m, "m")),
                check.map_or(String::new(), |check| si(check.disagreement_max_m, "m")),
                note.why
                    .as_ref()
                    .map_or(String::new(), |why| element("span", "why", &escaped(why))),
            ],
        );
    }
    table.html()
}
