//! The page of one or two runs.

use std::io;

use serde::Serialize;
use twinrig_record::{RecordError, VerdictMessage};
use twinrig_report::number::{percent, quantity};
use twinrig_report::page::{self, Block, Script, Term};
use twinrig_report::table::{Column, Table};

use crate::columns::{Columns, packed};
use crate::figure::Figure;
use crate::findings::findings;
use crate::gait::{LegGait, gait};
use crate::incidents::{Incident, first_line, incidents};
use crate::judged::{self, Judged, decisive, fails};
use crate::link::instant;
use crate::pair::{Compared, Pair, compared};
use crate::run::Run;
use crate::signals::{Group, signals};
use crate::timing::{Histogram, timing};
use crate::wires::{Wires, wires};

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
const STYLE: &str = concat!(
    include_str!("../assets/uplot/uPlot.min.css"),
    include_str!("../script/view.css")
);
const UPLOT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
const MODULE: &[&str] = &[
    include_str!("../script/data.js"),
    include_str!("../script/clock.js"),
    include_str!("../script/figure.js"),
    include_str!("../script/lanes.js"),
    include_str!("../script/plots.js"),
    include_str!("../script/strip.js"),
    include_str!("../script/main.js"),
];

/// Data of the scripts.
#[derive(Serialize)]
struct Data {
    runs: Vec<RunData>,
    pair: Option<Pair>,
    /// Index of a run, and its instant at which the page opens \[s\].
    open: (usize, f64),
}

#[derive(Serialize)]
struct RunData {
    name: String,
    /// End of the run \[s\].
    end: f64,
    figure: Option<Figure>,
    gait: Vec<LegGait>,
    incidents: Vec<Incident>,
    judged: Judged,
    groups: Vec<Group>,
    timing: Vec<Histogram>,
    wires: Option<Wires>,
}

/// Footsteps of the table.
const FOOTSTEPS: usize = 400;

