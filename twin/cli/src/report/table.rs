//! Text form of reports.

use std::fmt::Write as _;

use anstyle::Style;
use twinrig_campaign::spread::EnsembleKind;
use twinrig_document::escaped;
use twinrig_kernel::SimTime;
use twinrig_scenario::{Outcome, Verdict};

use crate::report::left_out;
use twinrig_report::comparison::{Comparison, Shown};
use twinrig_report::number::percent;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{BOLD, DIM, GREEN, RED, YELLOW, styled};
use twinrig_rig::report::bound::sign;
use twinrig_rig::report::{Line, LineEnsemble, Report, Status, recording_s};

use super::{against, error_bar, tracking};

/// Maximum width of the values of facts.
const WIDTH: usize = 100;

/// Returns the report of a scenario.
pub fn report(report: &Report) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{}", heading(report));
    let _ = writeln!(out);
    // The cause stands above what it left unobserved.
    if let Some(error) = &report.error {
        for line in error.lines() {
            let _ = writeln!(out, "  {}", styled(RED, line));
        }
        let _ = writeln!(out);
    }
    if let Some(line) = against::first(report) {
        let _ = writeln!(out, "  {}\n", styled(YELLOW, &line));
    }
    let (seen, cut) = (expectations(report), cut_short(report));
    let lines = seen.lines(2).into_iter().chain(cut.lines(2));
    let lines: Vec<String> = lines.collect();
    for line in &lines {
        let _ = writeln!(out, "{line}");
    }
    if !lines.is_empty() {
        let _ = writeln!(out);
    }
    let _ = writeln!(out, "  {}", verdict(report));
    for warning in report.run_warnings() {
        let _ = writeln!(
            out,
            "  {}  {}",
            styled(YELLOW, "warning"),
            escaped(&warning)
        );
    }
    for line in facts(report).lines(2) {
        let _ = writeln!(out, "{line}");
    }
    if let Some(real_time) = &report.real_time {
        let _ = writeln!(out);
        for note in &real_time.notes {
            let _ = writeln!(out, "  note: {}", escaped(note));
        }
        for line in real_time.times.to_string().lines() {
            let _ = writeln!(out, "  {}", styled(DIM, line));
        }
    }
    out
}

/// Returns a summary with one row per report.
pub fn summary(reports: &[Report]) -> String {
    let mut grid = Grid::new(&[Left, Left, Left, Right, Left, Right, Left]);
    // The plant is shown for scenarios that were run with several plants.
    let several = |report: &Report| {
        let same_file = reports.iter().filter(|other| other.file == report.file);
        same_file
            .into_iter()
            .any(|other| other.plant != report.plant)
    };
    for report in reports {
        let plant = report.plant.as_deref().filter(|_| several(report));
        let count = report.expectations.len();
        let held = if count == 0 {
            String::new()
        } else {
            format!("{} of {count} hold", report.held())
        };
        let style = status_style(report.verdict);
        let failure = first_failure(report).unwrap_or_default();
        grid.row([
            Cell::new(report.verdict.word(), style),
            report.scenario.as_str().into(),
            plant.unwrap_or_default().into(),
            held.into(),
            "".into(),
            speed(report).unwrap_or_default().into(),
            Cell::new(failure, DIM),
        ]);
    }
    let mut out = String::new();
    for line in grid.lines(2) {
        let _ = writeln!(out, "{line}");
    }
    out
}

/// Returns the error, or else the name of the first expectation that fails or is undecided.
fn first_failure(report: &Report) -> Option<String> {
    if let Some(error) = &report.error {
        return error.lines().next().map(str::to_owned);
    }
    let mut lines = report.expectations.iter();
    let failed = lines.clone().find(|line| !line.holds());
    let failed = failed.map(|line| line.outcome.name.clone());
    let open = lines.find(|line| line.is_undecided());
    let open = || Some(format!("{}: undecided", open?.outcome.name));
    failed
        .or_else(open)
        .or_else(|| report.strict.as_ref()?.first().cloned())
}

fn status_style(status: Status) -> Style {
    match status {
        Status::Pass => GREEN,
        Status::Fail => RED,
        Status::Error => YELLOW,
    }
}

