//! Verdicts as `JUnit` XML, for CI systems.
//!
//! A document is valid by both schemas that CI systems use: that of Jenkins (xunit-plugin,
//! junit-10.xsd) and that of Ant (windyroad/JUnit-Schema, JUnit.xsd). Neither has a place for file
//! and line of a test case: the text of a failure begins with them, as compilers write them.

use std::fmt::Write as _;

use twinrig_document::escape_xml;
use twinrig_experiment::shell::quoted;
use twinrig_rig::report::{Line, Report};
use twinrig_scenario::Verdict;

use super::{against, tracking};
use crate::date::{now, timestamp};
use crate::report::table;

/// Suite of test cases.
pub(crate) struct Suite {
    /// Name; equal names in one document become distinct.
    pub(crate) name: String,
    /// Properties, by name.
    pub(crate) properties: Vec<(&'static str, String)>,
    /// Wall time \[s\].
    pub(crate) time_s: f64,
    pub(crate) cases: Vec<Case>,
    /// Text for readers.
    pub(crate) output: String,
}

/// Test case.
pub(crate) struct Case {
    /// Name; equal names in one suite become distinct.
    pub(crate) name: String,
    /// None if it passes.
    pub(crate) problem: Option<CaseProblem>,
}

/// Result of a test case that does not pass.
pub(crate) struct CaseProblem {
    pub(crate) kind: ProblemKind,
    /// Identifier of the kind of failure: `always`, `stride_length`.
    pub(crate) of_type: String,
    pub(crate) message: String,
    /// Longer text.
    pub(crate) text: String,
}

/// Kind of the result of a test case that does not pass.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ProblemKind {
    Failure,
    Error,
    Skipped,
}

impl ProblemKind {
    fn element(self) -> &'static str {
        match self {
            Self::Failure => "failure",
            Self::Error => "error",
            Self::Skipped => "skipped",
        }
    }
}

impl Case {
    /// Returns a test case that passes.
    pub(crate) fn passed(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            problem: None,
        }
    }

    /// Returns a test case that does not pass.
    pub(crate) fn of(name: impl Into<String>, problem: CaseProblem) -> Self {
        Self {
            name: name.into(),
            problem: Some(problem),
        }
    }
}

/// Returns the document with one test suite per report and one test case per expectation. `options`
/// are those of the command, which repeats a run.
pub fn document(reports: &[Report], options: &[String]) -> String {
    let suites: Vec<Suite> = reports
        .iter()
        .map(|report| Suite {
            output: output(report, options),
            ..suite(report, reports)
        })
        .collect();
    written(&suites)
}

/// Returns the suite of a report; with its plant in the name if the scenario ran on several.
fn suite(report: &Report, all: &[Report]) -> Suite {
    let mut same = all.iter().filter(|other| other.scenario == report.scenario);
    let on_several = same.any(|other| other.plant != report.plant);
    let name = match &report.plant {
        Some(plant) if on_several => format!("{} on {plant}", report.scenario),
        _ => report.scenario.clone(),
    };
    let recorded = report.recording.is_some();
    let mut cases: Vec<Case> = Vec::new();
    // The cause stands before what follows from it.
    if let Some(error) = &report.error {
        let problem = CaseProblem {
            kind: ProblemKind::Error,
            of_type: "run".to_owned(),
            message: error.lines().next().unwrap_or_default().to_owned(),
            text: error.clone(),
        };
        cases.push(Case::of("runs to its end", problem));
    }
    if let Some(against) = &report.against {
        let name = "equals its baseline (--against)";
        cases.push(match against::failure(report) {
            None => Case::passed(name),
            Some(message) => Case::of(
                name,
                CaseProblem {
                    kind: ProblemKind::Failure,
                    of_type: "baseline".to_owned(),
                    message,
                    text: against.differences.join("\n"),
                },
            ),
        });
    }
    let lines = report.expectations.iter();
    cases.extend(lines.map(|line| case(line, recorded)));
    if let Some(reasons) = &report.strict {
        let name = "has no warnings (--strict)";
        cases.push(match reasons.as_slice() {
            [] => Case::passed(name),
            [first, ..] => {
                let problem = CaseProblem {
                    kind: ProblemKind::Failure,
                    of_type: "strict".to_owned(),
                    message: first.clone(),
                    text: reasons.join("\n"),
                };
                Case::of(name, problem)
            }
        });
    }
    let texts = [
        ("file", Some(report.file.clone())),
        ("plant", report.plant.clone()),
        ("seed", report.seed.map(|seed| seed.to_string())),
        ("fingerprint", report.fingerprint.clone()),
        ("recording", report.recording.clone()),
        ("page", report.page.clone()),
    ];
    let properties = texts
        .into_iter()
        .filter_map(|(key, text)| Some((key, text?)));
    Suite {
        name,
        properties: properties.collect(),
        time_s: report.wall_s.unwrap_or(0.0),
        cases,
        output: String::new(),
    }
}

