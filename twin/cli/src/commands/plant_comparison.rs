//! Command `twin run` with several plants: complete runs of all plants, or a run of the first and
//! continuations of it with the others; and the comparison of the runs footstep by footstep.

use std::path::Path;

use serde::Serialize;
use twinrig_kernel::{SimTime, Snapshot};

use super::Terminal;
use super::compare::{Bounds, EventDifference};
use super::diff::{NO_COMMON_SAMPLE, open};
use super::run::{Session, error_of};
use crate::args::RunArgs;
use crate::error::TwinError;
use crate::progress::RunLine;
use twinrig_report::text::style::{BOLD, RED, styled};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::{Error, guarded};
use twinrig_rig::report::{Report, Status, seconds};
use twinrig_rig::run::continuation::{Continuation, resume_with_plant};
use twinrig_rig::run::execute::execute_saving;
use twinrig_rig::run::interrupt;

/// Runs of a scenario with several plants.
pub(super) struct PlantComparison<'s, 'a> {
    session: &'s mut Session<'a>,
    path: &'s Path,
}

/// Runs of two plants, of which the second is compared with the first.
struct Pair<'p> {
    scenario: &'p str,
    plants: [&'p str; 2],
    recordings: [Option<&'p str>; 2],
    continuation: Option<&'p Continuation>,
}

/// Comparison in its serialised form, as distinguished from the reports of runs.
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
    /// Time at which b resumes from the state of a; none if both ran from the start.
    from_s: Option<f64>,
    /// Parts of the state of a that b could not resume.
    not_taken_over: &'p [String],
    /// Fingerprint of the continuation with b.
    fingerprint_b: Option<&'p str>,
    /// Error that prevented the comparison or ended the run of b prematurely.
    error: Option<String>,
    #[serde(flatten)]
    difference: Option<EventDifference>,
}

/// Checks that the options `--plant` and `--from` are compatible with the other options.
pub(super) fn check(args: &RunArgs) -> Result<(), TwinError> {
    let incompatible = |why: &str, help: &str| {
        let (why, help) = (why.to_owned(), help.to_owned());
        Err(TwinError::from(Error::InvalidOptions { why, help }))
    };
    let ending = args.out.extension();
    if ending.is_some_and(|ending| ending.eq_ignore_ascii_case("mcap")) {
        return incompatible(
            &format!(
                "--out {} has the extension of a file, but is the folder for recordings",
                args.out.display()
            ),
            "name a folder: --out recordings; the files in it are named after the scenario",
        );
    }
    if args.plant.len() < 2 {
        if args.from.is_some() {
            let help = "name two plants: --plant lcp --plant massless --from \"3 s\"";
            return incompatible(
                "--from resumes from the state of another plant and requires two plants",
                help,
            );
        }
        return Ok(());
    }
    if args.no_record {
        return incompatible(
            "several plants are compared by their recordings, which --no-record disables",
            "remove --no-record, or name one plant",
        );
    }
    if args.error_bars {
        return incompatible(
            "error bars are those of one plant",
            "name one --plant, or leave out --error-bars",
        );
    }
    if !args.port.is_empty() {
        return incompatible(
            "on hardware there is no plant to choose",
            "remove --plant or --port",
        );
    }
    if let Some(plant) = duplicate(args) {
        return incompatible(
            &format!("the plant `{plant}` is named twice, and equal runs do not differ"),
            "name each plant once; to compare different settings of one plant, run it twice and use \
             `twin diff --events A B`",
        );
    }
    Ok(())
}

/// Returns a plant that is named twice. With `--from` the first plant may be named again, to show
/// the effect of resuming.
fn duplicate(args: &RunArgs) -> Option<&String> {
    let named = &args.plant[usize::from(args.from.is_some())..];
    let mut each = named.iter().enumerate();
    each.find_map(|(i, plant)| named[..i].contains(plant).then_some(plant))
}

impl<'s, 'a> PlantComparison<'s, 'a> {
    pub(super) fn new(session: &'s mut Session<'a>, path: &'s Path) -> Self {
        Self { session, path }
    }

    /// Runs and compares the plants; returns the exit code of the comparisons, without the reports.
    pub(super) fn run(&mut self, terminal: &mut Terminal<'_>) -> u8 {
        // Errors of all plants are reported before the first run.
        for plant in &self.session.args.plant {
            if let Err(error) = self.session.assembly(self.path, Some(plant)) {
                let report = error_of(self.path, &error);
                self.session.show(report, terminal);
                return Status::Error.exit_code();
            }
        }
        match self.session.args.from {
            None => self.run_all(terminal),
            Some(from) => self.run_from(SimTime::ZERO + from, terminal),
        }
    }

    /// Runs all plants from the start.
    fn run_all(&mut self, terminal: &mut Terminal<'_>) -> u8 {
        let first_report = self.session.reports.len();
        let args = self.session.args;
        for plant in &args.plant {
            let report = self.session.run(self.path, Some(plant), terminal);
            self.session.show(report, terminal);
            if interrupt::is_requested() {
                return Status::Error.exit_code();
            }
        }
        let reports = &self.session.reports[first_report..];
        let mut worst = Status::Pass.exit_code();
        let Some((first, others)) = reports.split_first() else {
            return worst;
        };
        for (other, plant) in others.iter().zip(&args.plant[1..]) {
            let pair = Pair {
                scenario: &first.scenario,
                plants: [&args.plant[0], plant],
                recordings: [first.recording.as_deref(), other.recording.as_deref()],
                continuation: None,
            };
            worst = worst.max(compare(&pair, None, args.json, terminal));
        }
        worst
    }