fn heading(report: &Report) -> String {
    let mut heading = styled(BOLD, &report.scenario);
    let plant = report.plant.as_deref();
    let details: Vec<String> = [
        plant.map(|plant| match report.constraints {
            Some(constraints) => format!("{plant} plant, {constraints} constraints"),
            None => format!("{plant} plant"),
        }),
        report.seed.map(|seed| format!("seed {seed}")),
        (report.file != report.scenario).then(|| report.file.clone()),
    ]
    .into_iter()
    .flatten()
    .collect();
    if !details.is_empty() {
        let _ = write!(heading, "  {}", styled(DIM, &details.join(" · ")));
    }
    heading
}

fn verdict(report: &Report) -> String {
    let count = report.expectations.len();
    let text = match count {
        0 => "no expectations".to_owned(),
        1 => format!("{} of 1 expectation holds", report.held()),
        _ => format!("{} of {count} expectations hold", report.held()),
    };
    let text = match &report.against {
        Some(against) if !against.same => format!("{text}; the run differs from its baseline"),
        _ => text,
    };
    let text = match report.undecided() {
        0 => text,
        undecided => format!("{text}; {undecided} undecided within their numerical error"),
    };
    let text = match &report.strict {
        Some(reasons) if !reasons.is_empty() => {
            let (count, plural) = (reasons.len(), if reasons.len() == 1 { "" } else { "s" });
            format!("{text}; a strict run fails by {count} warning{plural}")
        }
        _ => text,
    };
    let word = styled(status_style(report.verdict), report.verdict.word());
    format!("{word}  {text}")
}

fn expectations(report: &Report) -> Grid {
    let sides = [Left, Left, Right, Left, Left, Right, Left, Right, Left];
    let mut grid = Grid::new(&sides);
    let lines = report.expectations.iter().enumerate();
    let mut lines = lines.filter(|(_, line)| !line.cut_short);
    let Some(first) = lines.next() else {
        return grid;
    };
    grid.header("| expectation | measured | | | bound | | margin |");
    for (index, line) in std::iter::once(first).chain(lines) {
        let outcome = &line.outcome;
        let before = against::before(report, index).map(|value| shown(outcome).with_unit(value));
        let remarks = [
            before.map(|before| format!("baseline: {before}")),
            Some(line_remark(line, report.recording.is_some())).filter(|it| !it.is_empty()),
        ];
        let remarks: Vec<String> = remarks.into_iter().flatten().collect();
        let (mark, style) = mark(line);
        let shown = shown(outcome);
        let number =
            |value: Option<f64>| value.map(|value| shown.number(value)).unwrap_or_default();
        let bad = if outcome.holds() { Style::new() } else { style };
        grid.row([
            Cell::new(mark, style),
            outcome.name.as_str().into(),
            Cell::new(number(outcome.measured), bad),
            error_bar::text(line, &shown).into(),
            Cell::new(sign(outcome), DIM),
            number(outcome.bound).into(),
            shown.symbol.into(),
            Cell::new(number(outcome.margin), bad),
            Cell::new(remarks.join("; "), DIM),
        ]);
    }
    grid
}

/// Returns the expectations that the end of the run left unobserved, in one paragraph.
fn cut_short(report: &Report) -> Grid {
    let mut grid = Grid::new(&[Left, Left]);
    let lines = report.expectations.iter().filter(|line| line.cut_short);
    let names: Vec<&str> = lines.map(|line| line.outcome.name.as_str()).collect();
    if !names.is_empty() {
        let text = format!("unobserved by that: {}", names.join(", "));
        grid.paragraph(Cell::new("?", RED), &text.into(), WIDTH);
    }
    grid
}

fn mark(line: &Line) -> (&'static str, Style) {
    match (line.outcome.verdict, line.holds()) {
        _ if line.is_undecided() => ("~", YELLOW),
        (Verdict::Pass, true) => ("✓", GREEN),
        (Verdict::Pass, false) | (Verdict::Fail, _) => ("✗", RED),
        (Verdict::Unobserved, true) => ("–", YELLOW),
        (Verdict::Unobserved, false) => ("?", RED),
    }
}

