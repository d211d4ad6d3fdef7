//! The page of one or two runs.

use std::io;

use twinrig_record::{RecordError, VerdictMessage};
use twinrig_report::page::{self, Script, Term};

use crate::columns::{Columns, packed};
use crate::data::{Data, RunData, of_all_legs};
use crate::headline::{done_to_b_alone, headline, opening, title};
use crate::pair::compared;
use crate::run::Run;
use crate::sections::{blocks, rounding, run_terms};

/// A page in HTML.
#[derive(Debug)]
pub struct Page {
    /// Text of the file.
    pub html: String,
    /// Instant at which it opens: the first decisive one of a run that fails, of the second if both
    /// do; else the start \[s\].
    pub opened_at_s: f64,
}

/// Style sheet and scripts, in the order in which they follow each other.
pub(crate) const STYLE: &str = concat!(
    include_str!("../assets/uplot/uPlot.min.css"),
    include_str!("../script/view.css")
);
pub(crate) const UPLOT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
const MODULE: &[&str] = &[
    include_str!("../script/data.js"),
    include_str!("../script/clock.js"),
    include_str!("../script/figure.js"),
    include_str!("../script/lanes.js"),
    include_str!("../script/plots.js"),
    include_str!("../script/strip.js"),
    include_str!("../script/main.js"),
];

/// Returns the page of a run, or of two that are compared, of which the first may be the baseline
/// of the second (`against`); `command` repeats it.
///
/// # Errors
/// A message of a recording cannot be decoded.
pub fn page(runs: &[Run<'_>], against: bool, command: &str) -> Result<Page, RecordError> {
    let mut columns = Columns::default();
    let verdicts = runs.iter().map(Run::verdict);
    let verdicts: Vec<Option<VerdictMessage>> = verdicts.collect::<Result<_, _>>()?;
    let shown = runs.iter().zip(&verdicts);
    // Of two runs each has half of the room.
    let share = runs.len();
    let data = shown.map(|(run, verdict)| RunData::of(run, verdict.as_ref(), share, &mut columns));
    let data: Vec<RunData> = data.collect::<Result<_, _>>()?;
    let compared = match runs {
        [a, b] => Some(compared([a, b])?),
        _ => None,
    };
    let blocks = blocks(runs, &verdicts, &data, compared.as_ref());
    let judged = runs.iter().zip(&verdicts).enumerate();
    let mut opening = judged.filter_map(|(number, (run, verdict))| {
        let at = opening(run, verdict.as_ref()?)?;
        Some((number, at))
    });
    // Two runs of which none fails differ nevertheless.
    let parted = compared.as_ref().and_then(|it| it.parting.as_ref());
    let parted = parted.map(|it| (0, it.at_s));
    let open = opening.next_back().or(parted).unwrap_or_default();
    let mut terms = Vec::new();
    for (run, mark) in runs.iter().zip(["A: ", "B: "]) {
        let mark = if runs.len() > 1 { mark } else { "" };
        terms.extend(run_terms(run, mark));
    }
    terms.push(Term::code("command", command));
    terms.push(Term::text("numbers", rounding(&data)));
    let page = page::Page {
        kind: match (runs.len(), against) {
            (1, _) => "Run".to_owned(),
            (_, false) => "Comparison of two runs".to_owned(),
            (_, true) => "B, a run that differs from its baseline, A".to_owned(),
        },
        title: title(runs),
        headline: headline(&verdicts, compared.as_ref(), &done_to_b_alone(&data)),
        blocks,
        terms,
    };
    let parted = compared
        .as_ref()
        .and_then(|it| it.parting.as_ref()?.signal.as_ref());
    let data = Data {
        signals: parted.map_or_else(Vec::new, |parted| of_all_legs(&data, parted)),
        runs: data,
        pair: compared.map(|it| it.pair),
        open,
    };
    let scripts = scripts(&data, &columns)?;
    Ok(Page {
        html: page.html_with(STYLE, &scripts),
        opened_at_s: open.1,
    })
}

fn scripts(data: &Data, columns: &Columns) -> io::Result<[Script; 4]> {
    let data = packed(&serde_json::to_vec(data)?)?;
    let columns = columns.text()?;
    Ok([
        Script::Data {
            id: "run-data",
            text: data,
        },
        Script::Data {
            id: "run-columns",
            text: columns,
        },
        Script::Library(UPLOT),
        Script::Module(MODULE.concat()),
    ])
}
