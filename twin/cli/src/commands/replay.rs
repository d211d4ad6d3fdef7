//! `twin replay`

use std::path::Path;

use serde::Serialize;
use twinrig_record::Recording;
use twinrig_scenario::Setting;

use super::diff::{Difference, cut_off, open};
use super::{FINE, NOT_SO, Terminal, WRONG};
use crate::args::ReplayArgs;
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::assembly::sources::{ROBOT_FILE, SCENARIO_FILE};
use crate::error::TwinError;
use crate::report::{Report, Status, seconds};
use crate::run::execute::{EXCHANGED_NOTE, Execution, HARDWARE_NOTE, SETTINGS_NOTE, execute_until};
use crate::run::interrupt;

#[derive(Serialize)]
struct Replayed {
    recording: String,
    scenario: String,
    identical: bool,
    fingerprint_recorded: Option<String>,
    fingerprint: Option<String>,
    /// None if the recording was cut off: expectations are of whole runs.
    verdict: Option<Status>,
    /// Where the recording was cut off, and where it is no longer compared.
    cut_off_s: Option<f64>,
    error: Option<String>,
    difference: Difference,
    /// It was cut off before it held anything.
    #[serde(skip)]
    nothing: bool,
}

pub(super) fn replay(registry: &Registry, args: &ReplayArgs, terminal: &mut Terminal<'_>) -> u8 {
    if terminal.watched {
        interrupt::listen();
    }
    match again(registry, args, terminal.watched && !args.json) {
        Ok(replayed) => {
            let code = match (replayed.nothing, replayed.identical) {
                (true, _) => WRONG,
                (false, true) => FINE,
                (false, false) => NOT_SO,
            };
            if args.json {
                terminal.print_json(&replayed);
            } else {
                let text = text(&replayed, terminal);
                terminal.print(&text);
            }
            code
        }
        Err(error) => {
            terminal.fail(&error, args.json);
            WRONG
        }
    }
}

fn again(registry: &Registry, args: &ReplayArgs, progress: bool) -> Result<Replayed, TwinError> {
    let path = &args.recording;
    let recorded = open(path)?;
    let assembly = assembly(registry, path, &recorded)?;
    let beside = CompositePlant::new(path);
    let execution = Execution {
        recording: Some(beside.0.clone()),
        progress,
        ports: Vec::new(),
    };
    let cut_off = cut_off(&recorded);
    let end = cut_off.unwrap_or_else(|| assembly.end());
    let report: Report = execute_until(&assembly, &execution, end)?;
    let new = open(&beside.0)?;
    drop(beside);
    let difference = match cut_off {
        // The new run was made to end there, too, perhaps between two samples of one instant.
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
        nothing: cut_off.is_some() && difference.nothing,
        difference,
    })
}

/// A new recording next to the old one, gone when it has been compared.
struct CompositePlant(std::path::PathBuf);

impl CompositePlant {
    fn new(path: &Path) -> Self {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".replay");
        Self(path.with_file_name(name))
    }
}

impl Drop for CompositePlant {
    fn drop(&mut self) {
        // It may not have come into being.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The assembly that the recording was made with.
fn assembly<'r>(
    registry: &'r Registry,
    path: &Path,
    recorded: &Recording,
) -> Result<Assembly<'r>, TwinError> {
    let lacks = |why: String| TwinError::NotReplayable {
        path: path.to_owned(),
        why,
    };
    let text = |name: &str| {
        let bytes = recorded.attachment(name);
        let text = bytes.and_then(|bytes| std::str::from_utf8(bytes).ok());
        text.ok_or_else(|| lacks(format!("it has no attachment `{name}`")))
    };
    if recorded.note(HARDWARE_NOTE).is_some() {
        return Err(lacks(
            "boards and plant were hardware; the attached scenario runs on the twin".to_owned(),
        ));
    }
    if let Some(at_s) = recorded.note(EXCHANGED_NOTE) {
        return Err(lacks(format!(
            "its plant took the place of another at {at_s} s, and what came before is not in it; run both again with --from"
        )));
    }
    let settings = recorded.note(SETTINGS_NOTE).unwrap_or("[]");
    let settings: Vec<[String; 2]> = serde_json::from_str(settings)
        .map_err(|error| lacks(format!("its settings do not read: {error}")))?;
    let settings = settings.into_iter().map(|[key, value]| Setting {
        origin: "--set".to_owned(),
        key,
        value,
    });
    let settings: Vec<Setting> = settings.collect();
    let robot = recorded.attachment(ROBOT_FILE).is_some();
    let robot = robot.then(|| text(ROBOT_FILE)).transpose()?;
    let kept = recorded.attachments();
    let kept = kept.map(|(name, bytes)| (name.to_owned(), bytes.to_vec()));
    Assembly::of_kept(
        registry,
        text(SCENARIO_FILE)?,
        robot,
        kept.collect(),
        &settings,
    )
}

fn text(replayed: &Replayed, terminal: &Terminal<'_>) -> String {
    let paint = terminal.paint;
    let mut lines = vec![paint.bold(&replayed.scenario)];
    if let (true, Some(at)) = (replayed.identical, replayed.cut_off_s) {
        let word = paint.green("same as far as it goes");
        lines.push(format!("  {word}: the recording was cut off at {at} s"));
        return lines.join("\n");
    }
    if replayed.identical {
        let word = paint.green("identical");
        let fingerprint = replayed.fingerprint.as_deref().unwrap_or_default();
        lines.push(format!("  {word}: fingerprint {fingerprint}"));
        return lines.join("\n");
    }
    if let Some(at) = replayed.cut_off_s {
        let word = paint.yellow("cut off");
        lines.push(format!(
            "  {word}: the recording was cut off at {at} s; as far as it goes:"
        ));
    } else {
        lines.push(format!("  {}", paint.red("not the same run")));
        for (name, print) in [
            ("recorded", &replayed.fingerprint_recorded),
            ("again", &replayed.fingerprint),
        ] {
            let print = print.as_deref().unwrap_or("none");
            lines.push(format!("    {name:<9} {print}"));
        }
    }
    let difference = replayed.difference.text(paint);
    lines.extend(difference.lines().map(|line| format!("  {line}")));
    if let Some(error) = &replayed.error {
        lines.extend(error.lines().map(|line| format!("  {line}")));
    }
    lines.join("\n")
}
