//! Summary of an imported log, as text and as JSON.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use twinrig_kernel::SimDuration;
use twinrig_record::{ImportedGroup, ImportedLog, LogGap, LogPeriods};
use twinrig_report::number::{duration, precise};
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_rig::report::seconds;

/// Gaps that are listed in text.
const GAPS_SHOWN: usize = 3;

/// What was read, and where the recording is.
#[derive(Serialize)]
pub(super) struct LogSummary {
    file: String,
    recording: String,
    mapping: String,
    format: &'static str,
    rows: u64,
    left_out: u64,
    start_s: f64,
    end_s: f64,
    origin_ns: i64,
    truncated_at: Option<u64>,
    groups: Vec<GroupSummary>,
    held: BTreeMap<String, u64>,
    absent: Vec<String>,
    settings: BTreeMap<String, String>,
    notes: BTreeMap<String, String>,
}

#[derive(Serialize)]
struct GroupSummary {
    group: &'static str,
    samples: usize,
    periods: Option<LogPeriods>,
    gaps: usize,
    first_gaps: Vec<LogGap>,
    signals: Vec<SignalSummary>,
}

#[derive(Serialize)]
struct SignalSummary {
    name: String,
    unit: &'static str,
    min: f64,
    max: f64,
}

impl GroupSummary {
    fn of(group: &ImportedGroup) -> Self {
        let signals = group.signals.iter().map(|signal| {
            let [min, max] = signal.range();
            SignalSummary {
                name: signal.name.clone(),
                unit: signal.unit.symbol(),
                min,
                max,
            }
        });
        Self {
            group: group.group.word(),
            samples: group.times.len(),
            periods: group.periods,
            gaps: group.gaps.0,
            first_gaps: group.gaps.1.clone(),
            signals: signals.collect(),
        }
    }

    /// Whether samples, intervals and gaps are those of another group, as in logs with rows.
    fn has_times_of(&self, other: &Self) -> bool {
        (self.samples, self.periods, &self.first_gaps)
            == (other.samples, other.periods, &other.first_gaps)
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = Vec::new();
        if let Some(periods) = self.periods {
            let of = |nanos| duration(SimDuration::from_nanos(nanos));
            let text = format!(
                "p1 {}, p50 {}, p99 {}, longest {}",
                of(periods.p1_ns),
                of(periods.p50_ns),
                of(periods.p99_ns),
                of(periods.max_ns)
            );
            facts.push(("interval", text));
        }
        if self.gaps > 0 {
            let shown = self.first_gaps.iter().take(GAPS_SHOWN).map(|gap| {
                let length = duration(SimDuration::from_nanos(gap.length_ns));
                format!("{length} after {}", precise(seconds(gap.start_ns), "s"))
            });
            let shown: Vec<String> = shown.collect();
            let more = if self.gaps > shown.len() { ", …" } else { "" };
            facts.push(("gaps", format!("{}: {}{more}", self.gaps, shown.join(", "))));
        }
        facts
    }
}

impl LogSummary {
    pub(super) fn of(log: &ImportedLog, file: &Path, recording: &Path) -> Self {
        let [start, end] = log.span().map(|time| seconds(time.as_nanos()));
        Self {
            file: file.display().to_string(),
            recording: recording.display().to_string(),
            mapping: log.mapping.0.clone(),
            format: log.format.word(),
            rows: log.rows,
            left_out: log.left_out,
            start_s: start,
            end_s: end,
            origin_ns: log.origin_ns,
            truncated_at: log.truncated_at,
            groups: log.groups.iter().map(GroupSummary::of).collect(),
            held: log.held.iter().cloned().collect(),
            absent: log.absent.clone(),
            settings: log.settings.iter().cloned().collect(),
            notes: log.notes.iter().cloned().collect(),
        }
    }

    /// Returns the summary for a terminal.
    pub(super) fn text(&self) -> String {
        let mut lines = vec![format!("written {}: {}", self.recording, self.file)];
        let mut facts = Grid::new(&[Left, Left]);
        for (name, text) in self.facts() {
            facts.row([Cell::from(name), Cell::from(text)]);
        }
        lines.extend(facts.lines(2));
        let mut signals = Grid::new(&[Left, Left, Right, Right, Left]);
        signals.header("signal||least|greatest|unit");
        for group in &self.groups {
            for signal in &group.signals {
                let number = |value| Cell::from(precise(value, ""));
                let unit = if signal.unit == "1" { "" } else { signal.unit };
                signals.row([
                    Cell::from(signal.name.as_str()),
                    Cell::from(group.group),
                    number(signal.min),
                    number(signal.max),
                    Cell::from(unit),
                ]);
            }
        }
        lines.extend(signals.lines(2));
        lines.join("\n")
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = vec![("rows", self.rows.to_string())];
        let origin = match self.origin_ns / 1_000_000_000 {
            0 => String::new(),
            origin => format!("; 0 is {origin} s of the log"),
        };
        let [start, end] = [self.start_s, self.end_s].map(|time| precise(time, "s"));
        facts.push(("time", format!("{start} to {end}{origin}")));
        match self.groups.as_slice() {
            [first, others @ ..] if others.iter().all(|other| other.has_times_of(first)) => {
                facts.extend(first.facts());
            }
            groups => {
                for group in groups {
                    facts.push((group.group, format!("{} samples", group.samples)));
                    facts.extend(group.facts());
                }
            }
        }
        if self.left_out > 0 {
            let text = format!("{} rows, before all signals had a value", self.left_out);
            facts.push(("left out", text));
        }
        let held = self
            .held
            .iter()
            .map(|(column, count)| format!("{column} in {count} of {} rows", self.rows));
        let held: Vec<String> = held.collect();
        if !held.is_empty() {
            facts.push(("repeated", held.join(", ")));
        }
        if !self.absent.is_empty() {
            facts.push(("absent", self.absent.join(", ")));
        }
        if let Some(bytes) = self.truncated_at {
            facts.push(("truncated", format!("read up to byte {bytes}")));
        }
        let pairs = |pairs: &BTreeMap<String, String>| {
            let pairs = pairs.iter().map(|(key, value)| format!("{key} = {value}"));
            pairs.collect::<Vec<_>>().join(", ")
        };
        for (name, all) in [("settings", &self.settings), ("notes", &self.notes)] {
            if !all.is_empty() {
                facts.push((name, pairs(all)));
            }
        }
        facts
    }
}