/// Returns the remark on an outcome. Of a failure it also has the instant as the recording has it,
/// if there is one.
fn remark(outcome: &Outcome, recorded: bool) -> String {
    let fails = outcome.verdict == Verdict::Fail;
    let in_recording = |at: SimTime| {
        let text = format!(" ({:.3} s in the recording)", recording_s(at));
        if recorded && fails {
            text
        } else {
            String::new()
        }
    };
    let mut detail = outcome.detail.clone();
    if let (None, Some(at)) = (outcome.first_violation, outcome.witness.at)
        && detail.ends_with(&format!("at {:.3} s", at.as_secs_f64()))
    {
        detail += &in_recording(at);
    }
    if let (Some(bound), Some(other)) = (outcome.bound, outcome.other_bound) {
        let shown = shown(outcome);
        let (least, greatest) = (
            shown.number(bound.min(other)),
            shown.number(bound.max(other)),
        );
        let range = format!("required: {least} … {greatest}");
        detail = match detail.as_str() {
            "" => range,
            detail => format!("{range}, {detail}"),
        };
    }
    let head = match (outcome.verdict, outcome.first_violation) {
        (Verdict::Unobserved, _) => "unobserved: ".to_owned(),
        (_, Some(at)) => {
            let recording = in_recording(at);
            format!("first at {:.3} s{recording}, ", at.as_secs_f64())
        }
        _ => return detail,
    };
    if detail.is_empty() {
        head.trim_end_matches([':', ',', ' ']).to_owned()
    } else {
        head + &detail
    }
}

/// Returns the format of the numbers of an outcome.
fn shown(outcome: &Outcome) -> Shown<'static> {
    let comparison = Comparison {
        measured: outcome.measured,
        bound: outcome.bound,
        other_bound: outcome.other_bound,
        margin: outcome.margin,
    };
    Shown::of(&comparison, outcome.unit.symbol())
}

/// Returns the remark on an outcome, after that on the ensemble.
fn line_remark(line: &Line, recorded: bool) -> String {
    let ensemble = line.ensemble.as_ref();
    let remarks = [
        error_bar::remark(line),
        ensemble.map(|ensemble| ensemble_remark(&line.outcome, ensemble)),
        Some(remark(&line.outcome, recorded)).filter(|it| !it.is_empty()),
    ];
    let remarks: Vec<String> = remarks.into_iter().flatten().collect();
    remarks.join("; ")
}

/// Returns the share of the runs of an ensemble, and their least margin.
fn ensemble_remark(outcome: &Outcome, ensemble: &LineEnsemble) -> String {
    let spread = &ensemble.spread;
    let mut text = format!("holds in {} of {} runs", spread.held, spread.runs);
    if ensemble.differ_by == EnsembleKind::Parameters {
        let [low, high] = [spread.interval.low, spread.interval.high].map(percent);
        let _ = write!(text, " (95 %: {low} … {high})");
    }
    if let Some(margins) = spread.margins {
        let shown = shown(&Outcome {
            margin: Some(margins.min),
            ..outcome.clone()
        });
        let least = shown.number(margins.min);
        let _ = write!(text, ", least margin {least} {}", shown.symbol);
    }
    text.trim_end().to_owned()
}

