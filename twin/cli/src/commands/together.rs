//! `twin run` with several plants: a run with each, or a run with the first and its end with each of the others; and how they
//! differ, footstep by footstep.

use std::path::Path;

use serde::Serialize;
use twinrig_kernel::{SimTime, Snapshot};

use super::Terminal;
use super::compare::{Bounds, EventDifference};
use super::diff::{NOTHING, open};
use super::run::{Session, error_of};
use crate::args::RunArgs;
use crate::assembly::Assembly;
use crate::error::{TwinError, guarded};
use crate::report::{Report, Status, seconds};
use crate::run::continuation::{Continuation, go_on};
use crate::run::execute::execute_saving;
use crate::run::interrupt;

/// The scenario of several plants.
pub(super) struct Together<'s, 'a> {
    session: &'s mut Session<'a>,
    path: &'s Path,
}

/// Two plants that were run, of whom the second is compared with the first.
struct Pair<'p> {
    scenario: &'p str,
    plants: [&'p str; 2],
    recordings: [Option<&'p str>; 2],
    end: Option<&'p Continuation>,
}

/// A comparison as it is printed for programs, apart from the reports of runs.
#[derive(Serialize)]
struct Written<'p> {
    comparison: Compared<'p>,
}

#[derive(Serialize)]
struct Compared<'p> {
    scenario: &'p str,
    plant_a: &'p str,
    plant_b: &'p str,
    recording_a: Option<&'p str>,
    recording_b: Option<&'p str>,
    /// From when on b goes on from a; none if both ran from the start.
    from_s: Option<f64>,
    /// What b could not take over.
    not_taken_over: &'p [String],
    /// Of b, where it went on.
    fingerprint_b: Option<&'p str>,
    /// Why there is no comparison, or why b did not come to the end.
    error: Option<String>,
    #[serde(flatten)]
    difference: Option<EventDifference>,
}

/// Whether several plants, and a time from which they go on, can be had with what else is wanted.
pub(super) fn check(args: &RunArgs) -> Result<(), TwinError> {
    let refused = |why: &str, help: &str| {
        let (why, help) = (why.to_owned(), help.to_owned());
        Err(TwinError::Together { why, help })
    };
    let ending = args.out.extension();
    if ending.is_some_and(|ending| ending.eq_ignore_ascii_case("mcap")) {
        return refused(
            &format!(
                "--out {} looks like a file, and is the folder that recordings go to",
                args.out.display()
            ),
            "name a folder: --out recordings; the files in it are named after the scenario",
        );
    }
    if args.plant.len() < 2 {
        if args.from.is_some() {
            let help = "name both: --plant lcp --plant massless --from \"3 s\"";
            return refused(
                "--from puts one plant where another is, and wants two of them",
                help,
            );
        }
        return Ok(());
    }
    if args.no_record {
        return refused(
            "several plants are compared by their recordings, and --no-record makes none",
            "leave it out, or name one plant",
        );
    }
    if !args.port.is_empty() {
        return refused(
            "at hardware there is no plant to choose",
            "leave out --plant, or --port",
        );
    }
    if let Some(plant) = twice(args) {
        return refused(
            &format!("the plant `{plant}` is named twice, and the same run differs in nothing"),
            "name each once; what the same plant does with other settings is another run: compare its recording with \
             `twin diff --events A B`",
        );
    }
    Ok(())
}

/// A plant that is named twice. With `--from` the first may go on from itself: that shows what going on does.
fn twice(args: &RunArgs) -> Option<&String> {
    let named = &args.plant[usize::from(args.from.is_some())..];
    let mut each = named.iter().enumerate();
    each.find_map(|(i, plant)| named[..i].contains(plant).then_some(plant))
}

impl<'s, 'a> Together<'s, 'a> {
    pub(super) fn new(session: &'s mut Session<'a>, path: &'s Path) -> Self {
        Self { session, path }
    }

