//! Title, result and opening instant of a page.

use twinrig_record::{ExpectationMessage, VerdictMessage};

use crate::data::RunData;
use crate::incidents::{Incident, first_line};
use crate::judged::{decisive, fails};
use crate::pair::Compared;
use crate::run::Run;

/// Returns what is done to the second run and not to the first, in words.
pub(crate) fn done_to_b_alone(data: &[RunData]) -> Vec<String> {
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

/// Returns the title of a page.
pub(crate) fn title(runs: &[Run<'_>]) -> String {
    let names: Vec<&str> = runs.iter().map(Run::name).collect();
    match *names {
        [a, b] if a == b => format!("{a}, two runs"),
        _ => names.join(" and "),
    }
}

/// Returns the instant at which the page of a run opens \[s\]: its end by an error, or the first
/// decisive instant; none of a run that passes.
pub(crate) fn opening(run: &Run<'_>, verdict: &VerdictMessage) -> Option<f64> {
    if verdict.error.is_some() {
        return Some(run.end().as_secs_f64());
    }
    let failed = verdict.expectations.iter().filter(|it| fails(it));
    failed.filter_map(decisive).reduce(f64::min)
}

/// Returns the difference of two runs in a sentence, and the result of each run in one; `new` is
/// done to the second run alone.
pub(crate) fn headline(
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
    if verdict.verdict == "fail" && held == all.len() {
        return format!("FAIL: {counts}; it fails by a fall, or by warnings (--strict).");
    }
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
