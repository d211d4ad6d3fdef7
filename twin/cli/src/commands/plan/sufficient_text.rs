//! Text form of the search of the cheapest sufficient twin.

use twinrig_document::escaped;
use twinrig_experiment::{
    Candidate, CandidateRow, CandidateStatus, Deviation, ReferenceMargin, Rule,
};
use twinrig_report::number::{fixed, quantity, si};
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::sufficient::SufficientTwin;
use crate::report::left_out;
use twinrig_report::text::grid::{self, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, RED, styled};

pub(super) fn text(found: &SufficientTwin) -> String {
    let mut lines = vec![styled(BOLD, &found.scenario), String::new()];
    lines.extend(choice(found));
    lines.push(String::new());
    lines.extend(margins(found));
    lines.push(String::new());
    lines.extend(candidates(found));
    lines.extend(proof(found));
    if !found.left_out.is_empty() {
        lines.push(String::new());
        lines.push(format!("  {}", styled(BOLD, "no candidates")));
        lines.extend(found.left_out.iter().map(|line| format!("    {line}")));
    }
    lines.join("\n")
}

/// Formats a computation time per simulated second.
fn time(run_s_per_s: f64) -> String {
    format!("{}/s", si(run_s_per_s, "s"))
}

fn choice(found: &SufficientTwin) -> Vec<String> {
    let search = &found.search;
    let mut facts = Grid::new(&[Left, Left]);
    let mut fact =
        |name: &str, value: String| facts.row([grid::Cell::new(name, DIM), value.into()]);
    match search.choice() {
        Some(row) => fact("cheapest sufficient", row.candidate.describe()),
        None => fact(
            "cheapest sufficient",
            "none is cheaper than the reference".to_owned(),
        ),
    }
    let times = [("time", search.choice()), ("of the scenario", search.own())];
    for (name, row) in times {
        let Some(row) = row else { continue };
        let run_s = row.run_s_per_s.map(time).unwrap_or_default();
        let value = match row.status {
            CandidateStatus::Sufficient => run_s,
            _ => format!("{run_s}, not sufficient"),
        };
        fact(name, value);
    }
    fact("of the reference", time(search.reference.run_s_per_s));
    let [own, reference] = found.savings;
    let saving =
        |factor: Option<f64>, of: &str| Some(format!("{} × against the {of}", fixed(factor?, 2)));
    let savings = [saving(own, "scenario"), saving(reference, "reference")];
    let savings: Vec<_> = savings.into_iter().flatten().collect();
    if !savings.is_empty() {
        fact("saving", savings.join(", "));
    }
    let reference = &search.reference;
    fact("reference", reference.reference.describe());
    fact("verified by", reference.check.describe());
    fact("shown for", found.scope.clone());
    let mut lines = facts.lines(2);
    if let Some(options) = &found.options
        && !options.is_empty()
    {
        lines.push(String::new());
        let toml = found.toml.iter().flat_map(|toml| toml.lines());
        lines.extend(toml.map(|line| format!("    {line}")));
        lines.push(String::new());
        lines.push(format!("    twin run {} {options}", found.file));
    }
    lines
}

fn margins(found: &SufficientTwin) -> Vec<String> {
    let numbers = ["margin", "scatter", "uncertainty", "of the choice", "error"];
    let columns = std::iter::once(Column::label("expectation"));
    let columns = columns.chain(numbers.map(Column::number));
    let mut table = Table::new(columns.chain([Column::text("judged by")]));
    let chosen = found.search.choice();
    for (n, margin) in found.search.margins.iter().enumerate() {
        let deviation = chosen.and_then(|row| row.deviations.get(n));
        let of = |value: Option<f64>| Cell::from(value.map(|it| quantity(it, &margin.unit)));
        table.row([
            margin.name.as_str().into(),
            of(margin.margin),
            of(margin.margin.map(|_| margin.scatter)),
            of(margin.margin.map(|_| margin.uncertainty)),
            of(deviation.and_then(|it| it.margin)),
            deviation.map(share).into(),
            Cell::from(rule(margin)).with_tone(Tone::Faint),
        ]);
    }
    let mut lines = vec![format!(
        "  {}",
        styled(BOLD, "expectations of the reference")
    )];
    lines.extend(table.grid().lines(4));
    for name in &found.search.reference.failed_of_computation {
        lines.push(format!(
            "    {name}: fails in the reference, which is not judged by it"
        ));
    }
    lines
}

/// Formats an error as a share of the margin.
fn share(deviation: &Deviation) -> String {
    match deviation.share {
        Some(share) if share.is_finite() => format!("{} %", fixed(100.0 * share, 2)),
        Some(_) => "of a margin of 0".to_owned(),
        None => String::new(),
    }
}