/// Returns a line of a report in one line of text.
pub fn line_sentence(line: &Line, recorded: bool) -> String {
    let ensemble = line.ensemble.as_ref();
    let failed = ensemble.filter(|ensemble| !ensemble.holds());
    let parts = [
        line.is_undecided()
            .then(|| error_bar::sentence(line, &shown(&line.outcome))),
        failed.map(|ensemble| ensemble_remark(&line.outcome, ensemble)),
        (!line.outcome.holds() || failed.is_none() && !line.is_undecided())
            .then(|| sentence(&line.outcome, recorded)),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    parts.join("; ")
}

/// Returns an outcome in one line.
pub fn sentence(outcome: &Outcome, recorded: bool) -> String {
    let shown = shown(outcome);
    let mut parts = Vec::new();
    if let (Some(measured), Some(bound)) = (outcome.measured, outcome.bound) {
        let (measured, bound) = (shown.number(measured), shown.number(bound));
        let sign = sign(outcome);
        let unit = match shown.symbol {
            "" => String::new(),
            symbol => format!(" {symbol}"),
        };
        parts.push(format!("{measured}{unit} is not {sign} {bound}{unit}"));
    }
    let remark = remark(outcome, recorded);
    if !remark.is_empty() {
        parts.push(remark);
    }
    parts.join(", ")
}

/// Returns the random streams of a run as text; none without any.
fn random_streams(names: &[String]) -> Option<String> {
    let (first, others) = names.split_first()?;
    Some(match others.len() {
        0 => first.clone(),
        1 => format!("{first}, {}", others[0]),
        more => format!("{first} and {more} more streams"),
    })
}

/// Returns the real-time factor as text.
fn speed(report: &Report) -> Option<String> {
    let factor = report.real_time_factor?;
    let decimals = usize::from(factor < 10.0);
    Some(format!("{factor:.decimals$} × real time"))
}

/// Returns the number of fallbacks of the integrator; none if there were none.
fn integrator_fallbacks(report: &Report) -> Option<String> {
    let work = report.work.filter(|work| work.fallbacks > 0)?;
    let (times, steps) = (work.fallbacks, work.steps);
    let times = match times {
        1 => "once".to_owned(),
        _ => format!("{times} times"),
    };
    Some(format!(
        "fallback to another method or shorter steps {times} in {steps} steps"
    ))
}

/// Returns the lines of the parts that are left out: they may explain a failure, and are one line
/// where there is none.
fn left_out(report: &Report) -> Vec<String> {
    if report.verdict == Status::Pass {
        return left_out::summary(&report.left_out).into_iter().collect();
    }
    let lines = left_out::lines(&report.left_out);
    let text = |[parts, why]: [String; 2]| format!("{parts} ({why})");
    lines.into_iter().map(text).collect()
}

fn facts(report: &Report) -> Grid {
    let mut grid = Grid::new(&[Left, Left]);
    let mut fact = |name: &str, value: String| {
        grid.paragraph(Cell::new(name, DIM), &value.into(), WIDTH);
    };
    if let (Some(simulated), Some(wall)) = (report.simulated_s, report.wall_s) {
        let speed = speed(report).map_or_else(String::new, |speed| format!(", {speed}"));
        fact(
            "time",
            format!("{simulated} s simulated in {wall:.3} s{speed}"),
        );
    }
    let mut ensembles = report
        .expectations
        .iter()
        .filter_map(|it| it.ensemble.as_ref());
    if let Some(ensemble) = ensembles.next() {
        let by = match ensemble.differ_by {
            EnsembleKind::Starts => "from perturbed starts",
            EnsembleKind::Seeds => "with other seeds",
            EnsembleKind::Parameters => "with other values of the fit",
        };
        let others = match ensemble.differ_by {
            EnsembleKind::Parameters => ensemble.spread.runs,
            _ => ensemble.spread.runs - 1,
        };
        let share = percent(ensemble.required_share);
        fact(
            "ensemble",
            format!("{others} more runs {by}; required: {share} of all runs"),
        );
    }
    if let Some(text) = report.random.as_deref().and_then(random_streams) {
        fact("random", text);
    }
    if let Some(at) = report.fell_at_s {
        let ended = report.simulated_s.is_some_and(|simulated| simulated <= at);
        let end = if ended { ", which ended the run" } else { "" };
        fact("fall", format!("at {at} s{end}"));
    }
    // A plant without an energy balance exchanges nothing.
    if let Some(energy) = report.energy.filter(|energy| energy.exchanged_j > 0.0) {
        let (residual, exchanged) = (energy.residual_j, energy.exchanged_j);
        let exchanged = if exchanged < 1.0 {
            format!("{exchanged:.1e}")
        } else {
            format!("{exchanged:.1}")
        };
        fact(
            "energy",
            format!("{exchanged} J exchanged, {residual:.1e} J unaccounted for"),
        );
    }
    if let Some(text) = tracking::numbers(report.tracking.as_ref()) {
        fact("gait", text);
    }
    for (n, text) in tracking::lines(report.tracking.as_ref())
        .into_iter()
        .enumerate()
    {
        fact(if n == 0 { "tracking" } else { "" }, text);
    }
    for bus in &report.buses {
        fact(&format!("bus {}", bus.bus.name), bus.line());
    }
    if let Some(fallbacks) = integrator_fallbacks(report) {
        fact("integrator", fallbacks);
    }
    for (n, text) in left_out(report).into_iter().enumerate() {
        fact(if n == 0 { "left out" } else { "" }, text);
    }
    for (n, text) in against::facts(report).into_iter().enumerate() {
        fact(if n == 0 { "baseline" } else { "" }, text);
    }
    if let Some(path) = &report.recording {
        fact("recording", path.clone());
    }
    if let Some(path) = &report.page {
        fact("page", path.clone());
    }
    if let Some(fingerprint) = &report.fingerprint {
        fact("fingerprint", fingerprint.clone());
    }
    grid
}

#[cfg(test)]
mod tests;
