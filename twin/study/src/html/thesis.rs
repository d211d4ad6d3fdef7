//! Page section that compares results with those of the thesis.

use crate::row::{Series, Status};
use crate::study::Study;
use crate::thesis::{FIGURES, ModelClass, ThesisFigure};
use twinrig_report::number::si;
use twinrig_rig::PlantId;
use twinrig_rig::Scales;

use super::rows::limit_cell;
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Relative stiffness of the second set of results of the thesis.
pub(crate) const QUARTER: f64 = 0.25;

/// Returns the section: results of the thesis, those found here, and the reasons for the
/// differences.
pub(crate) fn section(study: &Study) -> String {
    let mut out = paragraph(
        "The robot of the thesis had other springs and masses than the robot file used here, \
         parts of which are assumed, and the thesis describes its criterion of instability in \
         words only. Orders of magnitude and trends are comparable, digits are not.",
    );
    let mut table = HtmlTable::new(
        "in the thesis | step | at ¼ stiffness | here | step | at ¼ stiffness",
        1,
    );
    for thesis in &FIGURES {
        let counterparts = counterparts(study, thesis);
        let cells = |of: &dyn Fn(&Counterpart) -> String| {
            let series: Vec<String> = counterparts.iter().map(of).collect();
            series.join("<br/>")
        };
        table.row(
            "first",
            vec![
                format!(
                    "<span class=\"wrap\">{}</span><span class=\"wrap soft\">{}</span>",
                    escaped(thesis.model),
                    escaped(thesis.place)
                ),
                si(thesis.step_s, "s"),
                thesis.quarter_s.map_or(String::new(), |step| si(step, "s")),
                if counterparts.is_empty() {
                    "–".to_owned()
                } else {
                    cells(&|counterparts| escaped(&counterparts.name))
                },
                cells(&|counterparts| counterparts.step.clone()),
                cells(&|counterparts| counterparts.quarter.clone()),
            ],
        );
    }
    out += &table.html();
    out += "<h3>Reasons for the differences</h3>\n";
    for thesis in &FIGURES {
        let model = element("b", "", &escaped(thesis.model));
        let why = format!(
            "{model}, {}. {}",
            si(thesis.step_s, "s"),
            escaped(thesis.why)
        );
        out += &element("p", "", &why);
    }
    out
}

/// Result comparable with one of the thesis.
struct Counterpart {
    name: String,
    step: String,
    quarter: String,
}

fn counterparts(study: &Study, thesis: &ThesisFigure) -> Vec<Counterpart> {
    let class_of = |plant: &PlantId| {
        let engine = study.solves.iter().any(|(known, _)| known == plant);
        let massive = study.massive.iter().any(|known| known == plant);
        match (massive, engine) {
            (true, true) => ModelClass::Engines,
            (true, false) => ModelClass::Massive,
            (false, _) => ModelClass::Massless,
        }
    };
    let quarter = Scales {
        stiffness: QUARTER,
        ..Scales::AS_IS
    };
    let cell = |key: Series<'_>, scales: Scales| {
        let mut rows = study.rows.iter();
        let row = rows.find(|row| row.series() == key && row.scales == scales);
        row.map_or(String::new(), |row| {
            let wrong = match (row.wrong, row.largest_right_step_s) {
                (true, Some(step)) => format!(" (accurate up to {})", si(step, "s")),
                (true, None) => " (wrong)".to_owned(),
                (false, _) => String::new(),
            };
            match row.status {
                Status::Ok => format!("{}{wrong}", limit_cell(row)),
                status => status.word().to_owned(),
            }
        })
    };
    let series = study.series().into_iter();
    series
        .filter(|key| !key.is_adaptive())
        .filter(|key| class_of(key.plant) == thesis.like)
        .map(|key| Counterpart {
            name: key.name(),
            step: cell(key, Scales::AS_IS),
            quarter: cell(key, quarter),
        })
        .collect()
}
