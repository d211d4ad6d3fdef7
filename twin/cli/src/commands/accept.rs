//! Command `twin accept`: recordings become the baseline of later runs.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use twinrig_record::{Recording, VerdictMessage};
use twinrig_report::text::style::{BOLD, GREEN, YELLOW, styled};

use super::baseline::{Baseline, TEMPLATE, TOLERANCES};
use super::diff::{cut_off, open};
use super::outputs::write_whole;
use super::{FAILURE, SUCCESS, Terminal};
use crate::args::AcceptArgs;
use crate::error::TwinError;
use twinrig_rig::error::Error;

/// A recording that was taken, in its serialised form.
#[derive(Serialize)]
struct Accepted {
    recording: String,
    /// `pass`, `fail` or `error`.
    verdict: String,
    /// `new`, `equal` or `changed`.
    change: &'static str,
    /// Footsteps and signals beyond the tolerances, old and new.
    moved: Vec<String>,
}

#[derive(Serialize)]
struct Baselined<'a> {
    baseline: String,
    recordings: &'a [Accepted],
}

/// Differences shown of a recording; `--json` has all.
const SHOWN: usize = 24;

pub(super) fn accept(args: &AcceptArgs, terminal: &mut Terminal<'_>) -> u8 {
    match accepted(args) {
        Ok(recordings) => {
            if args.json {
                terminal.print_json(&Baselined {
                    baseline: args.baseline.display().to_string(),
                    recordings: &recordings,
                });
            } else {
                for one in &recordings {
                    let text = text(one);
                    terminal.print(&text);
                }
            }
            SUCCESS
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn accepted(args: &AcceptArgs) -> Result<Vec<Accepted>, TwinError> {
    let folder = &args.baseline;
    let recordings = if args.recordings.is_empty() {
        named_alike(folder, &args.from)?
    } else {
        args.recordings.clone()
    };
    for (n, path) in recordings.iter().enumerate() {
        if recordings[..n]
            .iter()
            .any(|other| other.file_name() == path.file_name())
        {
            let path = path.clone();
            let why = "two of the recordings have this name, which is that in the baseline";
            let (why, help) = (why.to_owned(), "name one of them".to_owned());
            return Err(TwinError::Refused { path, why, help });
        }
    }
    // Nothing is written unless all can be.
    let opened = recordings.iter().map(|path| Ok((path, taken(path)?)));
    let opened: Vec<_> = opened.collect::<Result<_, TwinError>>()?;
    let write = |path: &Path, source| {
        let path = path.to_owned();
        TwinError::from(Error::Write { path, source })
    };
    fs::create_dir_all(folder).map_err(|source| write(folder, source))?;
    let tolerances = folder.join(TOLERANCES);
    if !tolerances.exists() {
        fs::write(&tolerances, TEMPLATE).map_err(|source| write(&tolerances, source))?;
    }
    let baseline = Baseline::open(folder)?;
    let mut all = Vec::new();
    for (path, (new, verdict)) in opened {
        let kept = baseline.path_of(path);
        let (change, moved) = if kept.is_file() {
            compared(&baseline, &kept, &new)?
        } else {
            ("new", Vec::new())
        };
        let bytes = fs::read(path).map_err(|source| write(path, source))?;
        write_whole(&kept, &bytes)?;
        all.push(Accepted {
            recording: kept.display().to_string(),
            verdict,
            change,
            moved,
        });
    }
    Ok(all)
}

/// Returns what a new recording changes of the kept one. One that cannot be compared is replaced.
fn compared(
    baseline: &Baseline,
    kept: &Path,
    new: &Recording,
) -> Result<(&'static str, Vec<String>), TwinError> {
    let old = match open(kept) {
        Ok(old) if cut_off(&old).is_none() => old,
        _ => return Ok(("changed", vec!["the old recording is damaged".to_owned()])),
    };
    if old.fingerprint() == new.fingerprint() {
        return Ok(("equal", Vec::new()));
    }
    let compared = match baseline.compare(kept, &old, new) {
        Err(TwinError::Refused { why, .. }) => return Ok(("changed", vec![why])),
        compared => compared?,
    };
    let moved = compared.parting.into_iter().chain(compared.moved);
    Ok(("changed", moved.collect()))
}

/// Opens a recording that becomes a baseline, with its verdict.
fn taken(path: &Path) -> Result<(Recording, String), TwinError> {
    let recording = open(path)?;
    let verdicts = recording.messages::<VerdictMessage>();
    let verdicts = verdicts.map_err(|source| TwinError::Compare { source })?;
    let verdict = verdicts.into_iter().next_back().map(|(_, it)| it.verdict);
    let is_whole = cut_off(&recording).is_none() && recording.is_complete();
    let verdict = verdict.filter(|_| is_whole);
    match verdict {
        Some(verdict) if verdict != "error" => Ok((recording, verdict)),
        _ => Err(TwinError::Refused {
            path: path.to_owned(),
            why: "the run did not reach its end, so that its recording is no baseline".to_owned(),
            help: "run the scenario again".to_owned(),
        }),
    }
}

/// Returns the recordings in `from` with the names of those in the baseline.
fn named_alike(folder: &Path, from: &Path) -> Result<Vec<PathBuf>, TwinError> {
    let refused = |path: &Path, why: &str, help: &str| TwinError::Refused {
        path: path.to_owned(),
        why: why.to_owned(),
        help: help.to_owned(),
    };
    let listed = fs::read_dir(folder).into_iter().flatten();
    let names = listed.filter_map(|entry| Some(entry.ok()?.file_name()));
    let mut names: Vec<_> = names
        .filter(|name| Path::new(name).extension().is_some_and(|it| it == "mcap"))
        .collect();
    names.sort();
    if names.is_empty() {
        let help = "name recordings: twin accept DIR recordings/trot-seed1.mcap";
        return Err(refused(folder, "the baseline has no recordings yet", help));
    }
    let found: Vec<PathBuf> = names.iter().map(|name| from.join(name)).collect();
    let found: Vec<PathBuf> = found.into_iter().filter(|path| path.is_file()).collect();
    if found.is_empty() {
        let help = "`twin run` writes them; --from names another folder";
        let why = "the folder has none of the recordings of the baseline";
        return Err(refused(from, why, help));
    }
    Ok(found)
}

fn text(accepted: &Accepted) -> String {
    let word = match accepted.change {
        "equal" => styled(GREEN, "equal"),
        change => styled(YELLOW, change),
    };
    let verdict = match accepted.verdict.as_str() {
        "pass" => String::new(),
        verdict => format!("; the verdict of the run is {verdict}"),
    };
    let mut lines = vec![format!(
        "{}  {word}{verdict}",
        styled(BOLD, &accepted.recording)
    )];
    let shown = accepted.moved.iter().take(SHOWN);
    lines.extend(shown.map(|line| format!("  {line}")));
    let more = accepted.moved.len().saturating_sub(SHOWN);
    if more > 0 {
        lines.push(format!("  and {more} more: --json has all"));
    }
    lines.join("\n")
}