/// Returns the page of a run, or of two that are compared; `command` repeats it.
///
/// # Errors
/// A message of a recording cannot be decoded.
pub fn page(runs: &[Run<'_>], command: &str) -> Result<Page, RecordError> {
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
    let open = opening.next_back().unwrap_or_default();
    let mut terms = Vec::new();
    for run in runs {
        terms.extend(run_terms(run));
    }
    terms.push(Term::code("command", command));
    terms.push(Term::text("numbers", rounding(&data)));
    let page = page::Page {
        kind: match runs.len() {
            1 => "Run".to_owned(),
            _ => "Comparison of two runs".to_owned(),
        },
        title: title(runs),
        headline: headline(&verdicts, compared.as_ref()),
        blocks,
        terms,
    };
    let data = Data {
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

impl RunData {
    fn of(
        run: &Run<'_>,
        verdict: Option<&VerdictMessage>,
        share: usize,
        columns: &mut Columns,
    ) -> Result<Self, RecordError> {
        let figure = Figure::of(run, columns)?;
        let legs = figure.iter().flat_map(Figure::legs);
        let gait = gait(run, legs)?;
        let incidents = incidents(run, &gait, verdict)?;
        let notable = incidents.iter().filter(|it| it.is_notable());
        let instants = verdict
            .into_iter()
            .flat_map(|verdict| &verdict.expectations);
        let instants = notable.map(|it| it.at).chain(instants.filter_map(decisive));
        Ok(Self {
            name: run.name().to_owned(),
            end: run.end().as_secs_f64(),
            wires: wires(run, instants, share),
            judged: Judged::of(run, verdict, columns),
            groups: signals(run, share, columns),
            timing: timing(run.shown()),
            figure,
            gait,
            incidents,
        })
    }
}

fn title(runs: &[Run<'_>]) -> String {
    let names: Vec<&str> = runs.iter().map(Run::name).collect();
    match *names {
        [a, b] if a == b => format!("{a}, two runs"),
        _ => names.join(" and "),
    }
}

/// Returns the instant at which the page of a run opens \[s\]: its end by an error, or the first
/// decisive instant; none of a run that passes.
fn opening(run: &Run<'_>, verdict: &VerdictMessage) -> Option<f64> {
    if verdict.error.is_some() {
        return Some(run.end().as_secs_f64());
    }
    let failed = verdict.expectations.iter().filter(|it| fails(it));
    failed.filter_map(decisive).reduce(f64::min)
}

/// Returns the result of the runs in a sentence each.
fn headline(verdicts: &[Option<VerdictMessage>], compared: Option<&Compared>) -> String {
    let of = |verdict: &Option<VerdictMessage>| {
        let Some(verdict) = verdict else {
            return "The recording was cut off, so that there is no verdict.".to_owned();
        };
        if let Some(error) = &verdict.error {
            return format!("ERROR: {}", first_line(error));
        }
        let all = &verdict.expectations;
        let held = all.iter().filter(|it| !fails(it)).count();
        let count = match all.len() {
            0 => "no expectations".to_owned(),
            1 => format!("{held} of 1 expectation holds"),
            all => format!("{held} of {all} expectations hold"),
        };
        let failed = all.iter().filter(|it| fails(it));
        let first = failed.min_by(|a, b| {
            let at = |it| decisive(it).unwrap_or(f64::INFINITY);
            at(a).total_cmp(&at(b))
        });
        let first = first.map_or_else(String::new, |first| match decisive(first) {
            Some(at) => format!("; first at {at:.3} s: {}", first.name),
            None => format!("; {}", first.name),
        });
        format!("{}: {count}{first}.", verdict.verdict.to_uppercase())
    };
    let sentences: Vec<String> = verdicts.iter().map(of).collect();
    match &*sentences {
        [a, b] => {
            let parting = compared.and_then(|it| it.parting.as_ref());
            let parting = parting.map_or_else(
                || " The runs are equal.".to_owned(),
                |it| format!(" B parts from A {it}."),
            );
            format!("A: {a} B: {b}{parting}")
        }
        _ => sentences.concat(),
    }
}

fn blocks(
    runs: &[Run<'_>],
    verdicts: &[Option<VerdictMessage>],
    data: &[RunData],
    compared: Option<&Compared>,
) -> Vec<Block> {
    let mut blocks = vec![Block::Live {
        id: "stage",
        label: "The robot over time, its gait, and a slider of time. The tables below have the \
                footsteps and instants.",
    }];
    if let Some(compared) = compared {
        blocks.push(Block::heading("Differences"));
        blocks.extend(compared.tables.iter().cloned().map(Block::Table));
    }
    let has = |is: fn(&RunData) -> bool| data.iter().any(is);
    let mut judged = verdicts.iter().flatten();
    if judged.any(|it| !it.expectations.is_empty()) {
        blocks.push(Block::heading("Expectations"));
        for (number, verdict) in verdicts.iter().enumerate() {
            let table = verdict.as_ref().map(|it| judged::table(number, it));
            blocks.extend(table.filter(|it| !it.is_empty()).map(Block::Table));
        }
        blocks.push(Block::Live {
            id: "course",
            label: "Measured value of the selected expectation over time, with its bounds",
        });
    }
    blocks.extend(runs.iter().enumerate().flat_map(findings));
    blocks.push(Block::heading("Signals"));
    blocks.push(Block::Live {
        id: "signals",
        label: "Plots of the selected signals over time",
    });
    if has(|run| run.wires.is_some()) {
        blocks.push(Block::heading("Buses"));
        blocks.push(Block::Live {
            id: "strip",
            label: "Bytes of the buses around the instant of the slider",
        });
    }
    if has(|run| !run.timing.is_empty()) {
        blocks.push(Block::heading("Timing"));
        blocks.push(Block::Live {
            id: "timing",
            label: "Histograms of periods and transfers; the table has their extremes",
        });
        blocks.push(Block::Table(timing_table(data)));
    }
    if has(|run| run.gait.iter().any(|of| !of.footsteps.is_empty())) {
        blocks.push(Block::heading("Footsteps"));
        blocks.extend(footsteps(data));
    }
    for run in runs {
        blocks.extend(energy(run));
        blocks.extend(left_out(run));
    }
    blocks
}

/// Returns the names of the runs in tables; empty for a single one.
fn marks(data: &[RunData]) -> [&'static str; 2] {
    if data.len() > 1 { ["A", "B"] } else { [""; 2] }
}

fn timing_table(data: &[RunData]) -> Table {
    let mut table = Table::new([
        Column::label("run"),
        Column::label("duration"),
        Column::number("least").in_unit("s"),
        Column::number("median").in_unit("s"),
        Column::number("greatest").in_unit("s"),
    ]);
    for (run, mark) in data.iter().zip(marks(data)) {
        for (title, [least, median, greatest]) in run.timing.iter().map(Histogram::row) {
            table.row([
                mark.into(),
                title.into(),
                least.into(),
                median.into(),
                greatest.into(),
            ]);
        }
    }
    table
}

/// Returns the table of the footsteps by touch-down, and a note if it has not all.
fn footsteps(data: &[RunData]) -> Vec<Block> {
    let mut table = Table::new([
        Column::label("run"),
        Column::label("leg"),
        Column::text("touch-down"),
        Column::number("stance").in_unit("s"),
        Column::number("slip").in_unit("m"),
        Column::number("impulse").in_unit("N·s"),
        Column::number("greatest load").in_unit("N"),
        Column::number("contacts"),
    ]);
    let mut count = 0;
    for (number, (run, mark)) in data.iter().zip(marks(data)).enumerate() {
        let steps = run
            .gait
            .iter()
            .flat_map(|of| of.footsteps.iter().map(move |it| (of, it)));
        let mut steps: Vec<_> = steps.collect();
        steps.sort_by(|a, b| a.1.from.total_cmp(&b.1.from));
        count = count.max(steps.len());
        for (of, step) in steps.into_iter().take(FOOTSTEPS) {
            table.row([
                mark.into(),
                of.leg.as_str().into(),
                instant(number, step.from),
                (step.to - step.from).into(),
                step.slip_m.into(),
                step.impulse_ns.into(),
                step.peak_n.into(),
                step.contacts.into(),
            ]);
        }
    }
    let note = (count > FOOTSTEPS).then(|| {
        Block::text(format!(
            "The first {FOOTSTEPS} of {count} footsteps; the recording has all."
        ))
    });
    note.into_iter().chain([Block::Table(table)]).collect()
}

/// Returns the energy balance at the end of a run; none if it is not known.
fn energy(run: &Run<'_>) -> Vec<Block> {
    let Some(energy) = run.repetition().and_then(|it| it.report.energy) else {
        return Vec::new();
    };
    if energy.exchanged_j == 0.0 {
        return Vec::new();
    }
    let mut table = Table::new([
        Column::label("energy balance at the end of the run"),
        Column::text("energy"),
        Column::text("share of the exchanged energy"),
    ]);
    for (name, value) in [
        ("work of the actuators", energy.actuator_j),
        ("dissipated by friction and damping", energy.dissipated_j),
        ("dissipated by impacts", energy.impact_j),
        (
            "exchanged, sum of the magnitudes of all transfers",
            energy.exchanged_j,
        ),
        ("residual", energy.residual_j),
    ] {
        table.row([
            name.into(),
            quantity(value, "J").into(),
            percent(value / energy.exchanged_j).into(),
        ]);
    }
    vec![Block::heading("Energy"), Block::Table(table)]
}

/// Returns the parts that are left out of a run; none if they are not known.
fn left_out(run: &Run<'_>) -> Vec<Block> {
    let left_out = run.assembly().map_or(&[][..], |it| &it.scene().left_out);
    if left_out.is_empty() {
        return Vec::new();
    }
    let mut table = Table::new([Column::label("left out"), Column::text("reason")]);
    for part in left_out {
        table.row([part.part.as_str().into(), part.why.as_str().into()]);
    }
    vec![Block::heading("Left out"), Block::Table(table)]
}

fn run_terms(run: &Run<'_>) -> Vec<Term> {
    let recorded = run.recorded();
    let mut terms = vec![Term::code("recording", &run.path)];
    for (key, name) in [
        ("scenario_file", "scenario"),
        ("robot_file", "robot"),
        ("plant", "plant"),
        ("seed", "seed"),
        ("settings", "settings"),
        ("build", "build"),
    ] {
        let value = recorded
            .note(key)
            .filter(|value| !["", "[]"].contains(value));
        terms.extend(value.map(|value| Term::code(name, value)));
    }
    if let Some(fingerprint) = recorded.fingerprint() {
        terms.push(Term::code("fingerprint", fingerprint));
    }
    terms.push(Term::text(
        "source",
        match run.is_repeated() {
            Ok(()) => "the run was repeated with all signals and bytes; the repetition has the \
                       recorded fingerprint"
                .to_owned(),
            Err(why) => format!("the recording alone, which was not repeated: {why}"),
        },
    ));
    terms
}

/// Returns a statement on the accuracy of the numbers.
fn rounding(data: &[RunData]) -> String {
    let groups = data.iter().flat_map(|run| &run.groups);
    let greatest = groups.map(Group::factor).fold(1.0, f64::max);
    let decimated = if greatest > 1.0 {
        format!(
            "of up to {greatest:.0} samples one is kept, the least and the greatest of each \
             interval; "
        )
    } else {
        String::new()
    };
    format!("{decimated}values are rounded to 1/65534 of their range; the recording is exact")
}