    /// Runs and compares; the exit code of what is no report.
    pub(super) fn run(&mut self, terminal: &mut Terminal<'_>) -> u8 {
        // Before anything runs: what one of them lacks is not told after minutes of another.
        for plant in &self.session.args.plant {
            if let Err(error) = self.session.assembly(self.path, Some(plant)) {
                let report = error_of(self.path, &error);
                self.session.show(report, terminal);
                return Status::Error.exit_code();
            }
        }
        match self.session.args.from {
            None => self.together(terminal),
            Some(from) => self.apart_from(SimTime::ZERO + from, terminal),
        }
    }

    fn together(&mut self, terminal: &mut Terminal<'_>) -> u8 {
        let begun = self.session.reports.len();
        let args = self.session.args;
        for plant in &args.plant {
            let report = self.session.whole(self.path, Some(plant), terminal);
            self.session.show(report, terminal);
            if interrupt::asked() {
                return Status::Pass.exit_code();
            }
        }
        let reports = &self.session.reports[begun..];
        let mut worst = Status::Pass.exit_code();
        let Some((first, others)) = reports.split_first() else {
            return worst;
        };
        for (other, plant) in others.iter().zip(&args.plant[1..]) {
            let pair = Pair {
                scenario: &first.scenario,
                plants: [&args.plant[0], plant],
                recordings: [first.recording.as_deref(), other.recording.as_deref()],
                end: None,
            };
            worst = worst.max(show(&pair, None, args.json, terminal));
        }
        worst
    }

    /// Runs the first plant, and each of the others from where it is at `from`.
    fn apart_from(&mut self, from: SimTime, terminal: &mut Terminal<'_>) -> u8 {
        let args = self.session.args;
        let error = Status::Error.exit_code();
        let begun = self.begin(from, terminal);
        let (first, report, saved) = match begun {
            Ok(begun) => begun,
            Err(error) => {
                let report = error_of(self.path, &error);
                self.session.show(report, terminal);
                return Status::Error.exit_code();
            }
        };
        let (scenario, recording) = (report.scenario.clone(), report.recording.clone());
        self.session.show(report, terminal);
        let Some(saved) = saved else {
            // Its report says why it did not come so far.
            return error;
        };
        let mut worst = Status::Pass.exit_code();
        for plant in &args.plant[1..] {
            if interrupt::asked() {
                return error;
            }
            let ended = self.end(&first, plant, from, &saved, terminal);
            let mut pair = Pair {
                scenario: &scenario,
                plants: [&args.plant[0], plant],
                recordings: [recording.as_deref(), None],
                end: None,
            };
            let code = match &ended {
                Ok(end) => {
                    pair.recordings[1] = end.report.recording.as_deref();
                    pair.end = Some(end);
                    show(&pair, Some(from), args.json, terminal)
                }
                Err(error) => {
                    terminal_error(&pair, from, error, args.json, terminal);
                    Status::Error.exit_code()
                }
            };
            worst = worst.max(code);
        }
        worst
    }

    /// The run of the first plant, and the rig at `from`.
    fn begin(
        &mut self,
        from: SimTime,
        terminal: &mut Terminal<'_>,
    ) -> Result<(Assembly<'a>, Report, Option<Snapshot>), TwinError> {
        let first = self
            .session
            .assembly(self.path, self.session.args.plant.first())?;
        if from >= first.end() {
            return Err(TwinError::Together {
                why: format!(
                    "at {from} nothing is left of a run that ends at {}",
                    first.end()
                ),
                help: "an earlier --from, or a longer `duration`".to_owned(),
            });
        }
        self.session.warn(&first, terminal);
        let execution = self.session.execution(&first, "", terminal);
        let (report, saved) = guarded(&first.scenario().file, || {
            execute_saving(&first, &execution, first.end(), Some(from))
        })?;
        Ok((first, report, saved))
    }

