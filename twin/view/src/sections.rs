//! Sections of a page: tables, and the parts that scripts fill.

use twinrig_record::VerdictMessage;
use twinrig_report::number::{percent, quantity};
use twinrig_report::page::{Block, Term};
use twinrig_report::table::{Column, Table};

use crate::data::RunData;
use crate::files::differing_lines;
use crate::findings::findings;
use crate::judged;
use crate::link::instant;
use crate::pair::Compared;
use crate::run::Run;
use crate::signals::Group;
use crate::timing::Histogram;

/// Footsteps of the table.
const FOOTSTEPS: usize = 400;

/// Returns the sections of a page.
pub(crate) fn blocks(
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
pub(crate) fn run_terms(run: &Run<'_>, mark: &str) -> Vec<Term> {
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
pub(crate) fn rounding(data: &[RunData]) -> String {
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