    /// Runs the first plant, and continuations with the other plants from its state at `from`.
    fn run_from(&mut self, from: SimTime, terminal: &mut Terminal<'_>) -> u8 {
        let args = self.session.args;
        let error = Status::Error.exit_code();
        let (first, report, saved) = match self.run_first(from, terminal) {
            Ok(result) => result,
            Err(error) => {
                let report = error_of(self.path, &error);
                self.session.show(report, terminal);
                return Status::Error.exit_code();
            }
        };
        let (scenario, recording) = (report.scenario.clone(), report.recording.clone());
        self.session.show(report, terminal);
        let Some(saved) = saved else {
            // The report contains the reason.
            return error;
        };
        let mut worst = Status::Pass.exit_code();
        for plant in &args.plant[1..] {
            if interrupt::is_requested() {
                return error;
            }
            let continuation = self.continue_with(&first, plant, from, &saved, terminal);
            let mut pair = Pair {
                scenario: &scenario,
                plants: [&args.plant[0], plant],
                recordings: [recording.as_deref(), None],
                continuation: None,
            };
            let code = match &continuation {
                Ok(continuation) => {
                    pair.recordings[1] = continuation.report.recording.as_deref();
                    pair.continuation = Some(continuation);
                    compare(&pair, Some(from), args.json, terminal)
                }
                Err(error) => {
                    let error = Some(error.to_string());
                    print(&pair, Some(from), None, error, args.json, terminal);
                    Status::Error.exit_code()
                }
            };
            worst = worst.max(code);
        }
        worst
    }

    /// Runs the first plant; also returns the snapshot of the rig at `from`.
    fn run_first(
        &mut self,
        from: SimTime,
        terminal: &mut Terminal<'_>,
    ) -> Result<(Assembly<'a>, Report, Option<Snapshot>), TwinError> {
        let first = self
            .session
            .assembly(self.path, self.session.args.plant.first())?;
        if from >= first.end() {
            return Err(TwinError::from(Error::InvalidOptions {
                why: format!(
                    "--from {from} is not before the end of the run at {}",
                    first.end()
                ),
                help: "choose an earlier --from or a longer `duration`".to_owned(),
            }));
        }
        self.session.warn(&first, terminal);
        let execution = self.session.execution(&first, "");
        let mut line = RunLine::new(self.session.shows_progress(terminal));
        let (report, saved) = guarded(&first.scenario().file, || {
            let end = first.end();
            execute_saving(&first, &execution, end, Some(from), Some(&mut line))
        })?;
        Ok((first, report, saved))
    }

    /// Continues the run of the first plant with another plant from the snapshot.
    fn continue_with(
        &mut self,
        first: &Assembly<'_>,
        plant: &String,
        from: SimTime,
        saved: &Snapshot,
        terminal: &Terminal<'_>,
    ) -> Result<Continuation, TwinError> {
        let other = self.session.assembly(self.path, Some(plant))?;
        let origin = &first.scenario().plant.model;
        let mark = format!("-from-{origin}-{}s", seconds(from.as_nanos()));
        let execution = self.session.execution(&other, &mark);
        let mut line = RunLine::new(self.session.shows_progress(terminal));
        let resumed = guarded(&other.scenario().file, || {
            resume_with_plant(first, &other, saved, &execution, &mut line)
        });
        Ok(resumed?)
    }
}

/// Compares a pair and prints the comparison; returns the exit code of an error if the comparison
/// is not possible or the continuation did not complete.
fn compare(pair: &Pair<'_>, from: Option<SimTime>, json: bool, terminal: &mut Terminal<'_>) -> u8 {
    let [Some(a), Some(b)] = pair.recordings else {
        let missing = TwinError::from(Error::InvalidOptions {
            why: format!(
                "{} and {} cannot be compared: one has no recording",
                pair.plants[0], pair.plants[1]
            ),
            help: "see the error of that run".to_owned(),
        });
        print(pair, from, None, Some(missing.to_string()), json, terminal);
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
    let nothing = || {
        difference
            .as_ref()?
            .nothing
            .then(|| NO_COMMON_SAMPLE.to_owned())
    };
    let error = error
        .or_else(|| pair.continuation?.report.error.clone())
        .or_else(nothing);
    let code = if error.is_some() {
        Status::Error
    } else {
        Status::Pass
    };
    print(pair, from, difference, error, json, terminal);
    code.exit_code()
}

/// Prints a comparison or its error.
fn print(
    pair: &Pair<'_>,
    from: Option<SimTime>,
    difference: Option<EventDifference>,
    error: Option<String>,
    json: bool,
    terminal: &mut Terminal<'_>,
) {
    let from_s = from.map(|from| seconds(from.as_nanos()));
    let lost = pair.continuation.map_or(&[][..], |run| &run.lost);
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
                fingerprint_b: pair
                    .continuation
                    .and_then(|run| run.report.fingerprint.as_deref()),
                error,
                difference,
            },
        });
        return;
    }
    let heading = match from_s {
        None => format!("{}: {b} compared with {a}", pair.scenario),
        Some(at) => format!(
            "{}: {b} compared with {a}, resumed from the state of {a} at {at} s",
            pair.scenario
        ),
    };
    let mut lines = vec![styled(BOLD, &heading)];
    lines.extend(lost.iter().map(|line| format!("  not resumed: {line}")));
    if let (Some(_), Some(recording)) = (pair.continuation, pair.recordings[1]) {
        lines.push(format!("  recording: {recording}"));
    }
    if let Some(error) = &error {
        lines.extend(error.lines().map(|line| format!("  {}", styled(RED, line))));
    }
    if let Some(difference) = &difference {
        lines.push(format!("  a is {a}, b is {b}"));
        let text = difference.text();
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