fn rule(margin: &ReferenceMargin) -> String {
    match margin.rule {
        Rule::Error if margin.is_too_uncertain() => {
            "error; the reference is not known to a tenth of its margin".to_owned()
        }
        Rule::Error => "error".to_owned(),
        Rule::Overlap => {
            "verdict and overlap: it scatters by more than a tenth of its margin".to_owned()
        }
        Rule::Verdict => "verdict: it has no margin".to_owned(),
    }
}

fn candidates(found: &SufficientTwin) -> Vec<String> {
    let mut table = Table::new([
        Column::label("candidate"),
        Column::number("time"),
        Column::number("worst error"),
        Column::text("of"),
        Column::status("verdict"),
    ]);
    let chosen = found.search.choice();
    let run = found.search.rows.iter();
    let run: Vec<&CandidateRow> = run
        .filter(|row| row.status != CandidateStatus::NotRun)
        .collect();
    for rows in run.chunk_by(|a, b| is_alike(a, b)) {
        let [row, others @ ..] = rows else { continue };
        let name = row.candidate.describe();
        let name = others.last().map_or(name.clone(), |last| {
            format!("{name} … {}", last.candidate.describe_setting())
        });
        let worst = row.worst();
        let (word, tone) = verdict(row, chosen == Some(row));
        table.row([
            name.into(),
            row.run_s_per_s.map(time).into(),
            worst.map(share).into(),
            worst.map(|it| it.name.as_str()).into(),
            Cell::from(word).with_tone(tone),
        ]);
    }
    let mut lines = vec![format!("  {}", styled(BOLD, "candidates"))];
    lines.extend(table.grid().lines(4));
    lines.extend(not_run(&found.search.rows));
    lines
}

/// Returns whether the rows are settings of one method that ended for the same reason.
fn is_alike(a: &CandidateRow, b: &CandidateRow) -> bool {
    let of = |row: &CandidateRow| {
        let Candidate { plant, method, .. } = &row.candidate;
        (plant.clone(), method.clone(), row.status, row.why.clone())
    };
    a.why.is_some() && a.deviations.is_empty() && of(a) == of(b)
}

/// Returns the numbers of candidates that were not run, with the reasons.
fn not_run(rows: &[CandidateRow]) -> Vec<String> {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for row in rows {
        let Some(why) = row.why.as_deref() else {
            continue;
        };
        if row.status == CandidateStatus::NotRun {
            match counts.iter_mut().find(|(known, _)| *known == why) {
                Some((_, count)) => *count += 1,
                None => counts.push((why, 1)),
            }
        }
    }
    let line = |(why, count)| format!("    {count} not run: {why}");
    counts.into_iter().map(line).collect()
}

fn verdict(row: &CandidateRow, is_chosen: bool) -> (String, Tone) {
    let why = row.why.clone().unwrap_or_default();
    match row.status {
        CandidateStatus::Sufficient if is_chosen => {
            ("sufficient, the cheapest".to_owned(), Tone::Good)
        }
        CandidateStatus::Sufficient => ("sufficient".to_owned(), Tone::Good),
        CandidateStatus::Insufficient => (why, Tone::Bad),
        CandidateStatus::Refused => (format!("refused: {why}"), Tone::Faint),
        CandidateStatus::Failed => (format!("failed: {why}"), Tone::Doubtful),
        CandidateStatus::Slower | CandidateStatus::NotRun => ("slower".to_owned(), Tone::Faint),
    }
}

fn proof(found: &SufficientTwin) -> Vec<String> {
    let Some(proof) = &found.scene else {
        return Vec::new();
    };
    let mut lines = vec![
        String::new(),
        format!("  {}", styled(BOLD, "proof of omission")),
    ];
    let scene = if proof.holds() {
        format!(
            "{} signals were put back; the {} kept ones are the same bit for bit, as they must be, \
             and so are all margins",
            proof.put_back, proof.kept
        )
    } else {
        let changed = [&proof.changed_signals[..], &proof.changed_expectations[..]].concat();
        styled(RED, &format!("it changes {}", changed.join(", ")))
    };
    lines.push(format!("    scene: {scene}"));
    for [parts, why] in left_out::lines(&proof.left_out) {
        lines.push(format!(
            "      {} {}",
            escaped(&parts),
            styled(DIM, &format!("({why})"))
        ));
    }
    let model = match &found.left_out_of_model[..] {
        [] => "that of the reference; nothing is left out".to_owned(),
        parts => format!(
            "left out are {}; put back by the reference, they change no verdict, and the margins \
             by the errors above",
            parts.join(", ")
        ),
    };
    lines.push(format!("    model: {model}"));
    let passes = if proof.passes() { "passes" } else { "fails" };
    lines.push(format!("    the run of the choice {passes}"));
    lines
}
