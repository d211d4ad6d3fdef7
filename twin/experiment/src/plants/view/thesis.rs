//! Page section that compares results with those of the thesis.

use twinrig_report::number::si;
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table};
use twinrig_rig::PlantId;
use twinrig_rig::Scales;

use super::rows::limit_cell;
use crate::plants::row::{Series, Status};
use crate::plants::study::Study;
use crate::plants::thesis::{FIGURES, ModelClass, ThesisFigure};

/// Relative stiffness of the second set of results of the thesis.
pub(crate) const QUARTER: f64 = 0.25;

/// Returns the section: results of the thesis, those found here, and the reasons for the
/// differences.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let introduction = "The robot of the thesis had other springs and masses than the robot file used here, \
         parts of which are assumed, and the thesis describes its criterion of instability in \
         words only. Orders of magnitude and trends are comparable, digits are not.";
    let mut out = vec![
        Block::text(introduction),
        Block::Table(table(study)),
        Block::subheading("Reasons for the differences"),
    ];
    out.extend(FIGURES.iter().map(|thesis| {
        let (model, step) = (thesis.model, si(thesis.step_s, "s"));
        Block::Text(format!("{model}, {step}. {}", thesis.why))
    }));
    out
}

/// Returns the table of the limits in the thesis, each with those found here.
fn table(study: &Study) -> Table {
    let step = |name: &str| Column::number(name);
    let mut table = Table::new([
        Column::label("in the thesis"),
        step("step").in_unit("s"),
        step("at ¼ stiffness").in_unit("s"),
        Column::text("here"),
        step("step"),
        step("at ¼ stiffness"),
    ]);
    for thesis in &FIGURES {
        let printed = [
            Cell::from(thesis.place).with_detail(thesis.model),
            thesis.step_s.into(),
            thesis.quarter_s.into(),
        ];
        let mut counterparts = counterparts(study, thesis).into_iter();
        let first = counterparts.next().map_or_else(
            || ["–".into(), Cell::empty(), Cell::empty()],
            Counterpart::cells,
        );
        table.row(printed.into_iter().chain(first));
        table.begin_group();
        for other in counterparts {
            let printed = [(); 3].map(|()| Cell::empty());
            table.row(printed.into_iter().chain(other.cells()));
        }
    }
    table
}

/// Result comparable with one of the thesis.
struct Counterpart {
    name: String,
    step: String,
    quarter: String,
}

impl Counterpart {
    fn cells(self) -> [Cell; 3] {
        [self.name, self.step, self.quarter].map(Cell::from)
    }
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