    /// What another plant does from there on.
    fn end(
        &mut self,
        first: &Assembly<'_>,
        plant: &String,
        from: SimTime,
        saved: &Snapshot,
        terminal: &Terminal<'_>,
    ) -> Result<Continuation, TwinError> {
        let other = self.session.assembly(self.path, Some(plant))?;
        let begun = &first.scenario().plant.model;
        let mark = format!("-from-{begun}-{}s", seconds(from.as_nanos()));
        let execution = self.session.execution(&other, &mark, terminal);
        guarded(&other.scenario().file, || {
            go_on(first, &other, saved, &execution)
        })
    }
}

/// Compares a pair and prints it; 2 if that cannot be done, or the second did not come to its end and has no report that says
/// so.
fn show(pair: &Pair<'_>, from: Option<SimTime>, json: bool, terminal: &mut Terminal<'_>) -> u8 {
    let [Some(a), Some(b)] = pair.recordings else {
        let missing = TwinError::Together {
            why: format!(
                "{} and {} are not compared: one has no recording",
                pair.plants[0], pair.plants[1]
            ),
            help: "its own error says why".to_owned(),
        };
        written(pair, from, None, Some(missing.to_string()), json, terminal);
        return Status::Error.exit_code();
    };
    let compared = open(Path::new(a)).and_then(|a| {
        let b = open(Path::new(b))?;
        EventDifference::of(&a, &b, Bounds::default())
    });
    let (difference, error) = match compared {
        Ok(difference) => (Some(difference), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let nothing = || difference.as_ref()?.nothing.then(|| NOTHING.to_owned());
    let error = error
        .or_else(|| pair.end?.report.error.clone())
        .or_else(nothing);
    let code = if error.is_some() {
        Status::Error
    } else {
        Status::Pass
    };
    written(pair, from, difference, error, json, terminal);
    code.exit_code()
}

/// Prints that a plant could not be put where another is.
fn terminal_error(
    pair: &Pair<'_>,
    from: SimTime,
    error: &TwinError,
    json: bool,
    terminal: &mut Terminal<'_>,
) {
    written(
        pair,
        Some(from),
        None,
        Some(error.to_string()),
        json,
        terminal,
    );
}

fn written(
    pair: &Pair<'_>,
    from: Option<SimTime>,
    difference: Option<EventDifference>,
    error: Option<String>,
    json: bool,
    terminal: &mut Terminal<'_>,
) {
    let from_s = from.map(|from| seconds(from.as_nanos()));
    let lost = pair.end.map_or(&[][..], |end| &end.lost);
    let [a, b] = pair.plants;
    if json {
        terminal.print_json(&Written {
            comparison: Compared {
                scenario: pair.scenario,
                plant_a: a,
                plant_b: b,
                recording_a: pair.recordings[0],
                recording_b: pair.recordings[1],
                from_s,
                not_taken_over: lost,
                fingerprint_b: pair.end.and_then(|end| end.report.fingerprint.as_deref()),
                error,
                difference,
            },
        });
        return;
    }
    let heading = match from_s {
        None => format!("{}: {b} against {a}", pair.scenario),
        Some(at) => format!(
            "{}: {b} goes on from {a} at {at} s, and is compared with it",
            pair.scenario
        ),
    };
    let mut lines = vec![terminal.paint.bold(&heading)];
    lines.extend(lost.iter().map(|line| format!("  not taken over: {line}")));
    if let (Some(_), Some(recording)) = (pair.end, pair.recordings[1]) {
        lines.push(format!("  recorded in {recording}"));
    }
    if let Some(error) = &error {
        lines.extend(
            error
                .lines()
                .map(|line| format!("  {}", terminal.paint.red(line))),
        );
    }
    if let Some(difference) = &difference {
        lines.push(format!("  a is {a}, b is {b}"));
        let text = difference.text(terminal.paint);
        lines.extend(text.lines().map(|line| {
            if line.is_empty() {
                String::new()
            } else {
                format!("  {line}")
            }
        }));
    }
    terminal.print(&lines.join("\n"));
    terminal.print("");
}
