//! The page of one or two runs.

use std::io;

use serde::Serialize;
use twinrig_kernel::signal;
use twinrig_record::{ExpectationMessage, RecordError, VerdictMessage};
use twinrig_report::number::{percent, quantity};
use twinrig_report::page::{self, Block, Script, Term};
use twinrig_report::table::{Column, Table};

use crate::columns::{Columns, packed};
use crate::figure::Figure;
use crate::files::differing_lines;
use crate::findings::findings;
use crate::gait::{LegGait, gait};
use crate::incidents::{Incident, first_line, incidents};
use crate::judged::{self, Judged, decisive, fails};
use crate::link::{component_name, instant};
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
    /// Signals that are plotted first; empty for those of a set.
    signals: Vec<String>,
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
    for (run, mark) in runs.iter().zip(["A: ", "B: "]) {
        let mark = if runs.len() > 1 { mark } else { "" };
        terms.extend(run_terms(run, mark));
    }
    terms.push(Term::code("command", command));
    terms.push(Term::text("numbers", rounding(&data)));
    let page = page::Page {
        kind: match runs.len() {
            1 => "Run".to_owned(),
            _ => "Comparison of two runs".to_owned(),
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

/// Returns the names of a component of a signal, of every leg if it is of one.
fn of_all_legs(data: &[RunData], (name, component): &(String, usize)) -> Vec<String> {
    let of_leg = |name: &str| signal::parse_leg(name).map(|(_, name)| name.to_owned());
    let alike = |other: &str| match of_leg(name) {
        Some(name) => of_leg(other) == Some(name),
        None => other == name,
    };
    let groups = data.iter().flat_map(|run| &run.groups);
    let signals = groups.flat_map(Group::signals);
    let signals = signals.filter(|(other, _)| alike(other));
    let mut names: Vec<String> = signals
        .map(|(other, components)| component_name(other, components, *component))
        .collect();
    names.sort();
    names.dedup();
    names
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

/// Returns what is done to the second run and not to the first, in words.
fn done_to_b_alone(data: &[RunData]) -> Vec<String> {
    let [a, b] = data else {
        return Vec::new();
    };
    let planned = |run: &RunData| -> Vec<String> {
        let planned = run.incidents.iter().filter_map(Incident::planned);
        planned.collect()
    };
    let in_a = planned(a);
    let in_b = planned(b).into_iter();
    in_b.filter(|it| !in_a.contains(it)).collect()
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

/// Returns the difference of two runs in a sentence, and the result of each run in one; `new` is
/// done to the second run alone.
fn headline(
    verdicts: &[Option<VerdictMessage>],
    compared: Option<&Compared>,
    new: &[String],
) -> String {
    let sentences: Vec<String> = verdicts.iter().map(|it| result(it.as_ref())).collect();
    let (Some(compared), [a, b]) = (compared, &*sentences) else {
        return sentences.concat();
    };
    let first = match (&compared.parting, new) {
        (_, [first, ..]) => format!("B has what A has not: {first}."),
        (Some(parting), _) => format!("B first differs from A {}.", parting.text),
        (None, _) => "B equals A as far as both go.".to_owned(),
    };
    format!("{first} A: {a} B: {b}")
}

/// Returns the result of a run in a sentence.
fn result(verdict: Option<&VerdictMessage>) -> String {
    let Some(verdict) = verdict else {
        return "The recording was cut off, so that there is no verdict.".to_owned();
    };
    if let Some(error) = &verdict.error {
        return format!("ERROR: {}.", first_line(error));
    }
    let all = &verdict.expectations;
    let held = all.iter().filter(|it| !fails(it)).count();
    let unobserved = |it: &&ExpectationMessage| fails(it) && it.verdict == "unobserved";
    let unobserved = all.iter().filter(unobserved).count();
    let counts = match all.len() {
        0 => "no expectations".to_owned(),
        1 => format!("{held} of 1 expectation holds"),
        all => format!("{held} of {all} expectations hold"),
    };
    let counts = match unobserved {
        0 => counts,
        _ => format!("{counts}, {unobserved} are unobserved"),
    };
    let failed = all.iter().filter(|it| fails(it));
    let first = failed.min_by(|a, b| {
        let at = |it| decisive(it).unwrap_or(f64::INFINITY);
        at(a).total_cmp(&at(b))
    });
    let first = first.map_or_else(String::new, |first| match decisive(first) {
        Some(at) => format!("; first violated at {at:.3} s: {}", first.name),
        None => format!("; violated: {}", first.name),
    });
    format!("{}: {counts}{first}.", verdict.verdict.to_uppercase())
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
    if let (Some(compared), [a, b]) = (compared, runs) {
        let files = differing_lines([a.recorded(), b.recorded()]);
        let tables = compared.tables.iter().cloned().chain([files]);
        let tables: Vec<Table> = tables.filter(|table| !table.is_empty()).collect();
        if !tables.is_empty() {
            blocks.push(Block::heading("Differences"));
            blocks.extend(tables.into_iter().map(Block::Table));
        }
    }
    let has = |is: fn(&RunData) -> bool| data.iter().any(is);
    let judged = verdicts.iter().enumerate().map(|(number, verdict)| {
        let table = verdict.as_ref().map(|it| judged::table(number, it));
        let table = table.filter(|it| !it.is_empty());
        table.map(Block::Table).into_iter().collect()
    });
    let judged = section("Expectations", judged.collect());
    let is_judged = !judged.is_empty();
    blocks.extend(judged);
    if is_judged {
        blocks.push(Block::Live {
            id: "course",
            label: "Measured value of the selected expectation over time, with its bounds",
        });
    }
    let found = runs.iter().enumerate().map(findings);
    blocks.extend(section("Findings", found.collect()));
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
    blocks.extend(section("Energy", runs.iter().map(energy).collect()));
    let mut omitted: Vec<Vec<Block>> = runs.iter().map(left_out).collect();
    let lists = runs
        .iter()
        .map(|run| run.assembly().map(|it| &it.scene().left_out));
    let lists: Vec<_> = lists.collect();
    // Equal ones are shown once.
    if lists.windows(2).all(|pair| pair[0] == pair[1]) {
        omitted.truncate(1);
    }
    blocks.extend(section("Left out", omitted));
    blocks
}

/// Returns the names of the runs in tables; empty for a single one.
fn marks(data: &[RunData]) -> [&'static str; 2] {
    if data.len() > 1 { ["A", "B"] } else { [""; 2] }
}

/// Returns a section with the parts of each run; of two, with their names, and the second first,
/// which is the one in question. Nothing if there are none.
fn section(heading: &str, parts: Vec<Vec<Block>>) -> Vec<Block> {
    let are_two = parts.len() > 1;
    let named = parts.into_iter().zip(["A", "B"]);
    let named = named.filter(|(blocks, _)| !blocks.is_empty());
    let mut named: Vec<Vec<Block>> = named
        .map(|(blocks, name)| {
            let name = are_two.then(|| Block::subheading(name));
            name.into_iter().chain(blocks).collect()
        })
        .collect();
    if named.is_empty() {
        return Vec::new();
    }
    named.reverse();
    std::iter::once(Block::heading(heading))
        .chain(named.concat())
        .collect()
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
    vec![Block::Table(table)]
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
    vec![Block::Table(table)]
}

/// Returns the data that repeat a run, with `mark` before their names.
fn run_terms(run: &Run<'_>, mark: &str) -> Vec<Term> {
    let recorded = run.recorded();
    let mut terms = vec![Term::code(format!("{mark}recording"), &run.path)];
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
        terms.extend(value.map(|value| Term::code(format!("{mark}{name}"), value)));
    }
    if let Some(fingerprint) = recorded.fingerprint() {
        terms.push(Term::code(format!("{mark}fingerprint"), fingerprint));
    }
    terms.push(Term::text(
        format!("{mark}source"),
        match run.is_repeated() {
            Ok(()) => "the run was repeated with all signals and bytes; the repetition has the \
                       recorded fingerprint"
                .to_owned(),
            Err(why) => format!(
                "the recording alone, without values of expectations on the way, findings and \
                 energy: it was not repeated: {why}"
            ),
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
