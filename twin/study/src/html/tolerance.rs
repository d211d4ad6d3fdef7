//! Page section on the error of error-controlled methods over their tolerance.

use crate::study::Study;
use twinrig_report::number::power;

use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: slopes of log error over log tolerance.
pub(crate) fn section(study: &Study) -> String {
    let slopes = study.tolerance_slopes();
    if slopes.is_empty() {
        return String::new();
    }
    let mut table = HtmlTable::new(
        "plant | method | feet | trunk | worst foot to hip | tolerances | from | to",
        2,
    );
    let ratio = |slope: f64| format!("{slope:.2}");
    for slope in &slopes {
        let optional = |slope: Option<f64>| slope.map_or(String::new(), ratio);
        table.row(
            "",
            vec![
                element("b", "", &escaped(&slope.plant.label())),
                escaped(&slope.method),
                ratio(slope.feet),
                optional(slope.trunk),
                optional(slope.foot_to_hip),
                slope.points.to_string(),
                power(slope.range[0], 2),
                power(slope.range[1], 2),
            ],
        );
    }
    "<h2>Error against tolerance</h2>\n".to_owned()
        + &paragraph(
            "Slope of the logarithm of the error over that of the tolerance, by least squares, \
             from tolerances of 10⁻⁸ to 10⁻⁵, without errors at the floor: 1 where the error is \
             proportional to the tolerance, 0 where a tighter tolerance gains nothing.",
        )
        + &table.html()
}