/// Returns what the table of a run has beside its expectations, and the command that repeats it.
fn output(report: &Report, options: &[String]) -> String {
    let warnings = report.run_warnings().into_iter();
    let warnings = warnings.map(|text| format!("warning: {text}\n"));
    let tracking = tracking::lines(report.tracking.as_ref()).into_iter();
    let tracking = tracking.map(|text| format!("tracking: {text}\n"));
    let buses = report.buses.iter();
    let buses = buses.map(|bus| format!("bus {}: {}\n", bus.bus.name, bus.line()));
    let plant = report.plant.iter().map(|plant| format!("--plant {plant}"));
    let words = std::iter::once(format!("twin run {}", quoted(&report.file)));
    let words: Vec<String> = words.chain(plant).chain(options.iter().cloned()).collect();
    // A text from standard input is gone.
    let repeat = (!report.file.starts_with('<')).then(|| format!("repeat: {}\n", words.join(" ")));
    warnings
        .chain(tracking)
        .chain(buses)
        .chain(repeat)
        .collect()
}

fn case(line: &Line, recorded: bool) -> Case {
    let outcome = &line.outcome;
    let name = outcome.name.as_str();
    let kind = match (outcome.verdict, line.holds()) {
        _ if line.is_undecided() => ProblemKind::Failure,
        (Verdict::Pass, true) => return Case::passed(name),
        // Of a run that an error ended, the error is the failure.
        (_, holds) if holds || line.cut_short => ProblemKind::Skipped,
        _ => ProblemKind::Failure,
    };
    let message = table::line_sentence(line, recorded);
    let (file, at) = (&outcome.place.source().name, outcome.place.line());
    let text = format!("{file}:{at}: {name}: {message}");
    let of_type = match outcome.verdict {
        _ if line.is_undecided() => "undecided",
        Verdict::Unobserved => "unobserved",
        Verdict::Pass | Verdict::Fail => outcome.subject,
    };
    Case::of(
        name,
        CaseProblem {
            kind,
            of_type: of_type.to_owned(),
            message,
            text,
        },
    )
}

/// Returns the document of suites.
pub(crate) fn written(suites: &[Suite]) -> String {
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    let timestamp = timestamp(now());
    let names = distinct(suites.iter().map(|suite| suite.name.as_str()));
    for (id, (suite, name)) in suites.iter().zip(&names).enumerate() {
        write_suite(&mut out, suite, &escape_xml(name), id, &timestamp);
    }
    out.push_str("</testsuites>\n");
    out
}

fn write_suite(out: &mut String, suite: &Suite, name: &str, id: usize, timestamp: &str) {
    let count = |kind: ProblemKind| {
        let problems = suite.cases.iter().filter_map(|case| case.problem.as_ref());
        problems.filter(|problem| problem.kind == kind).count()
    };
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "  <testsuite name=\"{name}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" \
         time=\"{:.3}\" timestamp=\"{timestamp}\" hostname=\"localhost\" id=\"{id}\" package=\"twinrig\">",
        suite.cases.len(),
        count(ProblemKind::Failure),
        count(ProblemKind::Error),
        count(ProblemKind::Skipped),
        suite.time_s,
    );
    out.push_str("    <properties>\n");
    for (key, value) in &suite.properties {
        let _ = writeln!(
            out,
            "      <property name=\"{key}\" value=\"{}\"/>",
            escape_xml(value)
        );
    }
    out.push_str("    </properties>\n");
    // One run decides all cases: readers add their times up. Jenkins' schema has three decimals.
    let time = suite.time_s / suite.cases.len().max(1) as f64;
    let cases = distinct(suite.cases.iter().map(|case| case.name.as_str()));
    for (case, case_name) in suite.cases.iter().zip(&cases) {
        let _ = write!(
            out,
            "    <testcase classname=\"{name}\" name=\"{}\" time=\"{time:.3}\"",
            escape_xml(case_name)
        );
        let _ = match &case.problem {
            None => writeln!(out, "/>"),
            Some(problem) => {
                let element = problem.kind.element();
                writeln!(
                    out,
                    "><{element} message=\"{}\" type=\"{}\">{}</{element}></testcase>",
                    escape_xml(&problem.message),
                    escape_xml(&problem.of_type),
                    escape_xml(&problem.text)
                )
            }
        };
    }
    let _ = writeln!(
        out,
        "    <system-out>{}</system-out>\n    <system-err></system-err>\n  </testsuite>",
        escape_xml(&suite.output)
    );
}

/// Returns the names with a number behind those that occurred before, `name (2)`; an empty one
/// becomes `unnamed`.
fn distinct<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let mut distinct: Vec<String> = Vec::new();
    for name in names {
        let name = if name.trim().is_empty() {
            "unnamed"
        } else {
            name
        };
        let numbered = (2..).map(|number: u64| format!("{name} ({number})"));
        let mut candidates = std::iter::once(name.to_owned()).chain(numbered);
        let free = candidates.find(|candidate| !distinct.contains(candidate));
        distinct.extend(free);
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_become_distinct() {
        let names = ["roll", "roll", "roll (2)", "", "roll"];
        let expected = ["roll", "roll (2)", "roll (2) (2)", "unnamed", "roll (3)"];
        assert_eq!(distinct(names.into_iter()), expected);
    }
}
