//! The part of a page that sets figures beside those of the thesis.

use crate::factory::Scales;
use crate::number::si;
use crate::row::{Line, Status};
use crate::study::Study;
use crate::thesis::{FIGURES, Like, ThesisFigure};

use super::stability::{QUARTER, limit_cell};
use super::table::Table;
use super::text::{element, escaped, paragraph};

/// The figures of the thesis, ours, and why they differ.
pub(crate) fn section(study: &Study) -> String {
    let mut out = paragraph(
        "The thesis' robot had other springs and masses than the robot file here, parts of which are assumed, and \
         what its search took for unstable is told in words only. So orders of magnitude and trends compare, and digits do not.",
    );
    let mut table = Table::new(
        &[
            "in the thesis",
            "step",
            "at ¼ stiffness",
            "here",
            "step",
            "at ¼ stiffness",
        ],
        1,
    );
    for thesis in &FIGURES {
        let ours = ours(study, thesis);
        let cells = |of: &dyn Fn(&Ours) -> String| {
            let lines: Vec<String> = ours.iter().map(of).collect();
            lines.join("<br/>")
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
                if ours.is_empty() {
                    "–".to_owned()
                } else {
                    cells(&|ours| escaped(&ours.name))
                },
                cells(&|ours| ours.step.clone()),
                cells(&|ours| ours.quarter.clone()),
            ],
        );
    }
    out += &table.html();
    out += "<h3>Why they differ</h3>\n";
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

/// What compares with a figure of the thesis.
struct Ours {
    name: String,
    step: String,
    quarter: String,
}

fn ours(study: &Study, thesis: &ThesisFigure) -> Vec<Ours> {
    let like = |plant: &str| {
        let engine = study.solves.iter().any(|(known, _)| known == plant);
        let massive = study.massive.iter().any(|known| known == plant);
        match (massive, engine) {
            (true, true) => Like::Engines,
            (true, false) => Like::Massive,
            (false, _) => Like::Massless,
        }
    };
    let quarter = Scales {
        stiffness: QUARTER,
        ..Scales::AS_IS
    };
    let cell = |line: Line<'_>, scales: Scales| {
        let mut rows = study.rows.iter();
        let row = rows.find(|row| row.line() == line && row.scales == scales);
        row.map_or(String::new(), |row| {
            let wrong = match (row.wrong, row.largest_right_step_s) {
                (true, Some(step)) => format!(" (right to {})", si(step, "s")),
                (true, None) => " (wrong)".to_owned(),
                (false, _) => String::new(),
            };
            match row.status {
                Status::Ok => format!("{}{wrong}", limit_cell(row)),
                status => status.word().to_owned(),
            }
        })
    };
    let lines = study.lines().into_iter();
    lines
        .filter(|line| !line.is_adaptive())
        .filter(|line| like(line.plant) == thesis.like)
        .map(|line| Ours {
            name: line.name(),
            step: cell(line, Scales::AS_IS),
            quarter: cell(line, quarter),
        })
        .collect()
}
