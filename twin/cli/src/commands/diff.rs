//! Command `twin diff`: comparison of two recordings.

use std::path::Path;

use serde::Serialize;
use twinrig_document::escaped;
use twinrig_kernel::SimTime;
use twinrig_record::{Comparison, Divergence, Recording, VerdictMessage, divergence_within};

use super::compare::{Bounds, EventDifference};
use super::{FAILURE, NEGATIVE, SUCCESS, Terminal};
use crate::args::DiffArgs;
use crate::error::TwinError;
use twinrig_report::text::style::{BOLD, GREEN, RED, YELLOW, styled};
use twinrig_rig::error::Error;
use twinrig_rig::report::seconds;

/// First difference between two recordings, in its serialised form.
#[derive(Serialize)]
pub(super) struct Difference {
    /// All common samples and signals are equal.
    pub(super) identical: bool,
    /// The recordings have no common sample.
    pub(super) nothing: bool,
    signals: usize,
    equal_samples: u64,
    first: Option<First>,
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
    fingerprint_a: Option<String>,
    fingerprint_b: Option<String>,
    /// Ends of recordings that were truncated or whose runs were interrupted.
    cut_off_a_s: Option<f64>,
    cut_off_b_s: Option<f64>,
}

/// Comparison, with the error if there is nothing to compare.
#[derive(Serialize)]
struct Compared<'d, D: Serialize> {
    #[serde(flatten)]
    difference: &'d D,
    error: Option<&'static str>,
}

#[derive(Serialize)]
struct First {
    time_s: f64,
    time_ns: u64,
    group: String,
    signal: String,
    component: usize,
    a: Option<f64>,
    b: Option<f64>,
}

