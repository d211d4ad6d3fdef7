//! Command `twin replay`: repetition of the run of a recording.

use std::path::Path;

use serde::Serialize;

use super::diff::{Difference, cut_off, open};
use super::{FAILURE, NEGATIVE, SUCCESS, Terminal};
use crate::args::ReplayArgs;
use crate::error::TwinError;
use crate::progress::RunLine;
use twinrig_report::text::style::{BOLD, GREEN, RED, YELLOW, styled};
use twinrig_rig::registry::Registry;
use twinrig_rig::report::{Status, seconds};
use twinrig_rig::run::execute::execute_saving;
use twinrig_rig::run::execution::Execution;
use twinrig_rig::run::recorded::{NotRepeatable, assembly_of};

#[derive(Serialize)]
struct Replayed {
    recording: String,
    scenario: String,
    identical: bool,
    fingerprint_recorded: Option<String>,
    fingerprint: Option<String>,
    /// None if the recording was cut off: expectations apply to complete runs.
    verdict: Option<Status>,
    /// Time at which the recording was cut off and the comparison ends.
    cut_off_s: Option<f64>,
    error: Option<String>,
    difference: Difference,
    /// Whether the recording was cut off before its first sample.
    #[serde(skip)]
    is_empty: bool,
}

pub(super) fn replay(registry: &Registry, args: &ReplayArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.interactive {
        crate::interrupt::listen();
    }
    match repeat(registry, args, terminal.interactive && !args.json) {
        Ok(replayed) => {
            let code = match (replayed.is_empty, replayed.identical) {
                (true, _) => FAILURE,
                (false, true) => SUCCESS,
                (false, false) => NEGATIVE,
            };
            if args.json {
                terminal.print_json(&replayed);
            } else {
                let text = text(&replayed);
                terminal.print(&text);
            }
            code
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn repeat(registry: &Registry, args: &ReplayArgs, progress: bool) -> Result<Replayed, TwinError> {
    let path = &args.recording;
    let recorded = open(path)?;
    let assembly = assembly_of(registry, &recorded).map_err(|why| not_replayable(path, why))?;
    let repetition = TemporaryRecording::new(path);
    let execution = Execution {
        recording: Some(repetition.0.clone()),
        ports: Vec::new(),
        strict: false,
    };
    let cut_off = cut_off(&recorded);
    let end = cut_off.unwrap_or_else(|| assembly.end());
    let mut line = RunLine::new(progress);
    let (report, _) = execute_saving(&assembly, &execution, end, None, Some(&mut line))?;
    drop(line);
    let new = open(&repetition.0)?;
    drop(repetition);
    let difference = match cut_off {
        // The repetition ends at the same time, possibly between two samples of one instant.
        Some(_) => Difference::within(&recorded, &new, [cut_off; 2]),
        None => Difference::of(&recorded, &new),
    };
    let same_end = recorded.fingerprint() == new.fingerprint();
    Ok(Replayed {
        recording: path.display().to_string(),
        scenario: report.scenario,
        identical: match cut_off {
            Some(_) => difference.identical,
            None => same_end,
        },
        fingerprint_recorded: recorded.fingerprint().map(str::to_owned),
        fingerprint: report.fingerprint,
        verdict: cut_off.is_none().then_some(report.verdict),
        cut_off_s: cut_off.map(|at| seconds(at.as_nanos())),
        error: report.error,
        is_empty: cut_off.is_some() && difference.nothing,
        difference,
    })
}

fn not_replayable(path: &Path, why: NotRepeatable) -> TwinError {
    match why {
        NotRepeatable::Recording(why) => TwinError::NotReplayable {
            path: path.to_owned(),
            why,
        },
        NotRepeatable::Scenario(error) => (*error).into(),
    }
}

/// Recording of the repetition, in the folder of the original one; deleted on drop.
struct TemporaryRecording(std::path::PathBuf);

impl TemporaryRecording {
    fn new(path: &Path) -> Self {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".replay");
        Self(path.with_file_name(name))
    }
}

impl Drop for TemporaryRecording {
    fn drop(&mut self) {
        // The file may not exist.
        let _ = std::fs::remove_file(&self.0);
    }
}

fn text(replayed: &Replayed) -> String {
    let mut lines = vec![styled(BOLD, &replayed.scenario)];
    if let (true, Some(at)) = (replayed.identical, replayed.cut_off_s) {
        let word = styled(GREEN, "identical up to the cut-off");
        lines.push(format!("  {word}: the recording was cut off at {at} s"));
        return lines.join("\n");
    }
    if replayed.identical {
        let word = styled(GREEN, "identical");
        let fingerprint = replayed.fingerprint.as_deref().unwrap_or_default();
        lines.push(format!("  {word}: fingerprint {fingerprint}"));
        return lines.join("\n");
    }
    if let Some(at) = replayed.cut_off_s {
        let word = styled(YELLOW, "cut off");
        lines.push(format!(
            "  {word}: the recording was cut off at {at} s; comparison up to there:"
        ));
    } else {
        lines.push(format!("  {}", styled(RED, "not identical")));
        for (name, print) in [
            ("recorded", &replayed.fingerprint_recorded),
            ("replayed", &replayed.fingerprint),
        ] {
            let print = print.as_deref().unwrap_or("none");
            lines.push(format!("    {name:<9} {print}"));
        }
    }
    let difference = replayed.difference.text();
    lines.extend(difference.lines().map(|line| format!("  {line}")));
    if let Some(error) = &replayed.error {
        lines.extend(error.lines().map(|line| format!("  {line}")));
    }
    lines.join("\n")
}