pub(super) fn diff(args: &DiffArgs, terminal: &mut Terminal<'_>) -> u8 {
    if args.events {
        return by_events(args, terminal);
    }
    let opened = open(&args.a).and_then(|a| Ok((a, open(&args.b)?)));
    match opened {
        Ok((a, b)) => {
            let difference = Difference::of(&a, &b);
            if args.json {
                let error = difference.nothing.then_some(NO_COMMON_SAMPLE);
                terminal.print_json(&Compared {
                    difference: &difference,
                    error,
                });
            } else {
                let text = difference.text();
                terminal.print(&text);
            }
            code(difference.identical, difference.nothing)
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

/// Compares the recordings footstep by footstep.
fn by_events(args: &DiffArgs, terminal: &mut Terminal<'_>) -> u8 {
    let bounds = Bounds {
        time_s: args.time.as_secs_f64(),
        place_m: args.place,
        share: args.share,
    };
    let compared = open(&args.a).and_then(|a| EventDifference::of(&a, &open(&args.b)?, bounds));
    match compared {
        Ok(difference) => {
            if args.json {
                let error = difference.nothing.then_some(NO_COMMON_SAMPLE);
                terminal.print_json(&Compared {
                    difference: &difference,
                    error,
                });
            } else {
                let text = difference.text();
                terminal.print(&text);
            }
            code(difference.same, difference.nothing)
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

/// Returns the exit code of a comparison; a comparison without common samples is a failure.
fn code(same: bool, nothing: bool) -> u8 {
    match (nothing, same) {
        (true, _) => FAILURE,
        (false, true) => SUCCESS,
        (false, false) => NEGATIVE,
    }
}

/// Error of a comparison without common samples.
pub(super) const NO_COMMON_SAMPLE: &str =
    "error: the recordings have no sample of one signal in common";

/// Maximum number of names shown in a list.
const NAMED: usize = 6;

/// Returns the first of the names, and the number of the remaining ones.
pub(super) fn some_of(names: &[String]) -> String {
    let shown = names.iter().take(NAMED).map(String::as_str);
    let shown = escaped(&shown.collect::<Vec<_>>().join(", "));
    match names.len().saturating_sub(NAMED) {
        0 => shown,
        more => format!("{shown}, and {more} more"),
    }
}

pub(super) fn open(path: &Path) -> Result<Recording, TwinError> {
    Recording::open(path).map_err(|source| {
        TwinError::from(Error::Record {
            path: path.to_owned(),
            source,
        })
    })
}

/// Returns the end of a recording whose run was killed or interrupted; none for runs that completed
/// or failed.
pub(super) fn cut_off(recording: &Recording) -> Option<SimTime> {
    let Some(reached) = recording.reached() else {
        return Some(recording.last_sample().unwrap_or(SimTime::ZERO));
    };
    let verdicts = recording.messages::<VerdictMessage>();
    let interrupted = verdicts.is_ok_and(|all| all.iter().any(|(_, last)| last.interrupted));
    interrupted.then_some(reached)
}

impl Difference {
    pub(super) fn of(a: &Recording, b: &Recording) -> Self {
        Self::within(a, b, [cut_off(a), cut_off(b)])
    }

    /// Compares recordings that were cut off at the given times, if any.
    pub(super) fn within(
        a: &Recording,
        b: &Recording,
        [cut_off_a, cut_off_b]: [Option<SimTime>; 2],
    ) -> Self {
        let Comparison {
            first,
            signals,
            equal_samples,
            only_in_a,
            only_in_b,
        } = divergence_within(a, b, [cut_off_a.is_some(), cut_off_b.is_some()]);
        let first = first.map(
            |Divergence {
                 time,
                 group,
                 signal,
                 component,
                 a,
                 b,
             }| First {
                time_s: seconds(time.as_nanos()),
                time_ns: time.as_nanos(),
                group,
                signal,
                component,
                a,
                b,
            },
        );
        // Neither equality nor difference is established then.
        let nothing = first.is_none() && equal_samples == 0;
        Self {
            identical: first.is_none() && only_in_a.is_empty() && only_in_b.is_empty() && !nothing,
            nothing,
            signals,
            equal_samples,
            first,
            only_in_a,
            only_in_b,
            fingerprint_a: a.fingerprint().map(str::to_owned),
            fingerprint_b: b.fingerprint().map(str::to_owned),
            cut_off_a_s: cut_off_a.map(|at| seconds(at.as_nanos())),
            cut_off_b_s: cut_off_b.map(|at| seconds(at.as_nanos())),
        }
    }

    /// Returns the text form.
    pub(super) fn text(&self) -> String {
        let mut lines = Vec::new();
        match &self.first {
            None => {
                let ends: Vec<String> = [("a", self.cut_off_a_s), ("b", self.cut_off_b_s)]
                    .into_iter()
                    .filter_map(|(name, at)| Some(format!("{name} was cut off at {} s", at?)))
                    .collect();
                let word = match (self.equal_samples, ends.is_empty()) {
                    (0, _) => styled(YELLOW, "nothing to compare"),
                    (_, false) => styled(GREEN, "identical up to the cut-off"),
                    (_, true) => styled(GREEN, "equal"),
                };
                let mut parts = ends;
                parts.push(format!(
                    "{} common signals, {} samples, bit for bit",
                    self.signals, self.equal_samples
                ));
                lines.push(format!("{word}: {}", parts.join("; ")));
            }
            Some(first) => {
                let signal = styled(BOLD, &format!("{}[{}]", first.signal, first.component));
                let word = styled(RED, "different");
                lines.push(format!(
                    "{word} from {} s: {signal} ({}), after {} equal samples of {} common signals",
                    first.time_s, first.group, self.equal_samples, self.signals
                ));
                for (name, value) in [("a", first.a), ("b", first.b)] {
                    let value = value.map_or("no sample".to_owned(), |value| {
                        format!("{value:?}  (bits {:016x})", value.to_bits())
                    });
                    lines.push(format!("  {name}  {value}"));
                }
            }
        }
        for (name, only) in [("a", &self.only_in_a), ("b", &self.only_in_b)] {
            if !only.is_empty() {
                lines.push(format!("only in {name}: {}", some_of(only)));
            }
        }
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_list_shows_first_names_and_count_of_others() {
        let names: Vec<String> = (0..9).map(|i| format!("n{i}")).collect();
        assert_eq!(some_of(&names[..6]), "n0, n1, n2, n3, n4, n5");
        assert_eq!(some_of(&names), "n0, n1, n2, n3, n4, n5, and 3 more");
    }
}
